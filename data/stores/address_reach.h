// From where an IP address can be reached, and to which addresses a server may lead.
#pragma once

#include <sys/socket.h>

#include <cstdint>
#include <string>
#include <string_view>

namespace slabstream {

enum class Reach : std::uint8_t {
  kInternet,
  kPrivate,  // 10/8, 172.16/12, 192.168/16, 100.64/10, 198.18/15, fc00::/7, fec0::/10
  kMachine,  // 127/8, ::1
  kLink      // everything else that is no address of the internet: 169.254/16, fe80::/10, and what clouds answer their machines at
};

// An address that holds one of IPv4 counts as that one. Neither IPv4 nor IPv6: kLink.
Reach ReachOf(const std::string& address);  // "10.0.0.1", "fe80::1"; another text: kLink
bool IsIp(const std::string& text);
std::string TextOf(const sockaddr* address);  // the same text; of another family: ""
std::string_view ToString(Reach reach);       // "a private network"

// Whether a server at `from` may lead to one at `to`: to the internet, or to a network that it is in itself, but never to a link.
inline bool MayLead(Reach from, Reach to) { return to == Reach::kInternet || (to == from && to != Reach::kLink); }

// Whether a name that was first reached at one address may be reached at another one, as the names of servers with several addresses are.
// Whoever answers for a name may change what it means, so this is as for redirects, and a name stays in its private network: one of IPv4
// stays in the one of the list above, but may have an address of IPv6 as well.
bool MayMove(const std::string& first, const std::string& now);

}  // namespace slabstream
