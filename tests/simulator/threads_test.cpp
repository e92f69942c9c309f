#include "simulator/threads.h"

#include <gtest/gtest.h>

namespace slabstream {
namespace {

TEST(Threads, WhatComesWhileAThreadIsWokenDoesNotOvertakeWhatWokeIt) {
  Threads threads({.awake = 1, .asleep = 10, .doze = 5});
  threads.AllActive(0);
  EXPECT_EQ(threads.Begin(Threads::kCoordinator, 3), 4);      // still awake
  EXPECT_EQ(threads.Begin(Threads::kCoordinator, 100), 110);  // asleep
  EXPECT_EQ(threads.Begin(Threads::kCoordinator, 102), 110);  // handed over before it is awake
  EXPECT_EQ(threads.Begin(Threads::kCoordinator, 111), 112);
  EXPECT_EQ(threads.Begin(Threads::kCoordinator, 99), 100);  // handed over before what woke it
}

}  // namespace
}  // namespace slabstream
