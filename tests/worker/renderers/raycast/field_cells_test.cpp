// Which cells of a field touch those of the volume, against a search of all of them.
#include "worker/renderers/raycast/field_cells.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/worker/renderers/render_support.h"
#include "worker/rays/ray_volume.h"

namespace slabstream {
namespace {

using namespace slabstream::testing;  // NOLINT(google-build-using-namespace): test support

RayPiece PieceOf(const Box& box) {
  RayPiece piece;
  piece.voxels = MakePaddedVoxels(box, ScalarType::kUint8);
  piece.cells = FindMacrocellRanges(piece.voxels);
  return piece;
}

bool Touch(const RayPiece& piece, const Index3& cell, const RayPiece& field, const Index3& other, const AffineMap& map) {
  constexpr double kRounding = 1.0 / 64;
  const auto low_of = [](const RayPiece& of, const Index3& at) { return ToVec3(of.voxels.box.begin - Uniform(1) + kCellSide * at); };
  const Vec3 side = {kCellSide, kCellSide, kCellSide}, low = low_of(piece, cell), low_of_other = low_of(field, other);
  const auto [least, most] = map.Bounds(low, low + side);
  for (const Axis axis : kAxes) {
    if (most[axis] + kRounding < low_of_other[axis] || least[axis] - kRounding >= low_of_other[axis] + kCellSide) return false;
  }
  return true;
}

TEST(FieldCells, ThatTouchOnesThatShowAreFound) {
  constexpr unsigned kSeed = 12;
  std::mt19937 random(kSeed);
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); };
  const auto number = [&](int least, int most) { return std::uniform_int_distribution<int>(least, most)(random); };
  const auto random_box = [&] {
    const Index3 begin = {number(0, 20), number(0, 20), number(0, 20)};
    return Box{begin, begin + Index3{number(1, 25), number(1, 25), number(1, 25)}};
  };
  int found = 0;
  for (int i = 0; i < 60; ++i) {
    const RayPiece piece = PieceOf(random_box()), field = PieceOf(i % 5 == 0 ? piece.voxels.box : random_box());
    AffineMap map;  // the same grid, scaled axes, or any
    for (Vec3& step : map.steps) {
      if (i % 3 > 0) step = uniform(0.4, 2) * step;
      if (i % 3 == 2) step = step + Vec3{uniform(-0.5, 0.5), uniform(-0.5, 0.5), uniform(-0.5, 0.5)};
    }
    if (i % 3 > 0) map.offset = {uniform(-8, 8), uniform(-8, 8), uniform(-8, 8)};
    const int share = number(0, 20);  // of cells that show, in 21
    std::vector<std::uint8_t> visible(CountIn(field.cells.counts));
    for (std::uint8_t& of : visible) of = number(0, 20) < share ? 0 : 255;
    const std::vector<std::uint8_t> shown = CellsThatShow(piece, field, map, visible);
    for (std::size_t cell = 0; cell < shown.size(); ++cell) {
      bool touches = false;
      for (std::size_t other = 0; other < visible.size() && !touches; ++other) {
        const bool itself = map.is_identity() && field.voxels.box == piece.voxels.box;
        touches =
            visible[other] == 0 &&
            (itself ? cell == other : Touch(piece, PlaceIn(piece.cells.counts, cell), field, PlaceIn(field.cells.counts, other), map));
      }
      found += touches ? 1 : 0;
      ASSERT_EQ(shown[cell] != 0, touches) << "case " << i << ", cell " << cell << ", seed " << kSeed;
    }
  }
  EXPECT_GT(found, 300);
}

}  // namespace
}  // namespace slabstream
