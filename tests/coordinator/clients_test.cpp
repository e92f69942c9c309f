// How much clients have not read, and who is behind.
#include "coordinator/frames/clients.h"

#include <gtest/gtest.h>

#include <map>

#include "tests/support/random.h"

namespace slabstream {
namespace {

constexpr std::uint64_t kUnit = 1 << 20;  // bytes

TEST(ClientTable, WhoeverReadsNothingIsBehind) {
  ClientTable clients(std::chrono::seconds(10));
  clients.Meet(1, {});
  clients.Sent(1, kMaxUnreadBytes - 1);
  EXPECT_FALSE(clients.IsBehind(1));
  clients.Sent(1, 1);
  EXPECT_TRUE(clients.IsBehind(1));
  clients.Read(1, 0);
  clients.Read(1, 1);
  EXPECT_FALSE(clients.IsBehind(1));
  EXPECT_FALSE(clients.IsBehind(2)) << "nobody knows it";
}

// Whatever it says.
TEST(ClientTable, NobodyHasReadWhatHasNotLeft) {
  ClientTable clients(std::chrono::seconds(10));
  clients.Meet(1, {});
  clients.Read(1, 0);
  clients.Sent(1, kMaxUnreadBytes + kUnit);
  clients.Read(1, kMaxUnreadBytes + kUnit, kMaxUnreadBytes);
  EXPECT_TRUE(clients.IsBehind(1));
  clients.Read(1, kMaxUnreadBytes + kUnit, kMaxUnreadBytes - 1);
  EXPECT_FALSE(clients.IsBehind(1));
}

TEST(ClientTable, WhatManyLeaveUnreadCountsTogether) {
  constexpr std::uint64_t kMost = 100 * kUnit;
  ClientTable clients(std::chrono::seconds(10), kMost);
  for (PeerToken client = 1; client <= 10; ++client) clients.Meet(client, {});
  for (PeerToken client = 1; client <= 4; ++client) clients.Sent(client, 24 * kUnit);
  for (PeerToken client = 1; client <= 10; ++client) EXPECT_FALSE(clients.IsBehind(client)) << "all together are within the limit";
  clients.Sent(5, 4 * kUnit);
  for (PeerToken client = 1; client <= 4; ++client) EXPECT_TRUE(clients.IsBehind(client));
  for (PeerToken client = 5; client <= 10; ++client) EXPECT_FALSE(clients.IsBehind(client)) << "others took its part";
  clients.Forget(1);
  for (PeerToken client = 2; client <= 4; ++client) EXPECT_FALSE(clients.IsBehind(client));
}

// If only clients that are not behind are sent pictures.
TEST(ClientTable, UnreadBytesStayWithinTheLimit) {
  Random random(5);
  SCOPED_TRACE(random.trace());
  constexpr std::uint64_t kMost = 50 * kUnit, kPicture = 3 * kUnit;
  ClientTable clients(std::chrono::seconds(10), kMost);
  std::map<PeerToken, std::uint64_t> sent, read;
  for (int step = 0; step < 5000; ++step) {
    const PeerToken client = random.Integer<PeerToken>(1, 30);
    if (random.Chance(0.01)) {
      clients.Forget(client);
      sent.erase(client);
      read.erase(client);
      continue;
    }
    clients.Meet(client, {});
    if (random.Chance(0.3)) {
      read[client] = random.Integer(read[client], sent[client]);
      clients.Read(client, read[client]);
    } else if (!clients.IsBehind(client)) {
      clients.Sent(client, kPicture);
      sent[client] += kPicture;
    }
    std::uint64_t unread = 0;
    for (const auto& [token, bytes] : sent) unread += bytes - read[token];
    ASSERT_LE(unread, kMost + std::max(kMost, clients.size() * kLeastUnreadPart) + clients.size() * kPicture);
  }
}

}  // namespace
}  // namespace slabstream
