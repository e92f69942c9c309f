// LeastExtinction: the least extinction of any group of bricks of a volume under a transfer function, from the value ranges of the
// summary's bricks. Tiles of a frame march this coarse grid, so a frame knows how opaque the volume is at least in front of each place
// (OpaqueFront) before anything is drawn, without a message.
//
// Conservative: a sample interpolates voxels near it, so its value lies in the range of all bricks that these lie in.
#pragma once

#include <cstdint>
#include <vector>

#include "common/frame/opaque_front.h"
#include "common/planning/classified_volume.h"
#include "common/volume/summary.h"

namespace slabstream {

struct LeastExtinction {
  // The classification's bins that values of a brick may have.
  struct Bins {
    std::uint16_t low = 0, high = 0;
    friend bool operator==(const Bins&, const Bins&) = default;
  };
  Index3 counts;             // bricks along each axis
  std::vector<Bins> bricks;  // x fastest; empty: nothing is known
  // [n][bin]: the least extinction, of a voxel length, of 2^n bins from this one on.
  std::vector<std::vector<float>> least;

  float Of(const Bins& bins) const;
  friend bool operator==(const LeastExtinction&, const LeastExtinction&) = default;
};

// Empty as well if the opacity of a place depends on more than the values there (RendererKind::opacity_by_value), if the volume is clipped,
// has layers that show or voxels without a value, or is read in parts.
LeastExtinction FindLeastExtinction(const VolumeSummary& summary, const ClassifiedVolume& volume);

// The front of a frame of this volume, which uses masks. Empty: nothing is known.
OpaqueFront FindOpaqueFront(const LeastExtinction& extinction, const FrameSetup& setup);

}  // namespace slabstream
