// The Z-buffer pipeline. Each opaque voxel is its cell, the box [q - 0.5, q + 0.5) round its centre, and its open faces are drawn. The
// nearest face along a pixel's ray is visible, and only visible faces are shaded (deferred Phong). There are no holes at any zoom. The
// picture has the same bits for every partition, machine and thread count: it depends only on pixels and faces, and ties of depth go to the
// lower voxel index.
//
//   1. place the bricks of the surface on the screen and sort them, nearest first
//   2. cut the image into bands of rows, one task each: no other task touches a band's pixels
//   3. each band draws its bricks (draw_faces.h), except those behind what is already drawn, and if the volume is clipped, the cuts through
//      opaque voxels (cut_faces.h); then it shades its pixels (shade_faces.h)
#include <hwy/cache_control.h>

#include <algorithm>
#include <numeric>
#include <optional>

#include "common/parallel/parallel.h"
#include "common/parallel/per_thread.h"
#include "worker/kernels/draw_faces.h"
#include "worker/kernels/shade_faces.h"
#include "worker/renderers/for_each_piece.h"
#include "worker/renderers/renderer.h"
#include "worker/renderers/stage_clock.h"
#include "worker/renderers/zbuffer/brick_projection.h"
#include "worker/renderers/zbuffer/cut_faces.h"
#include "worker/renderers/zbuffer/surface.h"
#include "worker/renderers/zbuffer/surface_cache.h"

namespace slabstream::zbuffer {
namespace {

// The bricks that may be visible, nearest first, and the pixels that they may touch.
struct Scene {
  std::vector<ProjectedBrick> views;  // by brick of the surface
  std::vector<std::uint32_t> order;   // of the bricks that may be visible
  PixelBounds bounds;
};

// `cuts`: null if nothing is clipped.
Scene PlaceBricks(const Surface& surface, const BrickProjection& projection, const ClipRegion& clip, const CutFaces* cuts) {
  constexpr std::size_t kGrain = 256;
  Scene scene;
  const std::size_t count = surface.bricks.size();
  scene.views.resize(count);
  ParallelForRanges(0, count, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const SurfaceBrick& brick = surface.bricks[i];
      if (cuts == nullptr) {
        scene.views[i] = projection.View(brick);
      } else if (clip.MayKeep(brick.voxels)) {
        scene.views[i] = projection.View(brick);
        scene.views[i].clipped = !cuts->IsWhole(brick.voxels);
        if (cuts->inside()) scene.views[i].pixels = Intersection(scene.views[i].pixels, cuts->bounds());
      }
    }
  });
  float least = std::numeric_limits<float>::infinity(), greatest = 0;
  for (const ProjectedBrick& view : scene.views) {
    if (view.pixels.empty()) continue;
    scene.bounds = Union(scene.bounds, view.pixels);
    least = std::min(least, view.nearest);
    greatest = std::max(greatest, view.nearest);
  }
  if (cuts != nullptr) scene.bounds = Union(scene.bounds, cuts->bounds());
  // A counting sort by depth. The order affects only how many bricks turn out to be hidden.
  constexpr std::size_t kClasses = 256;
  const float scale = greatest > least ? float(kClasses - 1) / (greatest - least) : 0.0F;
  const auto depth_class = [&](const ProjectedBrick& view) { return std::size_t((view.nearest - least) * scale); };
  std::array<std::uint32_t, kClasses + 1> begin{};
  for (const ProjectedBrick& view : scene.views) {
    if (!view.pixels.empty()) ++begin[depth_class(view) + 1];
  }
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  scene.order.resize(begin.back());
  for (std::size_t i = 0; i < count; ++i) {
    if (!scene.views[i].pixels.empty()) scene.order[begin[depth_class(scene.views[i])]++] = std::uint32_t(i);
  }
  return scene;
}

