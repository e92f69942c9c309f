// ShapeScene: the shapes of a frame as tiles draw them: where their vertices fall in the frame, and which pieces may be seen where.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/frame/frame_map.h"
#include "common/frame/placed_shape.h"
#include "worker/light/frame_light.h"
#include "worker/shapes/frame_shapes.h"

namespace slabstream {

struct SceneShape : PlacedShape {
  std::uint32_t first_piece = 0;  // its pieces have the numbers from here on
  Row4 x{}, y{}, w{}, depth{};    // as those of FrameMap, of positions of `view`

  bool Has(std::uint32_t piece) const { return piece >= first_piece && piece - first_piece < view.pieces.size(); }
};

inline constexpr std::uint32_t kMostPieces = (1U << 24) - 1;  // Element

struct ShapeScene {
  FrameMap map;
  Camera camera;
  Shading shading;
  std::vector<SceneShape> shapes;
  std::shared_ptr<const FrameLight> light;
  double light_way = 0;  // physical: surfaces get the light so far before them
  int samples = 4;       // of a pixel, 1 or 4
  bool translucent = false;

  const SceneShape& ShapeOf(std::uint32_t piece) const;
  // A piece of a line, or a point, in physical space.
  struct CapsuleHit {
    bool seen = false;
    double key = 0, s = 0;
    Vec3 normal;  // physical, not of unit length
  };
  // At a point of the frame.
  CapsuleHit HitOn(const Capsule& capsule, double column, double row) const;
};

// A piece in a tile, with the key (FrameMap) of the nearest point that it may have, and the pixels of the tile that it may be seen in.
struct PlacedPiece {
  std::uint32_t number = 0;
  float nearest = 0;
  std::uint8_t x_begin = 0, y_begin = 0, x_end = 0, y_end = 0;
  PixelBounds area() const { return {x_begin, y_begin, x_end, y_end}; }
};

// Draws what these pieces show in `pixels`. `opaque`: nearest first.
ShapeTile DrawShapeTile(const ShapeScene& scene, const PixelBounds& pixels, std::span<const PlacedPiece> opaque,
                        std::span<const PlacedPiece> translucent);

}  // namespace slabstream
