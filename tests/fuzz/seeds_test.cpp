// The fuzz targets in the ordinary suite: over their seeds, which the decoders must take, and over seeds that were altered at random.
#include <gtest/gtest.h>

#include "tests/fuzz/fuzz_target.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

class EveryFuzzTarget : public testing::TestWithParam<FuzzTarget> {};

INSTANTIATE_TEST_SUITE_P(Targets, EveryFuzzTarget, testing::ValuesIn(FuzzTargets()), [](const auto& target) {
  std::string name(target.param.name);
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
});

TEST_P(EveryFuzzTarget, TakesItsSeeds) {
  const std::vector<FuzzBytes> seeds = GetParam().seeds();
  ASSERT_FALSE(seeds.empty());
  for (std::size_t i = 0; i < seeds.size(); ++i) EXPECT_TRUE(GetParam().run(seeds[i])) << "seed " << i;
}

// One to three changes: a byte, a stretch that is left out, a stretch of another seed, the end cut off.
FuzzBytes Altered(FuzzBytes bytes, const FuzzBytes& other, Random& random) {
  const auto place = [&](const FuzzBytes& of) { return std::ptrdiff_t(random.Integer<std::size_t>(0, of.size())); };
  for (int i = random.Integer(1, 3); i > 0; --i) {
    const std::ptrdiff_t begin = place(bytes),
                         length = std::min(std::ptrdiff_t(bytes.size()) - begin, std::ptrdiff_t(random.Integer(1, 16)));
    switch (random.Integer(0, 3)) {
      case 0:
        if (length > 0) bytes[std::size_t(begin)] = std::byte(random.Integer(0, 255));
        break;
      case 1: bytes.erase(bytes.begin() + begin, bytes.begin() + begin + length); break;
      case 2: {
        const std::ptrdiff_t from = place(other);
        const std::ptrdiff_t count = std::min(std::ptrdiff_t(other.size()) - from, std::ptrdiff_t(random.Integer(1, 64)));
        bytes.insert(bytes.begin() + begin, other.begin() + from, other.begin() + from + count);
        break;
      }
      default: bytes.resize(std::size_t(begin)); break;
    }
  }
  return bytes;
}

TEST_P(EveryFuzzTarget, HoldsForAlteredSeeds) {
  Random random(1);
  SCOPED_TRACE(random.trace());
  constexpr int kInputs = 2000;
  const std::vector<FuzzBytes> seeds = GetParam().seeds();
  const auto any = [&]() -> const FuzzBytes& { return seeds[random.Integer<std::size_t>(0, seeds.size() - 1)]; };
  int refused = 0;
  for (int i = 0; i < kInputs; ++i) refused += GetParam().run(Altered(any(), any(), random)) ? 0 : 1;
  EXPECT_GT(refused, 0) << "nothing that was altered was noticed";
}

}  // namespace
}  // namespace slabstream
