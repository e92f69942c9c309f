#include "tests/network/hosts.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <linux/if_ether.h>
#include <sched.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <thread>
#include <utility>

#include "common/base/check.h"

namespace slabstream {
namespace {

// Exit status 0.
bool Runs(const std::string& command) { return std::system((command + " >/dev/null 2>&1").c_str()) == 0; }

}  // namespace

Result<Hosts> Hosts::Make(int count) {
  Hosts hosts(std::string("slab").append(std::to_string(::getpid())).append("-"));
  if (::geteuid() != 0) return Status::Unavailable("network namespaces need root");
  if (!Runs("ip netns add " + hosts.bridge())) return Status::Unavailable("`ip netns add` fails: no iproute2, or no right to do so");
  const std::string in_bridge = "ip -n " + hosts.bridge() + " ";
  bool ok =
      Runs(in_bridge + "link set lo up") && Runs(in_bridge + "link add bridge0 type bridge") && Runs(in_bridge + "link set bridge0 up");
  for (int host = 0; ok && host < count; ++host) {
    ++hosts.count_;
    const std::string name = hosts.NameOf(host), in_host = "ip -n " + name + " ", port = std::string("p").append(std::to_string(host));
    ok = Runs("ip netns add " + name) && Runs(in_host + "link set lo up") &&
         Runs(in_host + "link add eth0 type veth peer name " + port + " netns " + hosts.bridge()) &&
         Runs(in_host + "addr add " + AddressOf(host) + "/24 dev eth0") && Runs(in_host + "link set eth0 up") &&
         Runs(in_bridge + "link set " + port + " master bridge0 up");
  }
  if (!ok) return Status::Unavailable("veth devices or bridges cannot be made here");
  return hosts;
}

Hosts::Hosts(Hosts&& other) noexcept : prefix_(std::exchange(other.prefix_, {})), count_(other.count_) {}

Hosts::~Hosts() {
  if (prefix_.empty()) return;
  for (int host = 0; host < count_; ++host) Runs("ip netns del " + NameOf(host));
  Runs("ip netns del " + bridge());
}

// nsenter instead of `ip netns exec`, which would mount another /sys.
std::vector<std::string> Hosts::On(int host, std::vector<std::string> command) const {
  const std::array<std::string, 2> enter = {"/usr/bin/nsenter", "--net=/run/netns/" + NameOf(host)};
  command.insert(command.begin(), enter.begin(), enter.end());
  return command;
}

Hosts::Capture::Capture(const Hosts& hosts) {
  // A thread of its own enters the namespace; a socket stays in that in which it was made.
  std::jthread([&] {
    const int space = ::open(("/run/netns/" + hosts.bridge()).c_str(), O_RDONLY | O_CLOEXEC);
    CHECK_EQ(::setns(space, CLONE_NEWNET), 0);
    ::close(space);
    descriptor_ = ::socket(AF_PACKET, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, htons(ETH_P_ALL));
    constexpr int kBytes = 64 << 20;
    (void)::setsockopt(descriptor_, SOL_SOCKET, SO_RCVBUFFORCE, &kBytes, sizeof(kBytes));
  });
  CHECK_GE(descriptor_, 0);
}

Hosts::Capture::~Capture() { ::close(descriptor_); }

std::string Hosts::Capture::TakeAll() {
  std::string all;
  std::array<char, 1 << 16> packet{};
  for (ssize_t bytes = 0; (bytes = ::recv(descriptor_, packet.data(), packet.size(), 0)) >= 0;)
    all.append(packet.data(), std::size_t(bytes));
  return all;
}

}  // namespace slabstream
