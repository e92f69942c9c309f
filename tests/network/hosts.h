// Hosts: network namespaces as the hosts of a network, joined by a bridge in one more namespace. What is sent there never leaves it.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "common/base/status.h"

namespace slabstream {

class Hosts {
 public:
  enum class Family { kIpv4, kIpv6 };

  // Unavailable: namespaces cannot be made here (not root, or iproute2 is missing).
  static Result<Hosts> Make(int count, Family family = Family::kIpv4);
  Hosts(Hosts&&) noexcept;
  Hosts& operator=(Hosts&&) = delete;
  ~Hosts();  // removes them

  const std::string& AddressOf(int host) const { return addresses_[std::size_t(host)]; }  // as endpoints name it: [fd00:77::1]
  // The command, to be run on a host.
  std::vector<std::string> On(int host, std::vector<std::string> command) const;
  // Runs `function` on a thread of that host, and waits for it. Sockets, and threads that it starts, stay there.
  void Run(int host, const std::function<void()>& function) const;

  // ---- what happens to networks. Status: what the kernel cannot do (Unavailable).
  Status SetLink(int host, bool up) const;                                 // the cable to the bridge
  Status Unplug(int host) const;                                           // for ever, with the network card
  Status DropFrom(int host) const;                                         // nothing that the host sends arrives
  Status DropTo(int host) const;                                           // nothing arrives at the host
  Status DropBetween(int sender, int host) const;                          // nothing that this IPv4 host sends arrives at that one
  Status StopDropping(int host) const;                                     // ends the three
  Status LimitRate(int host, int mbit) const;                              // in each direction
  Status ResetConnections(int host, const std::vector<int>& peers) const;  // all tcp connections that the host has with those
  Status ChangeAddress(int host);                                          // to one that no host has had

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
  Hosts(std::string prefix, Family family) : prefix_(std::move(prefix)), family_(family) {}
  std::string NameOf(int host) const { return prefix_ + std::to_string(host); }
  std::string bridge() const { return prefix_ + "b"; }
  // The port of the bridge that leads to the host.
  static std::string PortOf(int host) { return std::string("p").append(std::to_string(host)); }
  // iproute2 (ip, tc, ss) in a namespace.
  Status Order(const std::string& space, const std::string& order) const;
  Status Drop(const std::string& space, const std::string& device, const std::string& program) const;
  std::string MakeAddress();
  std::string Bare(const std::string& address) const;  // without brackets

  std::string prefix_;  // empty: moved from
  Family family_;
  int addresses_made_ = 0;
  std::vector<std::string> addresses_;  // by host
};

}  // namespace slabstream
