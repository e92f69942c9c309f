// Adaptive meshes whose boxes of cells are sources: levels of such boxes become the levels of a mosaic.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "data/mosaic/mosaic_source.h"

namespace slabstream {

struct MeshLevel {
  Vec3 spacing;  // of its cells, in the world; > 0, finite
  // Their boxes count cells from the mesh's origin on, and may begin below 0. Numbers fit a quarter of their type.
  std::vector<MosaicPart> parts;
};

// `levels`: coarsest first, at least one. `origin`: where cell 0 of each level begins. `info`: as of MakeMosaic, without levels. The volume
// is the box around those of the coarsest level. InvalidArgument, naming `name`: spacings that are no whole parts of the coarsest one, a
// box beyond that volume, a level of too many cells; errors of MakeMosaic.
Result<std::shared_ptr<VolumeSource>> MakeAdaptiveMesh(const std::string& name, SourceInfo info, const Vec3& origin,
                                                       std::vector<MeshLevel> levels);

}  // namespace slabstream
