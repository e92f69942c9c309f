// OverRow of every instruction set against the reference: the same bits, at every length around a vector and at every alignment.

#include <gtest/gtest.h>
#include <hwy/highway.h>
#include <hwy/targets.h>

#include <cstring>
#include <limits>
#include <utility>
#include <vector>

#include "common/kernels/combine.h"
#include "tests/common/kernels/over_reference.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

class OverRowTargets : public testing::TestWithParam<std::int64_t> {
 protected:
  void SetUp() override { Choose(GetParam()); }
  void TearDown() override { Choose(0); }  // 0: whatever the CPU has

 private:
  static void Choose(std::int64_t target) {
    hwy::SetSupportedTargetsForTest(std::uint32_t(target));
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  }
};

std::vector<std::int64_t> Targets() {
  std::vector<std::int64_t> targets;
  for (const auto target : hwy::SupportedAndGeneratedTargets()) targets.push_back(std::int64_t(target));
  return targets;
}
INSTANTIATE_TEST_SUITE_P(All, OverRowTargets, testing::ValuesIn(Targets()),
                         [](const auto& target) { return hwy::TargetName(std::uint32_t(target.param)); });

// Whether the row that begins at `shift` holds the bits of `expected`.
bool SameBits(const std::vector<float>& row, std::size_t shift, const std::vector<float>& expected) {
  return expected.empty() || std::memcmp(row.data() + shift, expected.data(), expected.size() * sizeof(float)) == 0;
}

std::vector<float> RandomRow(Random& random, std::size_t pixels, std::size_t shift) {
  std::vector<float> row(4 * pixels + shift);
  for (float& value : row) value = random.Chance(0.2) ? float(random.Integer(0, 1)) : float(random.Real(0, 1));
  return row;
}

TEST_P(OverRowTargets, GivesTheBitsOfTheReference) {
  Random random(61);
  SCOPED_TRACE(random.trace());
  for (std::size_t pixels = 0; pixels <= 70; ++pixels) {
    for (std::size_t shift : {0, 1, 3}) {
      const std::vector<float> front = RandomRow(random, pixels, shift), back = RandomRow(random, pixels, shift);
      std::vector<float> expected(4 * pixels), out(4 * pixels + shift + 4, -1.0F);
      EXPECT_TRUE(OverRowReference(front.data() + shift, back.data() + shift, expected.data(), pixels));
      EXPECT_TRUE(OverRow(front.data() + shift, back.data() + shift, out.data() + shift, pixels));
      ASSERT_TRUE(SameBits(out, shift, expected)) << pixels << " pixels, shift " << shift;
      for (std::size_t i = 0; i < 4; ++i) ASSERT_EQ(out[out.size() - 1 - i], -1.0F) << "wrote past the end";

      // In place, on either operand.
      std::vector<float> in_place = front;
      EXPECT_TRUE(OverRow(in_place.data() + shift, back.data() + shift, in_place.data() + shift, pixels));
      ASSERT_TRUE(SameBits(in_place, shift, expected));
      in_place = back;
      EXPECT_TRUE(OverRow(front.data() + shift, in_place.data() + shift, in_place.data() + shift, pixels));
      ASSERT_TRUE(SameBits(in_place, shift, expected));
    }
  }
}

// Wherever it is in the row, and whatever lies in front of it or behind.
TEST_P(OverRowTargets, TellsOfAnyOperandThatIsNotFinite) {
  Random random(62);
  SCOPED_TRACE(random.trace());
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  for (const std::size_t pixels : {1, 3, 4, 5, 8, 33}) {
    std::vector<float> front = RandomRow(random, pixels, 0), back = RandomRow(random, pixels, 0), out(4 * pixels);
    for (std::vector<float>* operand : {&front, &back}) {
      for (float& value : *operand) {
        for (const float bad : {kInfinity, -kInfinity, std::numeric_limits<float>::quiet_NaN()}) {
          const float good = std::exchange(value, bad);
          EXPECT_FALSE(OverRow(front.data(), back.data(), out.data(), pixels));
          EXPECT_FALSE(OverRowReference(front.data(), back.data(), out.data(), pixels));
          value = good;
        }
      }
    }
  }
}

}  // namespace
}  // namespace slabstream
