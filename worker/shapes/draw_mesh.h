// Triangles that are not large, a whole piece of a mesh at a time. Samples are covered as draw_tile.cpp defines it, in whole numbers.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "worker/shapes/shape_scene.h"
#include "worker/shapes/tile_samples.h"

namespace slabstream {

inline constexpr double kMostPixel = 1 << 21;  // of the frame: vertices farther away are not rounded

// Parts of a piece.
struct PartList {
  std::uint32_t count = 0;
  std::array<std::uint8_t, kMostOfPiece> part{};
};

// Draws the triangles of a piece whose vertices all lie before the eye and within kMostPixel, and that are at most a tile high and wide;
// `large` becomes the others. `hits`: null: they are opaque, otherwise what they show is added there.
void DrawMeshPiece(const ShapeScene& scene, const SceneShape& shape, std::uint32_t piece, TileSamples& samples, std::vector<ShapeHit>* hits,
                   PartList& large);

}  // namespace slabstream
