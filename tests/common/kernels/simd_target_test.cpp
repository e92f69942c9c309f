// Kernels use the instruction set that SLABSTREAM_SIMD names, also after somebody asked which ones there are.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tests/common/kernels/simd_target_test.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <cstdint>

HWY_BEFORE_NAMESPACE();
namespace slabstream::HWY_NAMESPACE {
std::int64_t ThisTarget() { return HWY_TARGET; }
}  // namespace slabstream::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include <gtest/gtest.h>

#include <cstdlib>
#include <string>
#include <vector>

#include "common/kernels/simd_target.h"

namespace slabstream {
namespace {

HWY_EXPORT(ThisTarget);

TEST(SimdTarget, StaysTheOneOfTheEnvironment) {
  const char* const given = std::getenv("SLABSTREAM_SIMD");
  const std::string before = given != nullptr ? given : "";
  ::unsetenv("SLABSTREAM_SIMD");
  ASSERT_TRUE(LimitSimdTargetByEnvironment().ok());
  const std::vector<std::string> all = SimdTargets();
  const std::vector<std::int64_t> bits = hwy::SupportedAndGeneratedTargets();
  ASSERT_EQ(all.size(), bits.size());
  // From the best to the worst: what is disabled stays so.
  for (std::size_t i = 0; i < all.size(); ++i) {
    ASSERT_EQ(::setenv("SLABSTREAM_SIMD", all[i].c_str(), 1), 0);
    ASSERT_TRUE(LimitSimdTargetByEnvironment().ok());
    EXPECT_EQ(HWY_DYNAMIC_DISPATCH(ThisTarget)(), bits[i]);
    EXPECT_EQ(SimdTargets().front(), all[i]);
    EXPECT_EQ(HWY_DYNAMIC_DISPATCH(ThisTarget)(), bits[i]) << "after a list of " << all[i];
  }
  ASSERT_EQ(::setenv("SLABSTREAM_SIMD", before.c_str(), 1), 0);
  ASSERT_TRUE(LimitSimdTargetByEnvironment().ok());
  if (before.empty()) {
    EXPECT_EQ(SimdTargets(), all);
  }
}

}  // namespace
}  // namespace slabstream
#endif
