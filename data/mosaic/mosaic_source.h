// A volume whose voxels lie in several sources, such as the pieces that the processes of a simulation wrote: a box is read from those that
// have some of it. Sources are opened when they are first needed, so a worker opens those of its own boxes.
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
  Box box;           // where its voxels lie in the volume. Its source has these and no others, in this order
  std::function<Result<std::shared_ptr<VolumeSource>>()> open;  // waits; called again if the source was closed meanwhile
};

inline constexpr std::size_t kMaxMosaicParts = 1 << 14;

// `info`: of the volume, with one level. What the sources say of their samples (type, mapping, exact) is the same. Opens the first part, of
// which info.whole and the level's block become those of the volume. Parts may overlap where they have the same samples, as pieces do that
// meet at their points. InvalidArgument, naming `name`: no part or more than kMaxMosaicParts, or voxels that lie in none. Of the first
// part, or of a read: errors of MosaicPart::open; InvalidArgument: its source has another size or samples.
Result<std::shared_ptr<VolumeSource>> MakeMosaic(const std::string& name, SourceInfo info, std::vector<MosaicPart> parts);

}  // namespace slabstream
