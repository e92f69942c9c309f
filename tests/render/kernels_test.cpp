// The kernels of splatting: every instruction set against the plain reference, and the references against what they stand for.
#include <gtest/gtest.h>

#include <hwy/highway.h>

#include <bit>
#include <cmath>
#include <random>

#include "worker/kernels/composite.h"
#include "worker/kernels/cull.h"
#include "worker/kernels/normal_code.h"
#include "worker/kernels/shade.h"
#include "worker/kernels/splat.h"
#include "worker/kernels/transform.h"

namespace slabstream {
namespace {

constexpr Projection kProjections[] = {Projection::kOrthographic, Projection::kPerspective};

// Runs `body` once for every instruction set that this machine has.
template <class Body>
void ForEachTarget(Body&& body) {
  for (auto target : hwy::SupportedAndGeneratedTargets()) {
    SCOPED_TRACE(hwy::TargetName(target));
    hwy::SetSupportedTargetsForTest(target);
    hwy::GetChosenTarget().Update(target);
    body();
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().DeInit();
}

// Pieces with masks of every kind: full, single bits, runs, noise; footprints inside, across and outside of a sheet of `side` pixels.
struct RandomBatch {
  RandomBatch(unsigned seed, double sigma_x, double sigma_y, int side)
      : kernel_x(MakeGaussianKernel(sigma_x)), kernel_y(MakeGaussianKernel(sigma_y)) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> uniform(0, 1);
    records.resize(VoxelBatch::kVoxels);
    for (VoxelRecord& record : records) record = {std::uint16_t(random() % 7), std::uint16_t(random() % kNormalCodes)};
    while (batch.voxel_count + 32 <= VoxelBatch::kVoxels) {
      BeamPiece piece;
      switch (batch.pieces.size() % 4) {
        case 0: piece.mask = 0xFFFFFFFF; break;
        case 1: piece.mask = std::uint32_t{1} << random() % 32; break;
        case 2: piece.mask = std::uint32_t(((std::uint64_t{1} << (1 + random() % 31)) - 1) << random() % 31); break;
        default: piece.mask = std::uint32_t(random()) | 1; break;
      }
      if (piece.mask == 0) piece.mask = 1;
      piece.count = std::popcount(piece.mask);
      piece.records = &records[batch.voxel_count];
      piece.kernel_x = &kernel_x;
      piece.kernel_y = &kernel_y;
      piece.x0 = uniform(random);
      piece.y0 = uniform(random);
      piece.x_step = 2 * uniform(random) - 1;
      piece.y_step = 2 * uniform(random) - 1;
      piece.w0 = 0.8F + 0.4F * uniform(random);
      piece.w_step = 0.002F * (uniform(random) - 0.5F);
      piece.area = 0.5F + uniform(random);
      piece.column = std::int32_t(random() % unsigned(side + 40)) - 20;
      piece.row = std::int32_t(random() % unsigned(side + 40)) - 20;
      batch.voxel_count += std::size_t(piece.count);
      batch.pieces.push_back(piece);
    }
  }
  GaussianKernel kernel_x, kernel_y;
  std::vector<VoxelRecord> records;
  VoxelBatch batch;
};

template <class T>
std::vector<T> FirstOf(const AlignedVector<T>& values, std::size_t count) {
  return {values.begin(), values.begin() + std::ptrdiff_t(count)};
}

TEST(Transform, IsTheSameBitsOnEveryInstructionSet) {
  for (Projection projection : kProjections) {
    RandomBatch expected(1, 0.7, 0.9, 64), got(1, 0.7, 0.9, 64);
    TransformPiecesReference(projection, expected.batch);
    ForEachTarget([&] {
      TransformPieces(projection, got.batch);
      const std::size_t n = got.batch.voxel_count;
      EXPECT_EQ(FirstOf(got.batch.column, n), FirstOf(expected.batch.column, n));
      EXPECT_EQ(FirstOf(got.batch.row, n), FirstOf(expected.batch.row, n));
      EXPECT_EQ(FirstOf(got.batch.phase_x, n), FirstOf(expected.batch.phase_x, n));
      EXPECT_EQ(FirstOf(got.batch.phase_y, n), FirstOf(expected.batch.phase_y, n));
      if (projection == Projection::kPerspective) {
        EXPECT_EQ(FirstOf(got.batch.area, n), FirstOf(expected.batch.area, n));
      }
    });
  }
}

// A phase is an interval of positions: the exact position must lie in it, give or take the bound of transform.h.
TEST(Transform, KeepsItsErrorBound) {
  for (Projection projection : kProjections) {
    RandomBatch random(2, 0.7, 0.9, 64);
    VoxelBatch& batch = random.batch;
    TransformPieces(projection, batch);
    std::size_t n = 0;
    for (const BeamPiece& piece : batch.pieces) {
      for (std::uint32_t mask = piece.mask; mask != 0; mask &= mask - 1, ++n) {
        const double i = std::countr_zero(mask);
        const double w = projection == Projection::kPerspective ? double(piece.w0) + i * double(piece.w_step) : 1;
        const double t = (double(piece.x0) + i * double(piece.x_step)) / w;
        const int phases = piece.kernel_x->phases;
        const double begin = batch.column[n] - piece.column + double(batch.phase_x[n]) / phases;
        const double bound = std::ldexp(1.0, -21) * kFootprintCell;
        ASSERT_GE(t, begin - bound);
        ASSERT_LE(t, begin + 1.0 / phases + bound);
      }
    }
  }
}

TEST(Cull, DropsExactlyTheVoxelsThatBeginInHiddenTiles) {
  RandomBatch random(6, 0.7, 0.9, 64), original(6, 0.7, 0.9, 64);
  TransformPieces(Projection::kPerspective, random.batch);
  TransformPieces(Projection::kPerspective, original.batch);
  constexpr std::int32_t kTiles = 64 / kTile;
  std::vector<std::uint8_t> hidden(std::size_t(kTiles) * kTiles);
  for (std::size_t i = 0; i < hidden.size(); ++i) hidden[i] = i % 3 == 0;
  CullHiddenVoxels({hidden.data(), kTiles, kTiles}, random.batch);

  std::size_t kept = 0, n = 0;
  for (std::size_t p = 0; p < original.batch.pieces.size(); ++p) {
    const std::size_t kept_before = kept;
    for (std::int32_t i = 0; i < original.batch.pieces[p].count; ++i, ++n) {
      const std::int32_t x = std::clamp(original.batch.column[n], 0, 63) / kTile, y = std::clamp(original.batch.row[n], 0, 63) / kTile;
      if (hidden[std::size_t(y * kTiles + x)] != 0) continue;
      ASSERT_LT(kept, random.batch.voxel_count);
      EXPECT_EQ(random.batch.column[kept], original.batch.column[n]);
      EXPECT_EQ(random.batch.row[kept], original.batch.row[n]);
      EXPECT_EQ(random.batch.phase_x[kept], original.batch.phase_x[n]);
      EXPECT_EQ(random.batch.phase_y[kept], original.batch.phase_y[n]);
      EXPECT_EQ(random.batch.area[kept], original.batch.area[n]);
      EXPECT_EQ(random.batch.record[kept].bin, original.batch.record[n].bin);
      EXPECT_EQ(random.batch.record[kept].normal, original.batch.record[n].normal);
      ++kept;
    }
    EXPECT_EQ(std::size_t(random.batch.pieces[p].count), kept - kept_before);
  }
  EXPECT_EQ(kept, random.batch.voxel_count);
  EXPECT_GT(kept, 0U);
  EXPECT_LT(kept, n);
}

TEST(Shade, AgreesWithTheReference) {
  ShadeTables tables;
  std::mt19937 generator(3);
  std::uniform_real_distribution<float> uniform(0, 1);
  for (int bin = 0; bin < 7; ++bin) {
    for (int c = 0; c < 3; ++c) tables.color.push_back(uniform(generator));
    tables.color.push_back(1);
    tables.opacity.push_back(uniform(generator));
  }
  for (int code = 0; code < kNormalCodes; ++code) tables.by_normal.push_back({1.5F * uniform(generator), uniform(generator)});
  for (bool per_voxel_area : {false, true}) {
    RandomBatch expected(4, 1, 1, 64), got(4, 1, 1, 64);
    TransformPiecesReference(Projection::kPerspective, expected.batch);
    got.batch.area = expected.batch.area;
    got.batch.record = expected.batch.record;
    ShadePiecesReference(tables, per_voxel_area, expected.batch);
    ForEachTarget([&] {
      ShadePieces(tables, per_voxel_area, got.batch);
      for (std::size_t i = 0; i < 4 * got.batch.voxel_count; ++i) ASSERT_NEAR(got.batch.rgba[i], expected.batch.rgba[i], 1e-6F) << i;
    });
  }
}

TEST(Splat, AgreesWithTheReferenceAlsoAcrossBorders) {
  for (auto [sigma_x, sigma_y] : {std::pair(0.54, 0.54), std::pair(0.7, 0.7), std::pair(0.9, 0.6), std::pair(3.3, 1.1),
                                  std::pair(20.0, 15.0), std::pair(1000.0, 0.7)}) {
    for (std::int32_t side : {64, 33, 7}) {
      RandomBatch random(5, sigma_x, sigma_y, side);
      VoxelBatch& batch = random.batch;
      TransformPieces(Projection::kOrthographic, batch);
      for (std::size_t i = 0; i < 4 * batch.voxel_count; ++i) batch.rgba[i] = float(i % 13) / 13;
      const std::size_t floats = 4 * std::size_t(side) * std::size_t(side);
      std::vector<float> expected(floats), got(floats);
      SplatPiecesReference(batch, {expected.data(), side, side});
      ForEachTarget([&] {
        std::fill(got.begin(), got.end(), 0.0F);
        SplatPieces(batch, {got.data(), side, side});
        for (std::size_t i = 0; i < floats; ++i) ASSERT_NEAR(got[i], expected[i], 1e-5F * (1 + expected[i])) << i;
      });
    }
  }
}

TEST(Composite, AgreesWithTheReference) {
  std::mt19937 generator(6);
  std::uniform_real_distribution<float> uniform(0, 1);
  constexpr std::ptrdiff_t kRow = 24;
  std::vector<float> sheet(4 * kRow * kTile), accumulated(sheet.size()), ratio(kRow * kTile);
  for (std::size_t p = 0; p < ratio.size(); ++p) {
    // Empty, opaque, more than opaque (ripples of a filled slice) and everything between.
    const float alpha = std::array{0.0F, 1.0F, 1.004F, uniform(generator)}[p % 4];
    for (std::size_t c = 0; c < 3; ++c) sheet[4 * p + c] = alpha * uniform(generator);
    sheet[4 * p + 3] = alpha;
    for (std::size_t c = 0; c < 4; ++c) accumulated[4 * p + c] = uniform(generator);
    ratio[p] = 0.8F + uniform(generator);
  }
  const std::array<std::int32_t, kTile> begin = {0, 0, 3, 8, 1, 0, 7, 2}, end = {8, 0, 5, 8, 8, 1, 8, 7};
  for (bool perspective : {false, true}) {
    for (bool cut : {false, true}) {
      std::vector<float> expected_sheet = sheet, expected = accumulated;
      const auto work = [&](std::vector<float>& s, std::vector<float>& a) {
        TileWork tile{&s[4 * 8], &a[4 * 8], perspective ? &ratio[8] : nullptr, kRow, nullptr, nullptr};
        if (cut) tile.owned_begin = begin.data(), tile.owned_end = end.data();
        return tile;
      };
      const float least = CompositeTileReference(work(expected_sheet, expected));
      ForEachTarget([&] {
        std::vector<float> got_sheet = sheet, got = accumulated;
        EXPECT_NEAR(CompositeTile(work(got_sheet, got)), least, 1e-6F);
        EXPECT_EQ(got_sheet, expected_sheet);
        for (std::size_t i = 0; i < got.size(); ++i) ASSERT_NEAR(got[i], expected[i], 2e-6F) << i;
      });
    }
  }
}

TEST(GaussianKernel, HasUnitMassAndCoversItsRadius) {
  for (double sigma : {0.5, 0.7, 1.3, 4.0, 70.0}) {
    const GaussianKernel kernel = MakeGaussianKernel(sigma);
    // Positions of all phases together sample the kernel finely.
    double mass = 0;
    for (int phase = 0; phase < kernel.phases; ++phase) {
      for (int tap = 0; tap < kernel.taps; ++tap) {
        const float weight = kernel.y_weights[std::size_t(phase) * std::size_t(kernel.taps) + std::size_t(tap)];
        mass += weight / kernel.phases;
        if (tap >= kernel.phase_rows[std::size_t(phase)]) {
          EXPECT_EQ(weight, 0);
        }
      }
    }
    EXPECT_NEAR(mass, 1, 1e-3) << sigma;
  }
}

TEST(NormalCode, IsWithinItsErrorForEveryDirection) {
  const unsigned seed = 7;
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0, 1);
  double worst = 1;
  for (int i = 0; i < 200000; ++i) {
    const Vec3 n = Normalized({normal(random), normal(random), normal(random)});
    const Vec3 decoded = DecodeNormal(EncodeNormal(float(3 * n.x), float(3 * n.y), float(3 * n.z)));
    worst = std::min(worst, std::abs(Dot(n, decoded)));
  }
  EXPECT_LT(std::acos(worst) * 57.29577951308232, 0.8) << "seed " << seed;
}

TEST(NormalCode, HasExactAxesAndOneCodeForNone) {
  EXPECT_EQ(DecodeNormal(EncodeNormal(0, 0, -5)), (Vec3{0, 0, 1}));
  EXPECT_EQ(std::abs(DecodeNormal(EncodeNormal(2, 0, 0)).x), 1);
  EXPECT_EQ(std::abs(DecodeNormal(EncodeNormal(0, -2, 0)).y), 1);
  const float nan = std::nanf(""), infinite = std::numeric_limits<float>::infinity();
  EXPECT_EQ(EncodeNormal(0, 0, 0), kNoGradient);
  EXPECT_EQ(EncodeNormal(nan, 1, 1), kNoGradient);
  EXPECT_EQ(EncodeNormal(infinite, 1, 1), kNoGradient);
}

TEST(Phong, PowerIsAccurate) {
  for (double base : {0.0, 1e-300, 0.01, 0.3, 0.7071, 0.9, 0.999, 1 - 1e-9, 1.0}) {
    for (double exponent : {1.0, 2.5, 20.0, 333.0, 1000.0}) {
      const double expected = std::pow(base, exponent);
      EXPECT_NEAR(PowerOfFraction(base, exponent), expected, 1e-9 * expected) << base << " ^ " << exponent;
    }
  }
}

TEST(Phong, LightsBothSidesAndEveryLight) {
  Shading shading;
  shading.lights = {{0, 0, 2}, {3, 0, 0}};
  shading.ambient = 0.1F, shading.diffuse = 0.5F, shading.specular = 0.25F, shading.shininess = 4;
  const Phong phong(shading, {0, 0, -1});
  const PhongFactors towards = phong.AtNormal({0, 0, 1}), away = phong.AtNormal({0, 0, -1});
  EXPECT_FLOAT_EQ(towards.diffuse, 0.1F + 0.5F);  // the first light head on, the second grazing
  EXPECT_FLOAT_EQ(towards.specular, 0.25F);       // the first one's mirror image is in the eye
  EXPECT_FLOAT_EQ(away.diffuse, towards.diffuse);
  EXPECT_FLOAT_EQ(away.specular, towards.specular);
  EXPECT_FLOAT_EQ(phong.WithoutGradient().diffuse, 0.1F + 2 * 0.25F);  // half of what each light gives head on
  EXPECT_FLOAT_EQ(phong.WithoutGradient().specular, 0.0F);
  EXPECT_FLOAT_EQ(phong.AtNormal({0, 1, 0}).diffuse, 0.1F);  // both graze: the rim is ambient
  EXPECT_FLOAT_EQ(phong.AtNormal({0, 1, 0}).specular, 0.0F);
  shading.phong = false;
  EXPECT_FLOAT_EQ(Phong(shading, {0, 0, -1}).AtNormal({1, 0, 0}).diffuse, 1.0F);
}

}  // namespace
}  // namespace slabstream
