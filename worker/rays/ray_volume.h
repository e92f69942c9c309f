// RayVolume: the voxels of a padded box as ray kernels read them. Image-order renderers share it, and it stays with the padded box between
// frames.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "common/base/status.h"
#include "common/view/camera.h"
#include "worker/rays/ray_box.h"
#include "worker/renderers/box_data.h"

namespace slabstream {

// Kernels can address only so many bytes. A larger padded box is cut into pieces along z, which are rendered like boxes of a partition.
struct RayPiece {
  PaddedVoxels voxels;
  MacrocellRanges cells;
};

class RayVolume : public BoxCache {
 public:
  // Made by the first call. Parallel.
  const std::vector<RayPiece>& PiecesOf(const BoxData& data);

  std::size_t bytes() const override;

 private:
  std::vector<RayPiece> pieces_;  // lowest z first
};

// The voxels that field i of FrameSetup::fields has beside one box were cut into pieces.
Status TooLargeForRays(std::size_t field);

// Cuts `box` into layers along z. The padded samples of each take at most `most_bytes`, but each has at least one slice.
std::vector<Box> CutIntoLayers(const Box& box, ScalarType type, std::size_t most_bytes);

// Indices of the pieces in visibility order, nearest first. `map`: from the camera's grid to that of the voxels. `stretch`: theirs.
std::vector<std::size_t> NearestFirst(std::span<const RayPiece> pieces, const Camera& camera, const GridMap& map = {},
                                      const Stretch& stretch = {});

// What a piece has of a box: positions of the frame, or voxel coordinates of a rectilinear grid. Two pieces that touch share one plane, bit
// for bit.
SampledRegion PartIn(const RayPiece& piece, std::span<const RayPiece> pieces, const Box& box, const GridMap& map);

}  // namespace slabstream
