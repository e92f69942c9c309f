#include "common/threads/guarded.h"

#include <gtest/gtest.h>

#include <new>
#include <stdexcept>
#include <thread>

#include "tests/support/no_more_threads.h"

namespace slabstream {
namespace {

TEST(Guarded, WhatIsMissingIsTold) {
  EXPECT_EQ(Guarded("work", [] {}), Status::Ok());
  EXPECT_EQ(Guarded("work", [] { throw std::bad_alloc(); }), Status::ResourceExhausted("work: not enough memory"));
  EXPECT_EQ(Guarded("work", [] { throw std::runtime_error("no"); }), Status::Internal("work: no"));
  const NoMoreThreads now;
  EXPECT_EQ(Guarded("work", [] { std::thread([] {}).join(); }), Status::ResourceExhausted("work: not enough memory for another thread"));
}

}  // namespace
}  // namespace slabstream
