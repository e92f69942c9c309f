#include "data/stores/address_reach.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>

#include <string>
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
      const bool is_v4 = ::inet_pton(AF_INET, address, &v4.sin_addr) == 1, is_v6 = ::inet_pton(AF_INET6, address, &v6.sin6_addr) == 1;
      EXPECT_EQ(IsIp(address), is_v4 || is_v6) << address;
      if (is_v4) {
        EXPECT_EQ(ReachOf(TextOf(reinterpret_cast<sockaddr*>(&v4))), reach) << address;
      }
      if (is_v6) {
        EXPECT_EQ(ReachOf(TextOf(reinterpret_cast<sockaddr*>(&v6))), reach) << address;
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

TEST(AddressReach, ANameStaysWhereItWasFirst) {
  const std::pair<const char*, const char*> stays[] = {
      {"1.1.1.1", "8.8.8.8"},        {"1.1.1.1", "2606:4700::1111"}, {"10.0.0.1", "10.255.0.1"},      {"10.0.0.1", "64:ff9b::a00:2"},
      {"10.0.0.1", "fd12::1"},       {"fd12::1", "192.168.1.1"},     {"10.0.0.1", "::ffff:10.0.0.2"}, {"127.0.0.1", "::1"},
      {"127.0.0.1", "127.0.1.1"},    {"10.0.0.1", "1.1.1.1"},        {"127.0.0.1", "1.1.1.1"},        {"fe80::1", "fe80::1"},
      {"169.254.1.5", "169.254.1.5"}};
  for (const auto& [first, now] : stays) EXPECT_TRUE(MayMove(first, now)) << first << " " << now;
  const char* const inside[] = {
      "127.0.0.1",  "::1",         "::ffff:127.0.0.1", "64:ff9b::7f00:1",        "2002:7f00:1::", "0.0.0.0",
      "::",         "fe80::1",     "169.254.169.254",  "::ffff:169.254.169.254", "192.168.1.1",   "::ffff:192.168.1.1",
      "172.16.0.1", "64:ff9b:1::1"};
  for (const char* const now : inside) {
    EXPECT_FALSE(MayMove("1.1.1.1", now)) << now;
    if (ReachOf(now) != Reach::kPrivate || std::string(now).find('.') != std::string::npos) {
      EXPECT_FALSE(MayMove("10.0.0.1", now)) << now;
    }
    if (ReachOf(now) != Reach::kMachine) {
      EXPECT_FALSE(MayMove("127.0.0.1", now)) << now;
    }
    EXPECT_FALSE(MayMove("169.254.1.5", now)) << now;
  }
  EXPECT_FALSE(MayMove("1.1.1.1", "10.0.0.1"));
  EXPECT_FALSE(MayMove("1.1.1.1", "fd12::1"));
  EXPECT_FALSE(MayMove("fd12::1", "fec0::1"));
  EXPECT_FALSE(MayMove("127.0.0.1", "10.0.0.1"));
  EXPECT_FALSE(MayMove("1.1.1.1", "no address"));
}

}  // namespace
}  // namespace slabstream
