// FrameShapes: what the shapes of a frame show in each of its pixels. All renderers and whoever finishes the picture read it. It depends on
// the request and the shapes alone, so it is the same for every box, worker and thread.
//
// A pixel has fragments, nearest first. An opaque fragment ends its ray. Each pixel has four samples on a rotated grid, or one in its
// centre where the camera supersamples. A fragment takes from each sample's light what its surfaces take there; its alpha is the part that
// it takes of the light that those before it left. So fragments composited front to back give the mean of the samples, and the last one of
// a pixel that is covered entirely has exactly 1.
//
// Parts of one shape in neighbouring samples that are less than FrameMap::MergedAt apart are one surface. A surface is shaded once, where
// the pixel's centre sees it. Opaque surfaces of one pixel that are less than that apart are one fragment.
//
// A fragment's depth is that of its surface in the pixel's centre, or, where it is not seen there, the mean of its samples.
//
// A tube or ball (PlacedShape) that holds the eye is not seen.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "common/frame/frame_setup.h"
#include "common/frame/shape_grid.h"
#include "worker/light/frame_light.h"

namespace slabstream {

// Fragments of a pixel. The last one holds all surfaces from there on, at the mean of their depths: what lies among them in the volume is
// seen before or behind all of them. Their colours and opacities stay exact.
inline constexpr std::size_t kMostShapeFragments = 64;
// Parts of translucent shapes that one pixel sees, the nearest ones. A surface of triangles smaller than pixels has up to four in each.
inline constexpr std::size_t kMostShapeHits = 256;
inline constexpr float kRayGoesOn = std::numeric_limits<float>::infinity();

struct ShapeFragment {
  float depth = 0;              // see FrameShapes
  std::array<float, 4> rgba{};  // premultiplied; alpha in (0, 1]: the share of the light from behind that it takes
  friend bool operator==(const ShapeFragment&, const ShapeFragment&) = default;
};

struct ShapeTile {
  PixelBounds pixels;
  std::vector<std::uint32_t> begin = {};      // of each pixel, row by row, and one more: numbers of its fragments; empty: there are none
  std::vector<ShapeFragment> fragments = {};  // nearest first; only the last one of a pixel may be opaque
  std::vector<float> ends = {};               // by pixel: the depth of its opaque fragment, or kRayGoesOn; empty as `begin`
  bool colors = true;                         // false: opaque fragments have none (0, 0, 0, 1)

  bool empty() const { return begin.empty(); }
  std::size_t Number(std::int32_t x, std::int32_t y) const {
    return std::size_t(y - pixels.y_begin) * std::size_t(pixels.width()) + std::size_t(x - pixels.x_begin);
  }
  std::span<const ShapeFragment> At(std::int32_t x, std::int32_t y) const {
    if (empty()) return {};
    const std::size_t n = Number(x, y);
    return std::span(fragments).subspan(begin[n], begin[n + 1] - begin[n]);
  }
};

class FrameShapes {
 public:
  virtual ~FrameShapes() = default;
  // Pixels are those of FrameBounds(setup). Depths are those of the setup's camera; in a frame along slices they are slices, counted so
  // that they grow away from the eye: k if the traversal ascends, else -k.
  // The tile that holds a pixel of the frame. The first call draws it. Any thread, within its task arena.
  virtual const ShapeTile& TileAt(std::int32_t x, std::int32_t y) const = 0;
  // The same for a box. An opaque fragment ends the box's rays whatever its colour is, so `colors` may be false.
  virtual const ShapeTile& TileForBoxes(std::int32_t x, std::int32_t y) const = 0;
  virtual PixelBounds bounds() const = 0;  // all fragments lie there; empty: there are none
  virtual bool translucent() const = 0;    // false: fragments that are not opaque are parts of edges alone
  virtual std::size_t bytes() const = 0;   // memory, of tiles too
};

// For boxes: the tile that holds all of `pixels`, which lie in one; null: there are no shapes.
inline const ShapeTile* TileOf(const FrameShapes* shapes, const PixelBounds& pixels) {
  return shapes == nullptr ? nullptr : &shapes->TileForBoxes(pixels.x_begin, pixels.y_begin);
}

class DrawnTiles;

// `bytes`: of each of setup.shapes, as PackShape made them; they stay as long as the result. DataLoss: they are not. `light`: shadows and
// ambient occlusion on the shapes; null: there are none. `drawn`: its tiles are taken rather than drawn; null: there are none.
Result<std::shared_ptr<const FrameShapes>> MakeFrameShapes(const FrameSetup& setup,
                                                           std::span<const std::shared_ptr<const VoxelBlock>> bytes,
                                                           std::shared_ptr<const FrameLight> light,
                                                           std::shared_ptr<DrawnTiles> drawn = nullptr);

}  // namespace slabstream