// Divides the rows of the bounds into bands of about equal work, from top to bottom: each band's first row, and the end. At least `bands`
// bands if there are as many rows. No band has many more than kMostKeys pixels, so that keys stay in a core's cache.
std::vector<std::int32_t> CutIntoBands(const Surface& surface, const Scene& scene, std::int64_t bands) {
  constexpr std::int64_t kMostKeys = 1 << 16;
  const std::int64_t most_rows = std::max<std::int64_t>(1, kMostKeys / std::max(1, scene.bounds.width()));
  std::vector<std::int64_t> work(std::size_t(scene.bounds.height()), scene.bounds.width());
  for (std::uint32_t number : scene.order) {
    const PixelBounds& pixels = scene.views[number].pixels;
    work[std::size_t((pixels.y_begin + pixels.y_end) / 2 - scene.bounds.y_begin)] += surface.bricks[number].face_count();
  }
  const std::int64_t total = std::accumulate(work.begin(), work.end(), std::int64_t{0});
  std::vector<std::int32_t> begins = {scene.bounds.y_begin};
  std::int64_t done = 0, part = 1;
  for (std::size_t row = 0; row < work.size(); ++row) {
    done += work[row];
    const std::int32_t next = scene.bounds.y_begin + std::int32_t(row) + 1;
    if (done * bands < total * part && next - begins.back() < most_rows) continue;
    begins.push_back(next);
    part = done * bands / std::max<std::int64_t>(total, 1) + 1;
  }
  if (begins.back() < scene.bounds.y_end) begins.push_back(scene.bounds.y_end);
  return begins;
}

// Prefetches the sites of a brick's sides; they arrive while other bricks are drawn.
void FetchSites(const Surface& surface, std::uint32_t brick, std::uint32_t sides) {
  constexpr std::uint32_t kPerLine = 64 / sizeof(FaceSite);
  const auto& begin = surface.bricks[brick].side_begin;
  for (std::size_t side = 0; side < kSides; ++side) {
    if ((sides >> side & 1) == 0) continue;
    for (std::uint32_t face = begin[side]; face < begin[side + 1]; face += kPerLine) hwy::Prefetch(&surface.sites[face]);
  }
}

// Of a band; kept from frame to frame.
struct Scratch {
  AlignedVector<std::uint64_t> keys;
  AlignedVector<float> from, to;  // DepthLimits
  std::vector<CutPixel> cuts;
};

// The keys of a band of the scene, and the cuts in it. `cuts` may be null.
std::size_t DrawBand(const Surface& surface, const Scene& scene, const BrickProjection& projection, Projection kind, const CutFaces* cuts,
                     const RenderControl& control, const KeyBand& band, Scratch& scratch) {
  const std::size_t pixels = band.stride * std::size_t(band.bounds.height());
  std::fill_n(band.keys, pixels, kEmptyKey);
  std::vector<std::uint32_t> bricks;
  PixelBounds clipped;  // that clipped bricks may touch
  for (std::uint32_t number : scene.order) {
    const PixelBounds touched = Intersection(scene.views[number].pixels, band.bounds);
    if (touched.empty()) continue;
    bricks.push_back(number);
    if (scene.views[number].clipped) clipped = Union(clipped, touched);
  }
  KeyBand limited = band;
  bool cuts_drawn = cuts == nullptr;
  const auto draw_cuts = [&] {
    scratch.cuts.clear();
    cuts->Draw(band, scratch.cuts);
    cuts_drawn = true;
  };
  constexpr std::size_t kAhead = 2;  // bricks
  std::size_t drawn = 0;
  for (std::size_t i = 0; i < bricks.size() && !control.cancelled(); ++i) {
    if (i + kAhead < bricks.size()) FetchSites(surface, bricks[i + kAhead], scene.views[bricks[i + kAhead]].sides);
    const ProjectedBrick& view = scene.views[bricks[i]];
    if (!cuts_drawn && view.nearest >= cuts->turn()) draw_cuts();
    const PixelBounds touched = Intersection(view.pixels, band.bounds);
    if (AllHidden(band, touched, view.nearest)) continue;
    if (view.clipped && limited.limits.from == nullptr) {
      scratch.from.resize(std::max(scratch.from.size(), pixels));
      scratch.to.resize(scratch.from.size());
      cuts->Limits(clipped, band, scratch.from.data(), scratch.to.data());
      limited.limits = {scratch.from.data(), scratch.to.data(), cuts->inside()};
    }
    if (view.clipped && AllHidden(limited, touched, view.nearest)) continue;  // by the cut that goes through it
    const SurfaceBrick& brick = surface.bricks[bricks[i]];
    for (int side = 0; side < kSides; ++side) {
      const std::uint32_t first = brick.side_begin[std::size_t(side)], count = brick.side_begin[std::size_t(side) + 1] - first;
      if ((view.sides >> side & 1) == 0 || count == 0) continue;
      drawn += DrawFaces(kind, projection.Faces(brick, side), surface.sites.data(), surface.normals.data(), first, count,
                         view.clipped ? limited : band);
    }
  }
  if (!cuts_drawn) draw_cuts();
  return drawn;
}

