#include "tests/worker/renderers/raycast/scene_reference.h"

#include <gtest/gtest.h>

#include <optional>
#include <vector>

#include "common/renderers/raycast/raycast_parameters.h"
#include "tests/support/simd_targets.h"
#include "tests/worker/renderers/raycast/march_reference.h"
#include "worker/renderers/raycast/empty_distance.h"
#include "worker/renderers/raycast/frame_fields.h"
#include "worker/renderers/raycast/ray_labels.h"

namespace slabstream::testing {

namespace {

void ExpectAgreesAsItIs(const Scene& scene, float tolerance) {
  const FrameSetup& setup = scene.setup;
  const Box whole = scene.volume.block.box;
  const double rate = setup.parameters[0];
  const ViewRays rays = MakeViewRays(setup.camera, setup.description.geometry, rate, setup.clip);
  const SceneBoxes boxes(scene, whole);
  const RayPiece& piece = boxes.volume->CacheOf<RayVolume>().PiecesOf(*boxes.volume).front();
  const RayLook look =
      MakeRayLook(boxes.volume->Classification(setup), setup.transfer, setup.description, setup.camera, setup.shading, rate / setup.weight);
  const Result<std::optional<RayLabels>> labels = LabelsFor(*boxes.volume, whole, setup, rate);
  ASSERT_TRUE(labels.ok());
  ASSERT_EQ(labels->has_value(), LabelsOf(setup) != nullptr);
  // Nothing is leapt over.
  EmptyDistances everywhere(piece.cells.counts, std::vector<std::uint8_t>(piece.cells.ranges.size(), 0));
  everywhere.Find((1U << kOctants) - 1);
  const std::vector<std::int32_t> surface_cells(2 * piece.cells.ranges.size(), -1);
  const std::vector<std::uint16_t> all_shown(piece.cells.ranges.size() + 1, 0xFFFF);
  const Result<FrameFields> shown = FrameFields::Make(*boxes.volume, whole, setup, rate);
  ASSERT_TRUE(shown.ok());
  const std::vector<RayField> ray_fields = shown->Of(piece, look);
  const RayFields fields = {ray_fields, all_shown.data(), setup.flat};
  const RayBox box = MakeRayBox(piece.voxels, piece.cells.counts, WholeBox(whole), WholeBox(whole), rays, setup.camera);
  const MarchWork work = {.rays = &rays,
                          .box = &box,
                          .look = &look,
                          .to_samples = &everywhere,
                          .to_surfaces = look.isovalues.empty() ? nullptr : &everywhere,
                          .surface_cells = surface_cells.data(),
                          .smooth = raycast::SmoothGradient(setup.parameters),
                          .labels = *labels ? &**labels : nullptr,
                          .fields = *labels && shown->empty() ? nullptr : &fields};
  const PixelBounds all = {0, 0, setup.camera.width, setup.camera.height};
  const auto marched = [&](auto&& marcher) {
    LocalImage image = MakeLocalImage(PixelFormat::kRgba, all);
    marcher(work, all, image.rgba.data(), 4 * std::size_t(all.width()));
    return image;
  };
  const LocalImage expected = marched(MarchTileReference);
  std::vector<GradientBricks> bricks(ray_fields.size());
  const auto march = [&](const MarchWork& of, const PixelBounds& tile, float* rgba, std::size_t floats_a_row) {
    return MarchTile(of, tile, bricks, rgba, floats_a_row);
  };
  ForEachTarget([&] { EXPECT_LE(LargestDifference(marched(march), expected), tolerance); });
  EXPECT_LE(LargestDifference(Rendered(scene), expected), tolerance) << "leaps change it";
}

}  // namespace

void ExpectAgreesWithReference(Scene scene, float tolerance) {
  for (const bool smooth : {false, true}) {
    SCOPED_TRACE(::testing::Message() << "smooth " << smooth);
    scene.setup.parameters.at(raycast::kGradient) = smooth ? 1 : 0;
    ExpectAgreesAsItIs(scene, tolerance);
  }
}

}  // namespace slabstream::testing
