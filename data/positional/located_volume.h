// LocatedVolume: what a volume file's header says, where the samples lie, and how they are turned: all but the samples.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "data/sources/volume_source.h"
#include "data/volume_io/formats.h"
#include "data/volume_io/raw_volume.h"
#include "data/volume_io/world_placement.h"

namespace slabstream {

struct LocatedVolume {
  RawHeader header;
  Payload payload;                              // the payload of this volume alone
  std::shared_ptr<const PackedSamples> packed;  // null: the payload is all
  AxisTurn turn;
  int component = 0;  // the component of a voxel that is read
  SourceInfo info;    // one level; samples as KeptTypeOf says
};

// The description of a file of which the header and its place in the world are known. `beside`: what is read besides `path`. `block`: of
// SourceLevel, by the axes of the file.
SourceInfo InfoOfFile(const std::string& format, const std::string& path, const RawHeader& header, const WorldPlacement& placed,
                      const std::vector<std::filesystem::path>& beside, const Index3& block, const ReadOptions& options);

}  // namespace slabstream
