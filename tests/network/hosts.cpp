#include "tests/network/hosts.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
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

// Classic BPF for `tc filter ... bpf da`: the verdict 2 drops a packet.
constexpr char kDropAll[] = "1,6 0 0 2";

// Drops the packets of one IPv4 address, which is at byte 26 of an Ethernet frame.
std::string DropOf(const std::string& address) {
  return "4,32 0 0 26,21 0 1 " + std::to_string(ntohl(::inet_addr(address.c_str()))) + ",6 0 0 2,6 0 0 0";
}

void EnterNamespace(const std::string& name) {
  const int space = ::open(("/run/netns/" + name).c_str(), O_RDONLY | O_CLOEXEC);
  CHECK_EQ(::setns(space, CLONE_NEWNET), 0);
  ::close(space);
}

}  // namespace

Result<Hosts> Hosts::Make(int count, Family family) {
  static int made = 0;
  Hosts hosts(fmt::format("slab{}-{}-", ::getpid(), made++), family);
  if (::geteuid() != 0) return Status::Unavailable("network namespaces need root");
  if (std::system(("ip netns add " + hosts.bridge() + " >/dev/null 2>&1").c_str()) != 0)
    return Status::Unavailable("`ip netns add` fails: no iproute2, or no right to do so");
  const std::string no_detection = family == Family::kIpv6 ? " nodad" : "";
  Status done = hosts.Order(hosts.bridge(), "ip link set lo up && ip link add bridge0 type bridge && ip link set bridge0 up");
  for (int host = 0; done.ok() && host < count; ++host) {
    const std::string name = hosts.NameOf(host), port = hosts.PortOf(host);
    hosts.addresses_.push_back(hosts.MakeAddress());
    done = hosts.Order(hosts.bridge(), "ip netns add " + name + " && ip link add " + port + " type veth peer name eth0 netns " + name +
                                           " && ip link set " + port + " master bridge0 up");
    if (done.ok())
      done = hosts.Order(name, "ip link set lo up && ip addr add " + hosts.Bare(hosts.AddressOf(host)) + " dev eth0" + no_detection +
                                   " && ip link set eth0 up");
  }
  if (!done.ok()) return Status::Unavailable("veth devices or bridges cannot be made here: " + done.message());
  return hosts;
}

Hosts::Hosts(Hosts&& other) noexcept
    : prefix_(std::exchange(other.prefix_, {})),
      family_(other.family_),
      addresses_made_(other.addresses_made_),
      addresses_(std::move(other.addresses_)) {}

Hosts::~Hosts() {
  if (prefix_.empty()) return;
  std::string names = bridge();
  for (std::size_t host = 0; host < addresses_.size(); ++host) names.append(" ").append(NameOf(int(host)));
  (void)std::system(("for name in " + names + "; do ip netns del $name; done >/dev/null 2>&1").c_str());
}

std::string Hosts::MakeAddress() {
  const std::string number = std::to_string(++addresses_made_);
  return family_ == Family::kIpv4 ? "10.77.0." + number : "[fd00:77::" + number + "]";
}

std::string Hosts::Bare(const std::string& address) const {
  return family_ == Family::kIpv4 ? address + "/24" : address.substr(1, address.size() - 2) + "/64";
}

Status Hosts::Order(const std::string& space, const std::string& order) const {
  const std::string command = "nsenter --net=/run/netns/" + space + " sh -c '" + order + "' >/dev/null 2>&1";
  return std::system(command.c_str()) == 0 ? Status::Ok() : Status::Unavailable("this kernel does not take `" + order + "`");
}

// nsenter instead of `ip netns exec`, which would mount another /sys.
std::vector<std::string> Hosts::On(int host, std::vector<std::string> command) const {
  const std::array<std::string, 2> enter = {"/usr/bin/nsenter", "--net=/run/netns/" + NameOf(host)};
  command.insert(command.begin(), enter.begin(), enter.end());
  return command;
}

void Hosts::Run(int host, const std::function<void()>& function) const {
  std::jthread([&] {
    EnterNamespace(NameOf(host));
    function();
  });
}

Status Hosts::SetLink(int host, bool up) const { return Order(bridge(), "ip link set " + PortOf(host) + (up ? " up" : " down")); }
Status Hosts::Unplug(int host) const { return Order(bridge(), "ip link del " + PortOf(host)); }

Status Hosts::Drop(const std::string& space, const std::string& device, const std::string& program) const {
  return Order(space, "tc qdisc add dev " + device + " ingress && tc filter add dev " + device +
                          " parent ffff: protocol all bpf da bytecode \"" + program + "\"");
}

// What arrives is dropped at the bridge's port or at the host's card.
Status Hosts::DropFrom(int host) const { return Drop(bridge(), PortOf(host), kDropAll); }
Status Hosts::DropTo(int host) const { return Drop(NameOf(host), "eth0", kDropAll); }
Status Hosts::DropBetween(int sender, int host) const { return Drop(NameOf(host), "eth0", DropOf(AddressOf(sender))); }

Status Hosts::StopDropping(int host) const {
  const Status at_port = Order(bridge(), "tc qdisc del dev " + PortOf(host) + " ingress");
  return at_port.ok() ? at_port : Order(NameOf(host), "tc qdisc del dev eth0 ingress");
}

Status Hosts::LimitRate(int host, int mbit) const {
  const std::string limit = " root tbf rate " + std::to_string(mbit) + "mbit burst 64kb latency 200ms";
  const Status sends = Order(NameOf(host), "tc qdisc add dev eth0" + limit);
  return sends.ok() ? Order(bridge(), "tc qdisc add dev " + PortOf(host) + limit) : sends;
}

Status Hosts::ResetConnections(int host, const std::vector<int>& peers) const {
  std::string filter;
  for (const int peer : peers) filter.append(filter.empty() ? "dst " : " or dst ").append(AddressOf(peer));
  return Order(NameOf(host), "ss -K " + filter);
}

Status Hosts::ChangeAddress(int host) {
  std::string& address = addresses_[std::size_t(host)];
  const std::string before = std::exchange(address, MakeAddress());
  return Order(NameOf(host), "ip addr del " + Bare(before) + " dev eth0 && ip addr add " + Bare(address) + " dev eth0");
}

Hosts::Capture::Capture(const Hosts& hosts) {
  // A thread of its own enters the namespace; a socket stays in that in which it was made.
  std::jthread([&] {
    EnterNamespace(hosts.bridge());
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
