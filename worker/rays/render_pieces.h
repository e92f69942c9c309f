// RenderPieces: the image of a box, from the pieces that kernels can address (RayPiece).
#pragma once

#include <span>
#include <utility>

#include "common/frame/frame_setup.h"
#include "common/kernels/combine.h"
#include "worker/rays/ray_volume.h"
#include "worker/rays/render_tiles.h"

namespace slabstream {

// What is rendered (Renderer::Render), and its rays.
struct RayFrame {
  const LevelBox& at;
  const FrameSetup& setup;
  const ViewRays& rays;
  const OcclusionMask& hidden;
  const RenderControl& control;
  RankReport& report;
  const StretchTables* stretch = nullptr;  // of a rectilinear grid
};

// Renders the box's part in each piece and combines their images. region_of(number of the piece): the positions among the voxels whose
// samples may matter.
// render(number, ray box, tile, its steps, pixels, floats a row) renders a tile, as RenderTiles says.
template <class RegionOf, class Render>
LocalImage RenderPieces(std::span<const RayPiece> pieces, const RayFrame& frame, RegionOf&& region_of, Render&& render) {
  const FrameSetup& setup = frame.setup;
  const GridMap map = MapTo(setup, frame.at.level);
  const Stretch& stretch = setup.description.geometry.stretch;
  LocalImage image = MakeLocalImage(setup.format, {});
  for (const std::size_t number : NearestFirst(pieces, setup.camera, map, stretch)) {
    const RayPiece& piece = pieces[number];
    const SampledRegion part = InDataSpace(PartIn(piece, pieces, frame.at.box, map), stretch);
    if (!(part.low.z < part.high.z)) continue;
    RayBox box = MakeRayBox(piece.voxels, piece.cells.counts, part, InDataSpace(region_of(number), stretch), frame.rays, setup.camera, map);
    box.stretch = frame.stretch;
    LocalImage layer = MakeLocalImage(setup.format, box.reach.pixels);
    RenderTiles(layer, frame.hidden, frame.control, frame.report,
                [&](const PixelBounds& tile, std::uint8_t steps, float* pixels, std::size_t floats_a_row) {
                  render(number, box, tile, steps, pixels, floats_a_row);
                });
    if (image.bounds.empty()) {
      image = std::move(layer);
    } else {
      Combine(image, layer, Side::kBack);
    }
  }
  return image;
}

}  // namespace slabstream
