#include "data/sources/read_context.h"

#include <gtest/gtest.h>

#include <string>
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

// They take all that they may, and answer nothing.
TEST(ReadContextTest, FilesAndOtherServersDoNotWaitForServersThatDoNotAnswer) {
  constexpr std::uint64_t kRoom = 1000;
  ReadContext context({.decode_threads = 1, .under_way_bytes = kRoom});
  for (const int servers : {1, 4, 40}) {
    std::size_t of_servers = 0, of_files = 0, of_another = 0;
    for (int i = 0; i < servers; ++i) {
      for (int chunk = 0; chunk < 200; ++chunk)
        context.Admit(
            10, [&] { ++of_servers; }, std::to_string(i));
    }
    EXPECT_LE(of_servers, 2 * kRoom / 10);
    EXPECT_GE(of_servers, std::size_t(servers)) << "something of each";
    for (int chunk = 0; chunk < 50; ++chunk) context.Admit(10, [&] { ++of_files; });
    EXPECT_EQ(of_files, 50U);
    context.Admit(
        10, [&] { ++of_another; }, "another");
    EXPECT_EQ(of_another, 1U);
    for (int chunk = 0; chunk < 50; ++chunk) context.Release(10);
    context.Release(10, "another");
    const std::size_t begun = of_servers;
    for (int i = 0; i < servers; ++i) {
      for (int chunk = 0; chunk < 200; ++chunk) context.Release(10, std::to_string(i));
    }
    EXPECT_EQ(of_servers, 200U * std::size_t(servers)) << begun << " before they answered";
  }
}

TEST(ReadContextTest, ASourceTellsItsServer) {
  EXPECT_EQ(ServerOf("/data/scan.zarr"), "");
  EXPECT_EQ(ServerOf("scan.nrrd?time=3"), "");
  EXPECT_EQ(ServerOf("http://example.org:8080/a/b.zarr?time=3"), "example.org:8080");
  EXPECT_EQ(ServerOf("s3://bucket/a.zarr"), "bucket");
  EXPECT_EQ(ServerOf("s3://bucket/a.zarr?endpoint=http://10.0.0.1:9000"), "10.0.0.1:9000");
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
