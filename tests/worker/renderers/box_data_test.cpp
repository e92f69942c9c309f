// What is kept of a padded box between frames, and the behaviour that both pipelines share.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <random>
#include <span>
#include <thread>

#include "common/mesh/mesh_part.h"
#include "common/parallel/parallel.h"
#include "tests/common/mesh/mesh_samples.h"
#include "tests/support/renderers.h"
#include "tests/support/same_image.h"
#include "tests/worker/renderers/render_support.h"
#include "tests/worker/renderers/splat/reference_splatting.h"
#include "worker/kernels/normal_code.h"
#include "worker/renderers/splat/splat_cache.h"
#include "worker/renderers/zbuffer/surface.h"

namespace slabstream {
namespace {

using namespace slabstream::testing;  // NOLINT(google-build-using-namespace): test support

template <class T>
double StoredAt(const Volume& volume, const Index3& v) {
  return double(volume.block.samples<T>()[volume.block.Offset(v)]);
}

// All records of the box.
std::span<const VoxelRecord> RecordsOf(BoxData& data, const FrameSetup& setup) {
  const OccupiedVoxels& voxels = data.CacheOf<SplatCache>().Occupied(data, setup, data.bricks().box());
  if (voxels.to_make != nullptr) voxels.to_make->NeedAll();
  return voxels.records;
}

// A ramp has the same gradient everywhere, at the border too, whatever the spacing.
TEST(OccupiedVoxels, NormalsAreThoseOfTheGradient) {
  const Vec3 spacing = {0.5, 2, 1};
  const Volume ramp =
      MakeVolume({{20, 18, 16}, spacing}, ScalarType::kFloat32, [&](const Index3& v) { return 1 + 2.0 * v.x + 3.0 * v.y + 1.0 * v.z; });
  const Vec3 expected = Normalized(Vec3{2, 3, 1} / spacing);
  const auto data = CutBox(ramp, ramp.block.box);
  FrameSetup setup = MakeSetup(ramp, {});
  for (Axis axis : kAxes) {
    setup.camera.traversal_axis = axis;
    for (const VoxelRecord& record : RecordsOf(*data, setup)) {
      ASSERT_NE(record.normal, kNoGradient);
      ASSERT_GT(std::abs(Dot(DecodeNormal(record.normal), expected)), 0.9999);
    }
  }
}

// On hard-edged noise, with rows of many lengths and volumes one voxel thick.
TEST(OccupiedVoxels, NormalsAreThoseOfTheirDefinition) {
  const unsigned seed = 35;
  std::mt19937 random(seed);
  for (ScalarType type : {ScalarType::kUint8, ScalarType::kUint16, ScalarType::kFloat32}) {
    for (Index3 size : {Index3{37, 7, 5}, Index3{16, 3, 4}, Index3{1, 9, 9}, Index3{33, 1, 2}}) {
      const Volume noise = MakeVolume({size, {0.5, 2, 1}}, type, [&](const Index3&) { return 1 + random() % 2 * 100; });
      const auto data = CutBox(noise, noise.block.box);
      FrameSetup setup = MakeSetup(noise, {});
      setup.camera.traversal_axis = Axis::kZ;  // records are in memory order
      const auto records = RecordsOf(*data, setup);
      ASSERT_EQ(records.size(), std::size_t(size.x) * std::size_t(size.y) * std::size_t(size.z));
      std::size_t record = 0;
      for (Index3 v; v.z < size.z; ++v.z) {
        for (v.y = 0; v.y < size.y; ++v.y) {
          for (v.x = 0; v.x < size.x; ++v.x) {
            const Vec3 gradient = ReferenceGradient(noise, v);
            const std::uint16_t code = records[record++].normal;
            ASSERT_EQ(code == kNoGradient, Length(gradient) == 0) << "seed " << seed << " voxel " << v.x << ' ' << v.y << ' ' << v.z;
            if (code == kNoGradient) continue;
            ASSERT_GT(std::abs(Dot(DecodeNormal(code), Normalized(gradient))), 0.9999)
                << "seed " << seed << " voxel " << v.x << ' ' << v.y << ' ' << v.z;
          }
        }
      }
    }
  }
}

// A ball of voxels that are either full or empty: on its surface normals point outwards within some degrees, although no sample tells where
// between two voxels the surface lies. (Differences of the six neighbours: 21 degrees on average, and no gradient in every seventh voxel.)
TEST(OccupiedVoxels, NormalsOfAHardEdgedBallAreTheBalls) {
  constexpr double kRadius = 25;
  const Vec3 middle = {30, 30, 30};
  const Volume ball = MakeVolume({{61, 61, 61}, {1, 1, 1}}, ScalarType::kUint8,
                                 [&](const Index3& v) { return Length(ToVec3(v) - middle) <= kRadius ? 100.0 : 0.0; });
  const auto data = CutBox(ball, ball.block.box);
  FrameSetup setup = MakeSetup(ball, {});
  setup.camera.traversal_axis = Axis::kZ;  // records are in memory order
  const auto records = RecordsOf(*data, setup);
  double sum = 0;
  int count = 0;
  std::size_t record = 0;
  for (Index3 v; v.z < 61; ++v.z) {
    for (v.y = 0; v.y < 61; ++v.y) {
      for (v.x = 0; v.x < 61; ++v.x) {
        const Vec3 outwards = ToVec3(v) - middle;
        if (Length(outwards) > kRadius) continue;
        const std::uint16_t code = records[record++].normal;
        if (Length(outwards) < kRadius - 1) continue;
        ASSERT_NE(code, kNoGradient);
        sum += std::acos(std::min(1.0, std::abs(Dot(DecodeNormal(code), Normalized(outwards)))));
        ++count;
      }
    }
  }
  EXPECT_EQ(record, records.size());
  EXPECT_LT(sum / count * 57.29577951308232, 8);
}

// All faces of opaque voxels of the box beyond which nothing is opaque, each once, in the order that breaks ties.
TEST(Surface, IsTheOpenFacesOfOpaqueVoxels) {
  const Volume volume = MakeBlobs({{40, 30, 20}, {1, 1, 1}}, ScalarType::kUint8, 32);
  const Box box = {{8, 8, 0}, {32, 22, 20}};
  const auto data = CutBox(volume, Grown(box, 8, volume.block.box));
  const FrameSetup setup = MakeSetup(volume, {});
  const ClassificationTable table = Classify(setup.transfer, setup.description, setup.range);
  const float threshold = 0.5F * MaxOpacity(table, setup.description, setup.range);
  const auto bin = [&](const Index3& v) { return table.BinOf(StoredAt<std::uint8_t>(volume, v)); };
  const auto opaque = [&](const Index3& v) { return volume.block.box.Contains(v) && table.opacity[std::size_t(bin(v))] >= threshold; };
  const auto neighbour = [](Index3 v, int side) {
    v[side / 2] += side % 2 == 0 ? -1 : 1;
    return v;
  };
  const BinSelection bins = SelectBins(table, threshold);
  const Surface surface = FindSurface(data->voxels(), {table, bins, data->ranges()}, {1, 1, 1}, box);
  std::size_t expected = 0;
  for (Index3 v = box.begin; v.z < box.end.z; ++v.z) {
    for (v.y = box.begin.y; v.y < box.end.y; ++v.y) {
      for (v.x = box.begin.x; v.x < box.end.x; ++v.x) {
        for (int side = 0; side < kSides; ++side) expected += opaque(v) && !opaque(neighbour(v, side));
      }
    }
  }
  EXPECT_GT(expected, 100U);
  ASSERT_EQ(surface.normals.size(), expected);

  std::uint32_t next = 0, last_index = 0;
  for (const SurfaceBrick& brick : surface.bricks) {
    for (int side = 0; side < kSides; ++side) {
      ASSERT_EQ(brick.side_begin[std::size_t(side)], next);
      for (; next < brick.side_begin[std::size_t(side) + 1]; ++next) {
        const FaceSite& site = surface.sites[next];
        const Index3 v = {site.x, site.y, site.z};
        ASSERT_TRUE(box.Contains(v) && brick.voxels.Contains(v));
        ASSERT_EQ((Index3{v.x / 16 * 16, v.y / 16 * 16, v.z / 16 * 16}), brick.origin);
        ASSERT_EQ(site.bin_and_side, bin(v) | side << kBinBits);
        ASSERT_TRUE(opaque(v) && !opaque(neighbour(v, side)));
        const std::uint32_t index = FaceIndex(site.x, site.y, site.z, std::uint32_t(side / 2), 3, 2);
        const bool other_side = side % 2 == 1 && next == brick.side_begin[std::size_t(side)];  // begins with the first voxel again
        if (next > 0 && !other_side) {
          ASSERT_GT(index, last_index);
        }
        last_index = index;
      }
    }
  }
  EXPECT_EQ(next, expected);
}

TEST(BoxData, KeepsWhatItMadeWhileTheSameVoxelsShow) {
  const Volume volume = MakeBlobs({{40, 40, 40}, {1, 1, 1}}, ScalarType::kUint8, 33);
  const auto data = CutBox(volume, volume.block.box);
  const std::size_t before = data->derived_bytes();
  SetupOptions options;
  FrameSetup setup = MakeSetup(volume, options);
  const OccupiedVoxels* first = &data->CacheOf<SplatCache>().Occupied(*data, setup, volume.block.box);
  EXPECT_GE(data->derived_bytes(), before + first->records.size() * sizeof(VoxelRecord));
  const VoxelRecord* records = first->records.data();
  const std::size_t record_count = first->records.size();

  // Other opacities and colours of the same voxels, and the same axis again after another one: nothing is made anew.
  setup.transfer = Ramp(0.7);
  EXPECT_EQ(data->CacheOf<SplatCache>().Occupied(*data, setup, volume.block.box).records.data(), records);
  setup.camera.traversal_axis = setup.camera.traversal_axis == Axis::kX ? Axis::kY : Axis::kX;
  EXPECT_NE(data->CacheOf<SplatCache>().Occupied(*data, setup, volume.block.box).records.data(), records);
  setup.camera.traversal_axis = MakeSetup(volume, options).camera.traversal_axis;
  EXPECT_EQ(data->CacheOf<SplatCache>().Occupied(*data, setup, volume.block.box).records.data(), records);

  setup.transfer.opacities = {{100, 0, 0.5, 0}, {200, 1, 0.5, 0}};  // fewer voxels
  EXPECT_LT(data->CacheOf<SplatCache>().Occupied(*data, setup, volume.block.box).records.size(), record_count + 1);
  const FrameSetup fresh = setup;
  const auto fresh_box = CutBox(volume, volume.block.box);
  EXPECT_EQ(data->CacheOf<SplatCache>().Occupied(*data, setup, volume.block.box).records.size(),
            fresh_box->CacheOf<SplatCache>().Occupied(*fresh_box, fresh, volume.block.box).records.size());
}

// The frame that the setup's renderer makes of the whole volume as one box.
Result<LocalImage> RenderBox(const Volume& volume, const FrameSetup& setup, const RenderControl& control, RankReport& report) {
  const auto data = BoxFor(*setup.renderer, volume, volume.block.box);
  return MakeRenderer(*setup.renderer)->Render(*data, volume.block.box, setup, {}, control, report);
}

// A volume without a drawn voxel. Every finite voxel of an intensity projection is drawn.
TEST(Renderers, EmptyVolumesMakeEmptyImages) {
  const Volume empty = AsGrid(MakeVolume({{9, 8, 7}, {1, 1, 1}}, ScalarType::kUint8, [](const Index3&) { return 0; }));
  for (const RendererKind* kind : Renderers()) {
    SetupOptions options;
    options.renderer = kind;
    const FrameSetup setup = MakeSetup(empty, options);
    const ClassificationTable drawn = kind->DrawnTable(setup.transfer, Summarize(empty));
    const LocalImage image = RenderWhole(empty, setup);
    EXPECT_EQ(image.bounds.empty(), drawn.opacity[std::size_t(drawn.BinOf(0))] == 0) << kind->name();
    EXPECT_EQ(image.format, kind->format());
  }
}

TEST(Renderers, WhatLiesOutsideTheFrameIsNotDrawn) {
  const Volume block = AsGrid(MakeBlock({{60, 60, 60}, {1, 1, 1}}));
  for (const RendererKind* kind : Renderers()) {
    const FrameSetup setup = MakeSetup(block, {.renderer = kind, .view = {.zoom = 100}});
    RankReport report;
    const LocalImage image = RenderBox(block, setup, RenderControl(), report).value();
    EXPECT_EQ(image.bounds, FrameBounds(setup));
    EXPECT_LT(report.drawn_voxels, block.block.box.voxel_count() / 20);
  }
}

TEST(Renderers, StopWhenCancelled) {
  const Volume block = AsGrid(MakeBlock({{20, 20, 20}, {1, 1, 1}}));
  for (const RendererKind* kind : Renderers()) {
    RankReport report;
    RenderControl cancelled;
    cancelled.Cancel();
    const Result<LocalImage> result = RenderBox(block, MakeSetup(block, {.renderer = kind}), cancelled, report);
    ASSERT_FALSE(result.ok());
    EXPECT_EQ(result.status().code(), StatusCode::kCancelled);
  }
}

TEST(Renderers, PausesChangeNoBit) {
  const Volume block = AsGrid(MakeBlock({{40, 40, 40}, {1, 1, 1}}));
  for (const RendererKind* kind : Renderers()) {
    SCOPED_TRACE(kind->name());
    const FrameSetup setup = MakeSetup(block, {.renderer = kind, .size = {200, 200}});
    const auto render = [&](const RenderControl& control) {
      RankReport report;
      return RenderBox(block, setup, control, report).value();
    };
    const LocalImage expected = render(RenderControl());
    RenderControl control;
    LocalImage paused;
    {
      const std::jthread pauses([&](const std::stop_token& stop) {
        while (!stop.stop_requested()) {
          control.Pause();
          control.Resume();
        }
      });
      paused = render(control);
    }
    ExpectSameBits(paused, expected);
  }
}

// As voxels that are read in parts arrive.
PaddedVoxels WrittenRowByRow(const VoxelBlock& block) {
  const PaddedVoxels padded = MakePaddedVoxels(block.box, block.type);
  const std::size_t row = std::size_t(block.box.size().x) * BytesPerSample(block.type);
  for (Index3 v = block.box.begin; v.z < block.box.end.z; ++v.z) {
    for (v.y = block.box.begin.y; v.y < block.box.end.y; ++v.y) {
      std::memcpy(padded.At(v), block.bytes.data() + std::size_t(block.Offset(v)) * BytesPerSample(block.type), row);
    }
  }
  FillPadding(padded);
  return padded;
}

TEST(PaddedVoxels, ArePaddedAlikeWhereverTheyComeFrom) {
  for (const ScalarType type : {ScalarType::kUint8, ScalarType::kUint16, ScalarType::kFloat32}) {
    for (const Index3 size : {Index3{40, 23, 17}, Index3{1, 5, 1}, Index3{3, 1, 2}}) {
      const Volume volume = MakeBlobs({size, {1, 1, 1}}, type, 34);
      const PaddedVoxels written = WrittenRowByRow(volume.block), padded = Pad(VoxelBricks(volume.block), volume.block.box);
      ASSERT_EQ(written.bytes(), padded.bytes());
      EXPECT_EQ(std::memcmp(written.samples.get(), padded.samples.get(), padded.bytes()), 0);
    }
  }
}

TEST(Renderers, DrawPaddedVoxelsAsAnyOthers) {
  const Volume blobs = AsGrid(MakeBlobs({{50, 40, 30}, {1, 1, 1}}, ScalarType::kUint16, 36));
  for (const RendererKind* kind : Renderers()) {
    SCOPED_TRACE(kind->name());
    SetupOptions options;
    options.renderer = kind;
    const FrameSetup setup = MakeSetup(blobs, options);
    const auto render = [&](BoxData& data) {
      RankReport report;
      return MakeRenderer(*kind)->Render(data, blobs.block.box, setup, {}, RenderControl(), report).value();
    };
    const auto cells = std::make_shared<const Mesh>(MeshCutter(blobs.cells).Cut(blobs.block.box));
    BoxData data(std::make_shared<BoxVoxels>(WrittenRowByRow(blobs.block), cells));
    const LocalImage drawn = render(data), expected = render(*BoxFor(*kind, blobs, blobs.block.box));
    ExpectSameBits(drawn, expected);
    if (kind->name() == "raycast") {
      EXPECT_LT(data.derived_bytes(), blobs.block.bytes.size() / 2) << "rays read them where they are";
    }
  }
}

TEST(Renderers, ReportTheirStages) {
  const Volume block = AsGrid(MakeBlock({{20, 20, 20}, {1, 1, 1}}));
  for (const RendererKind* kind : Renderers()) {
    RankReport report;
    ASSERT_TRUE(RenderBox(block, MakeSetup(block, {.renderer = kind}), RenderControl(), report).ok());
    ASSERT_EQ(report.spans.size(), 1U);
    EXPECT_EQ(report.spans[0].stage, Stage::kRender);
    std::int64_t stages = 0;
    for (const Stage stage : kind->stages()) stages += report.stage_ns[std::size_t(stage)];
    EXPECT_GT(stages, 0) << kind->name();
    stages += report.stage_ns[std::size_t(Stage::kPrepare)];
    // Stages count the time of every thread.
    EXPECT_LE(stages, report.stage_ns[std::size_t(Stage::kRender)] * ThreadsHere());
  }
}

}  // namespace
}  // namespace slabstream
