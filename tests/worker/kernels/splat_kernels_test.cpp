// The kernels of splatting: every instruction set against the plain reference, and the references against what they stand for.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <random>
#include <vector>

#include "tests/support/simd_targets.h"
#include "tests/worker/kernels/shade_reference.h"
#include "tests/worker/kernels/splat_reference.h"
#include "worker/kernels/normal_code.h"
#include "worker/kernels/shade.h"
#include "worker/kernels/splat.h"

namespace slabstream {
namespace {

// Of every number of taps that the kernels know by name, and of some that they do not.
constexpr double kSigmas[] = {0.3, 0.6, 0.8, 1.0, 1.1, 2.0};
constexpr std::int32_t kTaps[] = {2, 4, 5, 6, 7, 12};

AlignedVector<float> Noise(std::size_t count, std::mt19937& random) {
  std::uniform_real_distribution<float> uniform(0, 1);
  AlignedVector<float> values(count);
  for (float& value : values) value = uniform(random);
  return values;
}

// Octets with masks of every kind: full, single voxels, noise.
struct RandomOctets {
  explicit RandomOctets(std::mt19937& random) : rgba(4 * kOctet * kCount, -1.0F) {
    std::uniform_real_distribution<float> uniform(0, 1);
    records.resize(std::size_t{kOctet} * kCount);
    for (VoxelRecord& record : records) record = {std::uint16_t(random() % 7), std::uint16_t(random() % kNormalCodes)};
    const VoxelRecord* next = records.data();
    for (std::size_t i = 0; i < kCount; ++i) {
      OctetWork work;
      work.occupied = i % 3 == 0 ? 0xFF : i % 3 == 1 ? 1U << (random() % kOctet) : 1 + std::uint32_t(random()) % 0xFF;
      work.records = next;
      next += std::popcount(work.occupied);
      work.rgba = &rgba[4 * kOctet * i];
      work.slope = 2 * uniform(random) - 1;
      work.across = 1 + uniform(random);
      octets.push_back(work);
    }
  }
  static constexpr std::size_t kCount = 60;
  std::vector<VoxelRecord> records;
  AlignedVector<float> rgba;
  std::vector<OctetWork> octets;
};

TEST(ShadeOctets, AgreesWithTheReference) {
  const unsigned seed = 3;
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> uniform(0, 1);
  for (int levels : {1, 2, 9}) {
    SCOPED_TRACE(::testing::Message() << "seed " << seed << " levels " << levels);
    constexpr int kBins = 7;
    ShadeTables tables;
    tables.levels = levels;
    // Some octets are beyond the levels at both ends.
    constexpr float kSlopeStep = 0.1F;
    tables.level_scale = 0.8F * float(levels);
    tables.level_offset = 0.85F * float(levels);
    tables.last_level = 0.999F * float(levels - 1);
    for (int bin = 0; bin < kBins; ++bin) {
      for (int c = 0; c < 3; ++c) tables.color.push_back(uniform(random));
      for (int level = 0; level < levels; ++level) tables.opacity.push_back(uniform(random));
      tables.color.push_back(tables.opacity[std::size_t(bin * levels)]);
    }
    for (int code = 0; code < kNormalCodes; ++code) tables.by_normal.push_back({1.5F * uniform(random), uniform(random)});
    RandomOctets work(random);
    ShadeOctetsReference(tables, kSlopeStep, work.octets);
    const AlignedVector<float> expected = work.rgba;
    for (const OctetWork& octet : work.octets) {
      for (int i = 0; i < kOctet; ++i) {
        const bool occupied = (octet.occupied >> i & 1) != 0;
        EXPECT_EQ(octet.rgba[4 * i + 3] > 0, occupied);
        for (int c = 0; c < 3; ++c) EXPECT_LE(octet.rgba[4 * i + c], octet.rgba[4 * i + 3]);  // premultiplied
      }
    }
    ForEachTarget([&] {
      std::fill(work.rgba.begin(), work.rgba.end(), -1.0F);
      ShadeOctets(tables, kSlopeStep, work.octets);
      // Levels, up to 10 here, are rounded, and opacities differ by up to 1 from level to level.
      for (std::size_t i = 0; i < expected.size(); ++i) ASSERT_NEAR(work.rgba[i], expected[i], levels == 1 ? 1e-6F : 5e-6F) << i;
    });
  }
}

// Between two levels opacities are interpolated.
TEST(ShadeOctets, InterpolatesBetweenLevels) {
  ShadeTables tables;
  tables.levels = 3;
  tables.level_scale = 1;
  tables.last_level = 1.999F;
  tables.color = {1, 1, 1, 0.1F};
  tables.opacity = {0.1F, 0.2F, 0.6F};
  tables.by_normal.resize(kNormalCodes);
  std::vector<VoxelRecord> records(kOctet);
  AlignedVector<float> rgba(4 * kOctet);
  const std::vector<OctetWork> octets = {{records.data(), rgba.data(), 0xFF, 0, 0}};
  ShadeOctets(tables, 0.25F, octets);
  const float expected[] = {0.1F, 0.125F, 0.15F, 0.175F, 0.2F, 0.3F, 0.4F, 0.5F};
  for (std::size_t i = 0; i < kOctet; ++i) EXPECT_NEAR(rgba[4 * i + 3], expected[i], 1e-6F);
}

// Segments of a row of `words` words: some of them, all of them in one word, none in another.
std::vector<SegmentWord> RandomSegments(std::int32_t words, std::mt19937& random) {
  std::vector<SegmentWord> set;
  for (std::int32_t word = 0; word < words; ++word) {
    const SegmentWord noise = SegmentWord{random()} << 32 | random();
    set.push_back(std::array{noise, noise & SegmentWord{random()}, ~SegmentWord{0}, SegmentWord{0}}[random() % 4]);
  }
  return set;
}
bool Holds(const std::vector<SegmentWord>& set, std::int32_t segment) { return AnyOf(set.data(), segment, segment + 1); }

TEST(SegmentSpan, IsTheSetOfItsSegments) {
  for (std::int32_t begin = 0; begin < 2 * kWordSegments; ++begin) {
    for (std::int32_t end = begin + 1; end <= begin + kWordSegments; ++end) {
      std::vector<SegmentWord> expected(4), got(4);
      Insert(expected.data(), begin, end);
      Insert(got.data(), MakeSpan(begin, end));
      ASSERT_EQ(got, expected) << begin << " ... " << end;
    }
  }
}

constexpr std::int32_t kWords = 3, kRowPixels = kWords * kWordSegments * kSegment;

TEST(FilterBeam, AgreesWithTheReference) {
  const unsigned seed = 4;
  std::mt19937 random(seed);
  for (std::size_t s = 0; s < std::size(kSigmas); ++s) {
    const FootprintTable footprint = MakeFootprintTable(kSigmas[s], 3);
    ASSERT_EQ(footprint.taps, kTaps[s]);
    for (double scale : {0.5, 1.0, 1.9}) {
      SCOPED_TRACE(::testing::Message() << "seed " << seed << " taps " << footprint.taps << " scale " << scale);
      // The row begins somewhere within the frame, voxel 0 lies before the frame.
      const std::int32_t first_sample = kSegment * std::int32_t(random() % 20);
      const Lattice lattice = MakeLattice(scale, std::uniform_real_distribution<double>(-50, -20)(random), footprint.radius);
      const std::int32_t voxels = Lattice::First(lattice.At(first_sample + kRowPixels)) + footprint.padded_taps;
      ASSERT_GE(Lattice::First(lattice.At(first_sample)), 0);
      const AlignedVector<float> beam = Noise(4 * std::size_t(voxels), random);
      const std::vector<SegmentWord> wanted = RandomSegments(kWords, random);
      AlignedVector<float> expected(4 * kRowPixels, -1.0F), got = expected;
      FilterBeamReference(footprint, lattice, {beam.data(), expected.data(), wanted.data(), kWords, first_sample});
      ForEachTarget([&] {
        std::ranges::fill(got, -1.0F);
        FilterBeam(footprint, lattice, {beam.data(), got.data(), wanted.data(), kWords, first_sample});
        for (std::size_t i = 0; i < got.size(); ++i) {
          ASSERT_NEAR(got[i], expected[i], 2e-6F) << i;
          ASSERT_EQ(got[i] == -1, !Holds(wanted, std::int32_t(i) / (4 * kSegment))) << "not its segments only";
        }
      });
    }
  }
}

// A filled beam stays what it is; a single voxel becomes its footprint, where it should be.
TEST(FilterBeam, KeepsConstantsAndPlaces) {
  constexpr std::int32_t kVoxels = 64, kFirst = 24, kPixels = 72;
  const SegmentWord wanted = WordBits(0, kPixels / kSegment);
  for (double sigma : kSigmas) {
    const FootprintTable footprint = MakeFootprintTable(sigma, 3);
    const double scale = 2, offset = 0.5;
    const Lattice lattice = MakeLattice(scale, offset, footprint.radius);
    AlignedVector<float> filled(4 * kVoxels, 0.75F), single(4 * kVoxels), out(4 * kPixels);
    for (std::size_t c = 0; c < 4; ++c) single[4 * 30 + c] = 1;
    FilterBeam(footprint, lattice, {filled.data(), out.data(), &wanted, 1, kFirst});
    for (float value : out) EXPECT_NEAR(value, 0.75F, 1e-6F);
    FilterBeam(footprint, lattice, {single.data(), out.data(), &wanted, 1, kFirst});
    double mass = 0, moment = 0;
    for (std::int32_t i = 0; i < kPixels; ++i) {
      mass += double(out[std::size_t(4 * i)]);
      moment += double(out[std::size_t(4 * i)]) * (kFirst + i + 0.5);
    }
    EXPECT_NEAR(mass, scale, 0.01 * scale) << sigma;
    EXPECT_NEAR(moment / mass, scale * 30 + offset, 0.01) << sigma;
  }
}

TEST(CompositeRow, AgreesWithTheReference) {
  const unsigned seed = 6;
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> uniform(0, 1);
  constexpr std::size_t kFloats = 4 * std::size_t{kRowPixels};
  for (std::int32_t taps : {1, 2, 3, 4, 5, 6, 7, 12}) {
    for (float opaque_alpha : {2.0F, 0.9F}) {
      SCOPED_TRACE(::testing::Message() << "seed " << seed << " taps " << taps);
      // What a beam does not fill holds anything.
      std::vector<AlignedVector<float>> beams;
      std::vector<std::vector<SegmentWord>> filled;
      std::vector<float> weights;
      std::vector<const float*> beam_rows;
      std::vector<const SegmentWord*> filled_rows;
      for (std::int32_t n = 0; n < taps; ++n) {
        beams.push_back(Noise(kFloats, random));
        filled.push_back(RandomSegments(kWords, random));
        for (std::size_t i = 0; i < kFloats; ++i) {
          if (!Holds(filled.back(), std::int32_t(i) / (4 * kSegment))) beams.back()[i] = 1e30F;
        }
        weights.push_back((0.5F + uniform(random)) / (1.5F * float(taps)));
      }
      for (std::int32_t n = 0; n < taps; ++n) {
        beam_rows.push_back(beams[std::size_t(n)].data());
        filled_rows.push_back(filled[std::size_t(n)].data());
      }
      AlignedVector<float> before = Noise(kFloats, random);
      for (std::size_t i = 3; i < kFloats; i += 4) {
        if (i / (4 * kSegment) % 5 == 0) before[i] = 1;  // opaque already
      }
      const std::vector<SegmentWord> open_before = RandomSegments(kWords, random);
      const std::vector<float> opaque_alphas(std::size_t{kWords} * kWordSegments, opaque_alpha);
      RowWork work{taps, weights.data(), beam_rows.data(), filled_rows.data(), nullptr, nullptr, kWords, opaque_alphas.data()};
      const auto run = [&](void (*composite)(const RowWork&), AlignedVector<float>& accumulated, std::vector<SegmentWord>& open) {
        accumulated = before, open = open_before;
        work.accumulated = accumulated.data(), work.open = open.data();
        composite(work);
      };
      AlignedVector<float> expected, got;
      std::vector<SegmentWord> expected_open, open;
      run(CompositeRowReference, expected, expected_open);
      if (opaque_alpha > 1) {
        EXPECT_EQ(expected_open, open_before);
      }
      ForEachTarget([&] {
        run(CompositeRow, got, open);
        for (std::size_t i = 0; i < kFloats; ++i) ASSERT_NEAR(got[i], expected[i], 2e-6F) << i;
        EXPECT_EQ(open, expected_open);
      });
    }
  }
}

}  // namespace
}  // namespace slabstream
