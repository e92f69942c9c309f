// A volume whose voxels lie in several sources: the pieces that the processes of a simulation wrote, or the patches of an adaptive mesh.
// A box is read from those that have some of it. Sources are opened when they are first needed, so a worker opens those of its own boxes.
//
// A level but the coarsest may have voxels that lie in no part, as those of an adaptive mesh do. They are interpolated between the voxels
// of the next coarser level, linearly along each axis, so a field that is linear stays linear.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "data/sources/volume_source.h"

namespace slabstream {

struct MosaicPart {
  std::string name;  // for messages, such as its file
  Box box;           // where its voxels lie in the level. Its source has these and no others, in this order
  std::function<Result<std::shared_ptr<VolumeSource>>()> open;  // waits; called again if the source was closed meanwhile
};

inline constexpr std::size_t kMaxMosaicParts = 1 << 17;  // of a level

// `info`: of the volume; `levels`: the parts of each of its levels. What the sources say of their samples (type, mapping, exact) is the
// same; with several levels, samples are float32 or float64. Opens the first part, of which info.whole and the levels' blocks become those
// of the volume, and says where levels are refined. Parts of a level may overlap where they have the same samples, as pieces do that meet
// at their points. InvalidArgument, naming `name`: no part or more than kMaxMosaicParts, or voxels of the coarsest level that lie in none.
// Of the first part, or of a read: errors of MosaicPart::open; InvalidArgument: its source has another size or samples.
Result<std::shared_ptr<VolumeSource>> MakeMosaic(const std::string& name, SourceInfo info, std::vector<std::vector<MosaicPart>> levels);

}  // namespace slabstream
