#include "worker/shapes/compose_shapes.h"

#include <algorithm>
#include <array>

#include "common/image/resolve.h"
#include "common/kernels/combine.h"
#include "common/parallel/parallel.h"
#include "worker/shapes/fragment_order.h"

namespace slabstream {
namespace {

using Color = std::array<float, 4>;  // premultiplied

void Over(Color& front, const Color& back) {
  const float through = 1 - front[3];
  for (std::size_t i = 0; i < 4; ++i) front[i] += through * back[i];
}

// `image` on pixels that hold it and `more`.
LocalImage Grown(const LocalImage& image, const PixelBounds& more) {
  LocalImage grown = MakeLocalImage(image.format, Union(image.bounds, more));
  Combine(grown, image, Side::kFront);
  FillRows(grown);
  return grown;
}

// Calls use(fragments, number of the pixel in `image`, x, y) for each pixel of `pixels` with fragments.
template <class Use>
void ForEachPixel(LocalImage& image, PixelRange pixels, std::int32_t frame_width, const FrameShapes& shapes, const Use& use) {
  const PixelBounds part = Intersection(image.bounds, shapes.bounds());
  constexpr std::int32_t kRows = 16;
  ParallelForRanges(part.y_begin, part.y_end, kRows, [&](std::int32_t begin, std::int32_t end) {
    for (std::int32_t y = begin; y < end; ++y) {
      const std::uint64_t row = std::uint64_t(y) * std::uint64_t(frame_width);
      const ShapeTile* tile = nullptr;
      for (std::int32_t x = part.x_begin; x < part.x_end; ++x) {
        if (row + std::uint64_t(x) < pixels.begin || row + std::uint64_t(x) >= pixels.end) continue;
        if (tile == nullptr || x >= tile->pixels.x_end) tile = &shapes.TileAt(x, y);
        if (tile->empty()) {
          x = tile->pixels.x_end - 1;
          continue;
        }
        const std::span<const ShapeFragment> fragments = tile->At(x, y);
        if (fragments.empty()) continue;
        use(fragments, std::size_t(y - image.bounds.y_begin) * std::size_t(image.bounds.width()) + std::size_t(x - image.bounds.x_begin), x,
            y);
      }
    }
  });
}

}  // namespace

LocalImage ComposeShapes(const LocalImage& frame, PixelRange pixels, const FrameSetup& setup, const FrameShapes& shapes) {
  const PixelBounds bounds = FrameBounds(setup);
  LocalImage image = Grown(frame, Intersection(shapes.bounds(), RowsOf(pixels, bounds)));
  const FragmentOrder order(setup);
  ForEachPixel(image, pixels, bounds.width(), shapes,
               [&](std::span<const ShapeFragment> fragments, std::size_t pixel, std::int32_t x, std::int32_t y) {
                 float* const at = &image.rgba[4 * pixel];
                 const Color volume = {at[0], at[1], at[2], at[3]};
                 Color result{};
                 bool has_volume = false;
                 const auto add_volume = [&] {
                   if (!std::exchange(has_volume, true)) Over(result, volume);
                 };
                 for (const ShapeFragment& fragment : fragments) {
                   const bool opaque = fragment.rgba[3] == 1;
                   if (image.format == PixelFormat::kDepth) {
                     if (fragment.depth >= image.depth[pixel]) add_volume();
                     if (!has_volume && opaque) image.depth[pixel] = fragment.depth;
                   } else {
                     const FragmentOrder::Side side = order.Of(x, y, fragment.depth).side;
                     if (opaque || side == FragmentOrder::Side::kBehind) add_volume();
                     if (!opaque && side == FragmentOrder::Side::kInside) continue;
                   }
                   Over(result, fragment.rgba);
                 }
                 add_volume();
                 std::ranges::copy(result, at);
               });
  return image;
}

LocalImage PictureOverShapes(const LocalImage& picture, const FrameSetup& setup, const FrameShapes& shapes) {
  LocalImage alone = MakeLocalImage(PixelFormat::kRgba, shapes.bounds());
  ForEachPixel(alone, WholeFrame(setup), FrameBounds(setup).width(), shapes,
               [&](std::span<const ShapeFragment> fragments, std::size_t pixel, std::int32_t, std::int32_t) {
                 Color result{};
                 for (const ShapeFragment& fragment : fragments) Over(result, fragment.rgba);
                 std::ranges::copy(result, &alone.rgba[4 * pixel]);
               });
  LocalImage image = Grown(picture, {});
  Combine(image, Resolve(alone, setup.camera.supersample), Side::kBack);
  FillRows(image);
  return image;
}

}  // namespace slabstream
