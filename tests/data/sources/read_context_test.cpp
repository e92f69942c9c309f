#include "data/sources/read_context.h"

#include <gtest/gtest.h>

#include <vector>

namespace slabstream {
namespace {

TEST(ReadContextTest, AdmitsInOrderWhatThereIsRoomFor) {
  ReadContext context({.decode_threads = 1, .under_way_bytes = 10});
  std::vector<int> begun;
  const auto task = [&](int number) { return [&begun, number] { begun.push_back(number); }; };
  context.Admit(6, task(1));
  context.Admit(5, task(2));
  context.Admit(1, task(3));  // there is room, but it is not its turn
  EXPECT_EQ(begun, std::vector<int>({1}));
  context.Release(6);
  EXPECT_EQ(begun, std::vector<int>({1, 2, 3}));
  context.Release(5);
  context.Release(1);
}

TEST(ReadContextTest, OneTaskMayAlwaysBeUnderWay) {
  ReadContext context({.decode_threads = 1, .under_way_bytes = 10});
  std::vector<int> begun;
  context.Admit(100, [&] { begun.push_back(1); });
  context.Admit(200, [&] { begun.push_back(2); });
  EXPECT_EQ(begun, std::vector<int>({1}));
  context.Release(100);
  EXPECT_EQ(begun, std::vector<int>({1, 2}));
}

TEST(ReadContextTest, WhatWouldWaitElsewhereWaitsHere) {
  ReadContext context({.decode_threads = 3});
  const std::size_t most = ReadContext::kMostAsked + 6;
  std::size_t begun = 0;
  for (std::size_t i = 0; i < most + 2; ++i) context.Admit(1, [&] { ++begun; });
  EXPECT_EQ(begun, most);
  context.Release(1);
  EXPECT_EQ(begun, most + 1);
  for (std::size_t i = 0; i <= most; ++i) context.Release(1);
  EXPECT_EQ(begun, most + 2);
}

TEST(ReadContextTest, TasksThatEndAtOnceDoNotNest) {
  ReadContext context({.decode_threads = 1, .under_way_bytes = 1});
  int depth = 0, deepest = 0, ended = 0;
  context.Admit(1, [] {});
  for (int i = 0; i < 10; ++i) {
    context.Admit(1, [&] {
      deepest = std::max(deepest, ++depth);
      context.Release(1);
      ++ended;
      --depth;
    });
  }
  context.Release(1);
  EXPECT_EQ(ended, 10);
  EXPECT_EQ(deepest, 1);
}

}  // namespace
}  // namespace slabstream
