// Which voxels are kept for splatting, in which order, and with which normals: against a plain look at every voxel.
#include "worker/renderers/splat/occupied_voxels.h"
#include "common/parallel/task_arena.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <thread>
#include <vector>

#include "common/volume/indices.h"
#include "tests/support/random_volume.h"
#include "tests/worker/renderers/render_support.h"
#include "worker/kernels/normal_code.h"
#include "worker/renderers/splat/splat_cache.h"

namespace slabstream {
namespace {

using namespace slabstream::testing;  // NOLINT(google-build-using-namespace): test support

// Voxel by voxel, from the definition: sums in the order that brick_normals.h states, in floats.
class PlainLook {
 public:
  PlainLook(const VoxelBlock& block, const ClassificationTable& table, const Vec3& spacing)
      : block_(block), table_(table), spacing_(spacing) {}

  bool Occupied(const Index3& v) const { return std::isfinite(At(v)) && table_.opacity[std::size_t(Bin(v))] > 0; }
  int Bin(const Index3& v) const { return table_.BinOf(double(At(v))); }

  std::uint16_t Normal(const Index3& v) const {
    float smooth[3], along_y[3], along_z[3];
    for (int dx = -1; dx <= 1; ++dx) {
      float smooth_y[3], slope_y[3];
      for (int dz = -1; dz <= 1; ++dz) {
        const auto at = [&](int dy) { return At({v.x + dx, v.y + dy, v.z + dz}); };
        smooth_y[dz + 1] = Smooth(at(-1), at(0), at(1));
        slope_y[dz + 1] = at(1) - at(-1);
      }
      smooth[dx + 1] = Smooth(smooth_y[0], smooth_y[1], smooth_y[2]);
      along_y[dx + 1] = Smooth(slope_y[0], slope_y[1], slope_y[2]);
      along_z[dx + 1] = smooth_y[2] - smooth_y[0];
    }
    return EncodeNormal(Scale(Axis::kX, v.x) * (smooth[2] - smooth[0]), Scale(Axis::kY, v.y) * Smooth(along_y[0], along_y[1], along_y[2]),
                        Scale(Axis::kZ, v.z) * Smooth(along_z[0], along_z[1], along_z[2]));
  }

 private:
  static float Smooth(float below, float middle, float above) { return below + above + 2 * middle; }
  float At(Index3 v) const {
    for (int axis = 0; axis < 3; ++axis) v[axis] = std::clamp(v[axis], block_.box.begin[axis], block_.box.end[axis] - 1);
    return VisitScalarType(block_.type, [&]<class T>(const T*) { return float(block_.samples<T>()[block_.Offset(v)]); });
  }
  float Scale(Axis axis, std::int32_t at) const {
    const int steps = int(at > block_.box.begin[axis]) + int(at + 1 < block_.box.end[axis]);
    return steps == 0 ? 0.0F : float(1 / (steps * spacing_[axis]));
  }

