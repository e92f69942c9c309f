#include "common/memory/large_buffers.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include "common/memory/mapped_memory.h"
#include "common/memory/pooled_vector.h"

namespace slabstream {
namespace {

constexpr std::size_t kMebi = std::size_t{1} << 20;

// 64 MiB of holes in the heap, and 64 MiB of blocks.
class KeptMemory : public testing::Test {
 protected:
  void SetUp() override {
    if (kWatched) GTEST_SKIP() << "a sanitizer keeps what is freed";
    std::vector<std::unique_ptr<std::vector<std::byte>>> small;
    for (int i = 0; i < 2048; ++i) small.push_back(std::make_unique<std::vector<std::byte>>(std::size_t{32} << 10, std::byte{1}));
    last_ = std::move(small.back());
    small.clear();
    PooledVector<std::byte>(64 * kMebi, std::byte{2});
    ASSERT_GT(ResidentBytes(), before_ + 96 * kMebi) << "they are kept";
  }
  const std::uint64_t before_ = ResidentBytes();
  std::unique_ptr<std::vector<std::byte>> last_;  // behind the holes
};

TEST_F(KeptMemory, GoesBackToTheSystem) {
  ReleaseFreeMemory();
  EXPECT_LT(ResidentBytes(), before_ + 24 * kMebi);
}

TEST_F(KeptMemory, StaysUntilTheProcessWouldHoldTooMuch) {
  const std::uint64_t held = ResidentBytes();
  EXPECT_GE(SpareForImages(held + 64 * kMebi), std::int64_t(32 * kMebi));
  EXPECT_GT(ResidentBytes() + 16 * kMebi, held);
  EXPECT_GE(SpareForImages(held - kMebi), std::int64_t(64 * kMebi)) << "it is released first";
  EXPECT_LT(ResidentBytes(), before_ + 24 * kMebi);
}

TEST_F(KeptMemory, ImagesInUseAreNotMissed) {
  const std::int64_t without = SpareForImages(ResidentBytes() + 512 * kMebi);
  const PooledVector<std::byte> image(200 * kMebi, std::byte{3});
  EXPECT_NEAR(double(SpareForImages(ResidentBytes() + 312 * kMebi)), double(without), double(16 * kMebi));
}

}  // namespace
}  // namespace slabstream
