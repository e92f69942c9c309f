// Hosts: network namespaces as the hosts of a network, joined by a bridge in one more namespace. What is sent there never leaves it.
#pragma once

#include <string>
#include <vector>

#include "common/base/status.h"

namespace slabstream {

class Hosts {
 public:
  // Unavailable: namespaces cannot be made here (not root, or iproute2 is missing).
  static Result<Hosts> Make(int count);
  Hosts(Hosts&&) noexcept;
  Hosts& operator=(Hosts&&) = delete;
  ~Hosts();  // removes them

  static std::string AddressOf(int host) { return "10.77.0." + std::to_string(host + 1); }
  // The command, to be run on a host.
  std::vector<std::string> On(int host, std::vector<std::string> command) const;

  // Everything that passes the bridge from its construction on, in one piece.
  class Capture {
   public:
    explicit Capture(const Hosts& hosts);
    ~Capture();
    Capture(const Capture&) = delete;
    Capture& operator=(const Capture&) = delete;
    std::string TakeAll();

   private:
    int descriptor_ = -1;  // a packet socket
  };

 private:
  explicit Hosts(std::string prefix) : prefix_(std::move(prefix)) {}
  std::string NameOf(int host) const { return prefix_ + std::to_string(host); }
  std::string bridge() const { return prefix_ + "b"; }

  std::string prefix_;  // empty: moved from
  int count_ = 0;
};

}  // namespace slabstream
