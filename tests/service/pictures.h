// What the service tests compare: the picture of a direct rendering of the whole volume as one box, and the difference of two pictures.
#pragma once

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include "client/client.h"
#include "common/image/sample_codes.h"
#include "common/mesh/mesh_part.h"
#include "common/mesh/summarize_cells.h"
#include "common/planning/frame_plan.h"
#include "common/renderers/renderer_choice.h"
#include "common/volume/sphere.h"
#include "tests/support/renderers.h"
#include "worker/renderers/renderer.h"

namespace slabstream {

inline std::shared_ptr<const Volume> TestSphere(int size) {
  return std::make_shared<const Volume>(MakeSphere({.sphere_class = SphereClass::kFilled, .size = size, .occupancy = 0.3}).value());
}

inline FrameRequest TestRequest(const RendererKind* renderer, double azimuth_degrees, int groups = 2) {
  FrameRequest request;
  request.dataset = "ball";
  request.renderer = renderer->name();
  request.size = {96, 80};
  request.view.azimuth_degrees = azimuth_degrees;
  request.view.elevation_degrees = 20;
  request.transfer.choice = TransferFunction{.colors = {{0, {0.2F, 0.4F, 1}}, {255, {1, 0.7F, 0.3F}}},
                                             .opacities = {{0, 0, 0.5, 0}, {100, 0, 0.5, 0}, {255, 0.2, 0.5, 0}},
                                             .opacity_distance = 1};
  request.policy.decomposition = "slab";
  request.policy.groups = groups;
  return request;
}

// Of each renderer that draws voxels: each projection, and a perspective one whose eye is only so far from the volume's centre.
inline std::vector<FrameRequest> RequestsOfRenderers(double near) {
  std::vector<FrameRequest> requests;
  for (const RendererKind* renderer : Renderers()) {
    if (renderer->Can(Ability::kCells)) continue;
    FrameRequest request = TestRequest(renderer, 37, 0);
    request.termination = 0;
    for (const Projection projection : renderer->projections()) {
      request.view.projection = projection;
      requests.push_back(request);
    }
    if (!renderer->Can(Ability::kPerspective)) continue;
    request.view.distance = near;
    request.view.fov_degrees = 60;
    requests.push_back(request);
  }
  return requests;
}

// The whole volume as one box, without planner's groups, combining or transport.
inline LocalImage RenderDirectly(const FrameRequest& request, const Volume& volume, const VolumeSummary& summary) {
  const Result<FramePlan> plan = PlanFrame(request, 1, summary, Roster{{1}});
  CHECK(plan.ok()) << plan.status().message();
  VoxelBlock copy = MakeVoxelBlock(volume.block.box, volume.block.type);
  copy.bytes = volume.block.bytes;
  std::shared_ptr<const Mesh> cells;
  if (volume.cells != nullptr) cells = std::make_shared<const Mesh>(MeshCutter(volume.cells).Cut(volume.block.box));
  BoxData data(std::move(copy), std::move(cells));
  RenderControl control;
  RankReport report;
  Result<LocalImage> image = MakeRenderer(*plan->setup.renderer)->Render(data, volume.block.box, plan->setup, {}, control, report);
  CHECK(image.ok()) << image.status().message();
  return FinishPicture(*std::move(image), plan->setup);
}
inline LocalImage RenderDirectly(const FrameRequest& request, const Volume& volume) {
  return RenderDirectly(request, volume, SummaryOf(volume));
}

struct PixelValue {
  float rgba[4] = {0, 0, 0, 0};
  float depth = INFINITY;
};

inline PixelValue PixelAt(const LocalImage& image, int x, int y) {
  PixelValue value;
  if (x < image.bounds.x_begin || x >= image.bounds.x_end || y < image.bounds.y_begin || y >= image.bounds.y_end) return value;
  const auto index = std::size_t(y - image.bounds.y_begin) * std::size_t(image.bounds.width()) + std::size_t(x - image.bounds.x_begin);
  std::copy_n(image.rgba.data() + 4 * index, 4, value.rgba);
  if (HasDepth(image.format)) value.depth = image.depth[index];
  return value;
}

inline PixelValue PixelAt(const PictureImage& image, int x, int y) {
  if (image.floats() != nullptr) return PixelAt(*image.floats(), x, y);
  const StraightImage& codes = *image.codes();
  PixelValue value;
  const PixelBounds& b = codes.bounds;
  if (!b.Contains({x, y, x + 1, y + 1})) return value;
  FromStraightCodes(&codes.codes[4 * (std::size_t(y - b.y_begin) * std::size_t(b.width()) + std::size_t(x - b.x_begin))], 1, value.rgba);
  return value;
}

// Largest difference of a channel (or of depths) over all pixels of the frame; infinite where one has a depth and the other none.
template <class A, class B>
float LargestDifference(const A& a, const B& b, ImageSize size) {
  float largest = 0;
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const PixelValue p = PixelAt(a, x, y), q = PixelAt(b, x, y);
      for (int c = 0; c < 4; ++c) largest = std::max(largest, std::abs(p.rgba[c] - q.rgba[c]));
      if (p.depth != q.depth) largest = std::max(largest, std::abs(p.depth - q.depth));
    }
  }
  return largest;
}

// Accumulated opacity differs by rounding and by what termination hides; pictures of other formats are identical.
inline float AllowedDifference(const FrameRequest& request) {
  const PixelFormat format = RenderersFor(request).value().front()->format();
  return format == PixelFormat::kRgba ? 2e-5F + float(request.termination) : 0.0F;
}

// Of pictures of the same samples: 0, or what rounding leaves if sums have another order. Rays add most numbers: a channel is off by up to
// 9 in the last place of 24 bits, whether boxes are a kd-tree's or lie as owners have them.
inline float AllowedRounding(const FrameRequest& request) {
  if (AllowedDifference(request) == 0) return 0;
  return request.renderer == "raycast" ? 5.5e-7F : 3e-7F;
}

// The least alpha that the most opaque pixel of a test picture has: opacity accumulates, but a projection shows that of one value.
inline double ExpectedAlpha(const FrameRequest& request) {
  const PixelFormat format = RenderersFor(request).value().front()->format();
  return format == PixelFormat::kRgba || HasDepth(format) ? 0.5 : 0.15;
}

// The highest alpha of a picture that came as floats.
inline double HighestAlpha(const PictureImage& picture) {
  const LocalImage& image = *picture.floats();
  float highest = 0;
  for (std::size_t i = 3; i < image.rgba.size(); i += 4) highest = std::max(highest, image.rgba[i]);
  return highest;
}

inline std::uint64_t VoxelBytes(const FrameStatistics& statistics) {
  std::uint64_t sum = 0;
  for (const RankReport& report : statistics.reports) sum += report.voxel_bytes;
  return sum;
}

}  // namespace slabstream