class ZBufferRenderer : public Renderer {
 public:
  Result<LocalImage> Render(BoxData& data, const LevelBox& at, const FrameSetup& setup, const OcclusionMask& /*hidden*/,
                            const RenderControl& control, RankReport& report) override {
    const Box& box = at.box;
    StageClock clock(report);
    const ClassificationTable& table = data.Classification(setup);
    auto& cache = data.CacheOf<SurfaceCache>();
    const Result<const Surface*> found = cache.Of(data, setup, box);
    if (!found.ok()) return found.status();
    const Surface& surface = **found;
    std::optional<CutFaces> cuts;
    // Cuts lie in opaque voxels; without these there are no faces either.
    if (!setup.clip.empty() && !surface.opaque_hull.empty()) {
      cuts.emplace(data, setup, surface.opaque_hull, cache.opaque_bins(), cache.labels());
    }
    clock.Charge(Stage::kPrepare);

    const BrickProjection projection(setup.camera, setup.description.geometry.size);
    const CutFaces* const drawn_cuts = cuts ? &*cuts : nullptr;
    const Scene scene = PlaceBricks(surface, projection, setup.clip, drawn_cuts);
    LocalImage image = MakeUnwrittenImage(PixelFormat::kDepth, scene.bounds);
    const std::vector<std::int32_t> begins = CutIntoBands(surface, scene, kBandsPerThread * ThreadsHere());
    FaceShading shading = MakeFaceShading(setup.camera, setup.shading, setup.description.geometry.size);
    std::optional<FrameLight::View> light;
    if (data.light() != nullptr) shading.frame_light = &light.emplace(data.light()->Seen());
    shading.sites = surface.sites.data();
    shading.normals = surface.normals.data();
    std::vector<float> colors;
    colors.reserve(4 * table.color.size());
    for (const Rgb& color : table.color) colors.insert(colors.end(), {color.r, color.g, color.b, 1});
    shading.colors = colors.data();
    if (const BoxLabels* const labels = cache.labels()) {
      shading.labels = surface.labels.data();
      shading.label_colors = labels->colors.data();
    }
    clock.Charge(Stage::kZBuffer);

    std::atomic<std::size_t> drawn = 0;
    std::atomic<std::int64_t> draw_ns = 0, shade_ns = 0;
    ForEachPiece(std::int32_t(begins.size()) - 1, control, [&](std::int32_t number) {
      const Time begin = MonotonicNow();
      const std::size_t i = std::size_t(number) + 1;
      KeyBand band;
      band.bounds = {scene.bounds.x_begin, begins[i - 1], scene.bounds.x_end, begins[i]};
      band.stride = std::size_t(band.bounds.width() + kKeyPadding);
      const std::size_t pixels = band.stride * std::size_t(band.bounds.height());
      Scratch& scratch = scratch_.Mine();
      scratch.keys.resize(std::max(scratch.keys.size(), pixels));
      band.keys = scratch.keys.data();
      drawn += DrawBand(surface, scene, projection, setup.camera.projection, drawn_cuts, control, band, scratch);
      const Time middle = MonotonicNow();
      if (cuts) CutFaces::TakeSeen(band, scratch.cuts);
      for (std::int32_t y = band.bounds.y_begin; y < band.bounds.y_end && !control.cancelled(); ++y) {
        const auto width = std::size_t(band.bounds.width()), pixel = std::size_t(y - scene.bounds.y_begin) * width;
        const std::size_t row = std::size_t(y - band.bounds.y_begin) * band.stride;
        ShadeFaceRow(shading, band.keys + row, band.bounds.x_begin, y, width, &image.rgba[4 * pixel], &image.depth[pixel],
                     &image.voxel[pixel]);
      }
      if (cuts) cuts->Shade(scratch.cuts, shading, image);
      draw_ns += (middle - begin).count();
      shade_ns += (MonotonicNow() - middle).count();
    });
    report.stage_ns[std::size_t(Stage::kZBuffer)] += draw_ns;
    report.stage_ns[std::size_t(Stage::kShade)] += shade_ns;
    report.drawn_voxels += drawn;
    return clock.Finish(std::move(image), control);
  }

 private:
  // More bands balance the load better, but bricks on the border of two bands are drawn by both.
  static constexpr int kBandsPerThread = 4;

  PerThread<Scratch> scratch_;
};

}  // namespace

std::unique_ptr<Renderer> MakePixelHalf() { return std::make_unique<ZBufferRenderer>(); }

}  // namespace slabstream::zbuffer