  const VoxelBlock& block_;
  const ClassificationTable& table_;
  const Vec3 spacing_;
};

void ExpectAsPlainlySeen(const OccupiedVoxels& cells, const PlainLook& plain, const Box& data, const Box& wanted) {
  if (cells.to_make != nullptr) cells.to_make->NeedAll();
  const auto [c, u, v] = cells.axes;
  std::uint64_t found = 0, in_box = 0;
  for (std::int32_t slice = std::max(wanted.begin[c], data.begin[c]); slice < std::min(wanted.end[c], data.end[c]); ++slice) {
    for (std::int32_t row = data.begin[v]; row < data.end[v]; ++row) {
      const bool has_beam = slice >= cells.box.begin[c] && slice < cells.box.end[c] && row >= cells.box.begin[v] && row < cells.box.end[v];
      const std::size_t beam = has_beam ? cells.Beam(slice, row) : 0;
      std::uint64_t record = has_beam ? cells.first_record[beam] : 0;
      for (std::int32_t at = data.begin[u]; at < data.end[u]; ++at) {
        Index3 voxel;
        voxel[c] = slice, voxel[v] = row, voxel[u] = at;
        const std::int32_t cell = at / kCellVoxels - cells.first_cell;
        const bool has_cell = has_beam && cell >= 0 && cell < cells.cell_count;
        const bool marked = has_cell && (cells.Masks(beam)[cell] >> (at % kCellVoxels) & 1) != 0;
        ASSERT_EQ(marked, plain.Occupied(voxel)) << voxel.x << ' ' << voxel.y << ' ' << voxel.z;
        if (!marked) continue;
        ASSERT_EQ(cells.records[record].bin, plain.Bin(voxel));
        ASSERT_EQ(cells.records[record].normal, plain.Normal(voxel)) << voxel.x << ' ' << voxel.y << ' ' << voxel.z;
        EXPECT_TRUE(cells.occupied.Contains(voxel));
        ++record;
        ++found;
        in_box += wanted.Contains(voxel);
      }
      if (has_beam) {
        ASSERT_EQ(record, cells.first_record[beam + 1]);
      }
    }
  }
  EXPECT_EQ(cells.occupied_in_box, in_box);
  EXPECT_EQ(cells.occupied.empty(), found == 0);
}

struct Scene {
  Volume volume;
  FrameSetup setup;
};

// Blobs with noise, and of floats some that are none. `intervals` stretches of values are opaque.
Scene MakeScene(const Index3& size, ScalarType type, int intervals, unsigned seed) {
  Scene scene{MakeBlobs({size, {0.5, 2, 1}}, type, seed), {}};
  std::mt19937 random(seed);
  VisitScalarType(type, [&]<class T>(const T*) {
    T* samples = scene.volume.block.samples<T>();
    const std::int64_t count = scene.volume.block.box.voxel_count();
    for (std::int64_t i = 0; i < count; ++i) {
      if (samples[i] != 0) samples[i] = T(double(samples[i]) + random() % 1024 / 512.0);
      if constexpr (std::is_floating_point_v<T>) {
        constexpr float kStrange[] = {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
                                      -std::numeric_limits<float>::infinity(), -0.0F};
        if (random() % 512 == 0) samples[i] = kStrange[random() % 4];
      }
    }
  });
  SetupOptions options;
  options.transfer.colors = {{0, {1, 1, 1}}};
  options.transfer.opacities = {{0, 0, 0.5, 0}};
  for (int i = 0; i < intervals; ++i) {
    const double begin = 5 + 190.0 * i / intervals, end = begin + 95.0 / intervals;
    options.transfer.opacities.insert(options.transfer.opacities.end(),
                                      {{begin, 0, 0.5, 0}, {begin + 0.5, 0.5, 0.5, 0}, {end, 0.5, 0.5, 0}, {end + 0.5, 0, 0.5, 0}});
  }
  scene.setup = MakeSetup(scene.volume, options);
  return scene;
}

VoxelBlock Block(const Volume& volume, const Box& box) { return CutBox(volume, box)->voxels(); }

TEST(OccupiedVoxels, AreWhatAPlainLookFinds) {
  unsigned seed = 51;
  for (ScalarType type : kTypes) {
    for (int intervals : {1, 3, 9}) {
      for (Index3 size : {Index3{70, 35, 41}, Index3{33, 1, 50}, Index3{1, 40, 17}, Index3{48, 64, 32}}) {
        SCOPED_TRACE(::testing::Message() << "seed " << ++seed << ", type " << int(type) << ", " << intervals << " intervals, size "
                                          << size.x << ' ' << size.y << ' ' << size.z);
        const Scene scene = MakeScene(size, type, intervals, seed);
        const ClassificationTable table = Classify(scene.setup.transfer, scene.setup.description, scene.setup.range);
        const Box whole = scene.volume.block.box;
        const Box inner = {{size.x / 9, size.y / 7, size.z / 8}, {size.x - size.x / 6, size.y, size.z - size.z / 9}};
        const Box wanted = Intersection({{11, 0, 13}, {60, 25, 33}}, inner);
        for (const auto& [padded_box, wanted_box] : {std::pair(whole, whole), std::pair(inner, wanted.empty() ? inner : wanted)}) {
          const VoxelBlock block = Block(scene.volume, padded_box);
          BoxData by_block{VoxelBlock(block)}, by_bricks{BrickedVoxels(block)};
          const PlainLook plain(block, table, scene.setup.description.geometry.spacing);
          for (BoxData* data : {&by_block, &by_bricks}) {
            FrameSetup setup = scene.setup;
            for (Axis axis : kAxes) {
              setup.camera.traversal_axis = axis;
              ASSERT_NO_FATAL_FAILURE(
                  ExpectAsPlainlySeen(data->CacheOf<SplatCache>().Occupied(*data, setup, wanted_box), plain, padded_box, wanted_box));
            }
          }
        }
      }
    }
  }
}

template <class T>
std::vector<T> Kept(const LargeArray<T>& array, std::size_t count) {
  return {array.get(), array.get() + count};
}

TEST(OccupiedVoxels, DoNotDependOnThreads) {
  const Scene scene = MakeScene({90, 80, 70}, ScalarType::kUint8, 2, 52);
  const ClassificationTable table = Classify(scene.setup.transfer, scene.setup.description, scene.setup.range);
  const BinSelection selection = SelectBins(table, 0);
  const auto find = [&](int threads) {
    TaskArena arena(threads);
    return arena.Run([&] {
      VoxelBeams along_x = FindVoxelBeams(scene.volume.block, BrickRanges(scene.volume.block), table, selection, {1, 1, 1});
      along_x.to_make->NeedAll();
      VoxelBeams along_y = TurnVoxelBeams(along_x);
      return std::pair(std::move(along_x), std::move(along_y));
    });
  };
  const auto expect_equal = [](const VoxelBeams& a, const VoxelBeams& b) {
    ASSERT_EQ(a.box, b.box);
    ASSERT_EQ(a.record_count(), b.record_count());
    EXPECT_EQ(Kept(a.masks, a.cells()), Kept(b.masks, b.cells()));
    EXPECT_EQ(Kept(a.first_record, a.beam_count + 1), Kept(b.first_record, b.beam_count + 1));
    EXPECT_EQ(std::memcmp(a.records.get(), b.records.get(), a.record_count() * sizeof(VoxelRecord)), 0);
  };
  const auto one = find(1);
  EXPECT_GT(one.first.record_count(), 10000U);
  for (int threads : {2, 5}) {
    const auto many = find(threads);
    expect_equal(one.first, many.first);
    expect_equal(one.second, many.second);
  }
}

// Whichever bricks are needed first, by whichever threads.
TEST(OccupiedVoxels, RecordsAreMadeOnceInAnyOrder) {
  const Scene scene = MakeScene({90, 80, 70}, ScalarType::kUint8, 2, 52);
  const ClassificationTable table = Classify(scene.setup.transfer, scene.setup.description, scene.setup.range);
  const BinSelection selection = SelectBins(table, 0);
  const auto find = [&] { return FindVoxelBeams(scene.volume.block, BrickRanges(scene.volume.block), table, selection, {1, 1, 1}); };
  const VoxelBeams all = find();
  all.to_make->NeedAll();
  const BrickGrid grid(all.box);
  std::vector<Index3> bricks;
  for (const Index3& brick : IndicesIn(Box{grid.first, grid.first + grid.counts})) bricks.push_back(brick);
  for (int round = 0; round < 5; ++round) {
    const VoxelBeams each = find();
    ASSERT_EQ(each.record_count(), all.record_count());
    EXPECT_FALSE(each.to_make->RowAt(grid.first.y, grid.first.z).Has(grid.first.x));
    const BrickedVoxels elsewhere(scene.volume.block);
    each.to_make->SetVoxels(elsewhere);
    std::vector<std::jthread> threads;
    for (unsigned seed = 1; seed <= 3; ++seed) {
      threads.emplace_back([&, seed, order = bricks]() mutable {
        std::shuffle(order.begin(), order.end(), std::mt19937(seed));
        for (const Index3& brick : order) {
          each.to_make->Need(brick);
          EXPECT_TRUE(each.to_make->RowAt(brick.y, brick.z).Has(brick.x));
        }
      });
    }
    threads.clear();
    EXPECT_EQ(std::memcmp(each.records.get(), all.records.get(), all.record_count() * sizeof(VoxelRecord)), 0);
  }
}

// What lies outside of all that is occupied costs no beams.
TEST(OccupiedVoxels, EmptyRoundingsAreNotKept) {
  const auto bytes_in = [](std::int32_t side) {
    const std::int32_t first = side / 2 - 32;
    const Volume volume = MakeVolume({{side, side, side}, {1, 1, 1}}, ScalarType::kUint8, [&](const Index3& v) {
      const Box ball = {{first, first, first}, {first + 64, first + 64, first + 64}};
      return ball.Contains(v) ? 100 : 0;
    });
    const FrameSetup setup = MakeSetup(volume, {});
    const ClassificationTable table = Classify(setup.transfer, setup.description, setup.range);
    return FindVoxelBeams(volume.block, BrickRanges(volume.block), table, SelectBins(table, 0), {1, 1, 1}).bytes();
  };
  EXPECT_EQ(bytes_in(64), bytes_in(128));
}

}  // namespace
}  // namespace slabstream
