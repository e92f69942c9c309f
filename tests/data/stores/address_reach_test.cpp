#include "data/stores/address_reach.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>

#include <utility>
#include <vector>

namespace slabstream {
namespace {

TEST(AddressReach, TellsWhereAnAddressIs) {
  const std::pair<Reach, std::vector<const char*>> expected[] = {
      {Reach::kInternet,
       {"1.1.1.1", "8.8.8.8", "11.0.0.0", "172.32.0.1", "192.169.0.1", "100.128.0.1", "192.0.1.1", "2606:4700::1111", "2002:101:101::1",
        "64:ff9b::101:101", "::ffff:1.1.1.1"}},
      {Reach::kPrivate,
       {"10.0.0.1", "172.16.0.1", "172.31.255.255", "192.168.1.1", "100.64.0.1", "100.100.100.201", "198.19.0.1", "fd12:3456::1", "fc00::1",
        "fec0::1", "::ffff:10.0.0.1", "64:ff9b::a00:1", "2002:a00:1::1", "64:ff9b:1::1"}},
      {Reach::kMachine, {"127.0.0.1", "127.255.255.255", "::1", "::ffff:127.0.0.1", "::127.0.0.1", "2002:7f00:1::"}},
      {Reach::kLink,
       {"169.254.169.254", "192.0.0.192", "100.100.100.200", "168.63.129.16", "0.0.0.0", "224.0.0.1", "255.255.255.255", "fe80::1",
        "ff02::1", "::", "fd00:ec2::254", "fd20:ce::254", "::ffff:169.254.169.254", "64:ff9b::a9fe:a9fe", "no address", ""}}};
  for (const auto& [reach, addresses] : expected) {
    for (const char* const address : addresses) {
      EXPECT_EQ(ReachOf(std::string(address)), reach) << address;
      sockaddr_in v4{};
      sockaddr_in6 v6{};
      v4.sin_family = AF_INET;
      v6.sin6_family = AF_INET6;
      if (::inet_pton(AF_INET, address, &v4.sin_addr) == 1) {
        EXPECT_EQ(ReachOf(reinterpret_cast<sockaddr*>(&v4)), reach) << address;
      }
      if (::inet_pton(AF_INET6, address, &v6.sin6_addr) == 1) {
        EXPECT_EQ(ReachOf(reinterpret_cast<sockaddr*>(&v6)), reach) << address;
      }
    }
  }
}

TEST(AddressReach, AServerLeadsToTheInternetOrStaysWhereItIs) {
  constexpr Reach kAll[] = {Reach::kInternet, Reach::kPrivate, Reach::kMachine, Reach::kLink};
  for (const Reach from : kAll) {
    for (const Reach to : kAll) EXPECT_EQ(MayLead(from, to), to == Reach::kInternet || (from == to && to != Reach::kLink));
  }
}

}  // namespace
}  // namespace slabstream
