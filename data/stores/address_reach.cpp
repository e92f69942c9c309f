#include "data/stores/address_reach.h"

#include <arpa/inet.h>
#include <netinet/in.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <span>

#include "common/base/check.h"

namespace slabstream {
namespace {

using Ip = std::array<std::uint8_t, 16>;  // an IPv4 address is ::ffff:a.b.c.d

struct Network {
  const char* address;
  int bits;
  Reach reach;
};

// The first one that holds an address decides. The special-purpose registries of IANA, and addresses at which clouds tell their machines
// secrets: Alibaba, Azure, Oracle, Amazon and Google.
constexpr Network kNetworks[] = {
    {"127.0.0.0", 8, Reach::kMachine},    {"100.100.100.200", 32, Reach::kLink},
    {"168.63.129.16", 32, Reach::kLink},  {"10.0.0.0", 8, Reach::kPrivate},
    {"172.16.0.0", 12, Reach::kPrivate},  {"192.168.0.0", 16, Reach::kPrivate},
    {"100.64.0.0", 10, Reach::kPrivate},  {"198.18.0.0", 15, Reach::kPrivate},
    {"0.0.0.0", 8, Reach::kLink},         {"169.254.0.0", 16, Reach::kLink},
    {"192.0.0.0", 24, Reach::kLink},      {"224.0.0.0", 3, Reach::kLink},
    {"::1", 128, Reach::kMachine},        {"::", 128, Reach::kLink},
    {"fd00:ec2::", 32, Reach::kLink},     {"fd20:ce::254", 128, Reach::kLink},
    {"fc00::", 7, Reach::kPrivate},       {"fec0::", 10, Reach::kPrivate},
    {"64:ff9b:1::", 48, Reach::kPrivate}, {"fe80::", 10, Reach::kLink},
    {"ff00::", 8, Reach::kLink},
};

Ip FromV4(std::span<const std::uint8_t, 4> v4) {
  Ip ip{};
  ip[10] = ip[11] = 0xFF;
  std::ranges::copy(v4, ip.begin() + 12);
  return ip;
}

// The IPv4 address in one of IPv6 that leads to it: mapped, compatible, by 6to4 or by NAT64.
Ip WithoutWrapping(const Ip& ip) {
  const auto begins_with = [&](std::initializer_list<std::uint8_t> bytes) { return std::equal(bytes.begin(), bytes.end(), ip.begin()); };
  const auto v4_at = [&](std::size_t at) { return FromV4(std::span<const std::uint8_t, 4>(ip.data() + at, 4)); };
  if (begins_with({0x20, 0x02})) return v4_at(2);
  if (begins_with({0, 0x64, 0xFF, 0x9B, 0, 0, 0, 0, 0, 0, 0, 0})) return v4_at(12);
  const bool compatible = begins_with({0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0});
  return compatible && (ip[12] | ip[13] | ip[14]) != 0 ? v4_at(12) : ip;
}

bool ParseIp(const char* text, Ip& ip) {
  std::array<std::uint8_t, 4> v4{};
  if (::inet_pton(AF_INET6, text, ip.data()) == 1) return true;
  if (::inet_pton(AF_INET, text, v4.data()) != 1) return false;
  ip = FromV4(v4);
  return true;
}

// The network that holds it; null: the internet.
const Network* NetworkOf(const Ip& address) {
  const Ip ip = WithoutWrapping(address);
  for (const Network& network : kNetworks) {
    Ip base{};
    CHECK(ParseIp(network.address, base));
    constexpr int kV4Bits = 96;
    const int bits = network.bits + (std::strchr(network.address, ':') == nullptr ? kV4Bits : 0);
    const auto same = [&](std::size_t byte) {
      const int of_byte = std::clamp(bits - 8 * int(byte), 0, 8);
      return ((ip[byte] ^ base[byte]) >> (8 - of_byte)) == 0;
    };
    bool inside = true;
    for (std::size_t byte = 0; byte < ip.size(); ++byte) inside = inside && same(byte);
    if (inside) return &network;
  }
  return nullptr;
}

}  // namespace

Reach ReachOf(const std::string& address) {
  Ip ip{};
  if (!ParseIp(address.c_str(), ip)) return Reach::kLink;
  const Network* const network = NetworkOf(ip);
  return network == nullptr ? Reach::kInternet : network->reach;
}

std::string TextOf(const sockaddr* address) {
  std::array<char, INET6_ADDRSTRLEN> text{};
  const bool v4 = address->sa_family == AF_INET;
  const void* const bytes = v4 ? static_cast<const void*>(&reinterpret_cast<const sockaddr_in*>(address)->sin_addr)
                               : &reinterpret_cast<const sockaddr_in6*>(address)->sin6_addr;
  return ::inet_ntop(address->sa_family, bytes, text.data(), text.size()) == nullptr ? "" : text.data();
}

bool IsIp(const std::string& text) {
  Ip unused{};
  return ParseIp(text.c_str(), unused);
}

bool MayMove(const std::string& first, const std::string& now) {
  if (now == first) return true;
  Ip from{}, to{};
  if (!MayLead(ReachOf(first), ReachOf(now)) || !ParseIp(first.c_str(), from) || !ParseIp(now.c_str(), to)) return false;
  const Network *const one = NetworkOf(from), *const other = NetworkOf(to);
  return ReachOf(now) != Reach::kPrivate || one == other ||
         (std::strchr(one->address, ':') == nullptr) != (std::strchr(other->address, ':') == nullptr);
}

std::string_view ToString(Reach reach) {
  switch (reach) {
    case Reach::kInternet: return "the internet";
    case Reach::kPrivate: return "a private network";
    case Reach::kMachine: return "this machine";
    case Reach::kLink: return "this machine's link";
  }
  return {};
}

}  // namespace slabstream
