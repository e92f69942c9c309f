// LocatedVolume: what a volume file's header says, where the samples lie, and how they are turned: all but the samples.
#pragma once

#include <string>

#include "common/base/status.h"
#include "data/sources/volume_source.h"
#include "data/volume_io/raw_volume.h"
#include "data/volume_io/world_placement.h"

namespace slabstream {

enum class Packing { kNone, kCompressed };

struct LocatedVolume {
  RawHeader header;
  Payload payload;  // the payload of this volume alone
  AxisTurn turn;
  int component = 0;  // the component of a voxel that is read
  SourceInfo info;    // one level; samples as KeptTypeOf says
};

// Errors of SourceFormat::open. InvalidArgument, too: samples that are packed otherwise, or uncompressed in several files; axes
// that are not at right angles; the luminance of several components.
Result<LocatedVolume> LocateVolume(const std::string& path, const ReadOptions& options, Packing packing);

// Whether LocateVolume takes this file, with the options that it needs.
bool HasLocatedSamples(const std::string& path, const ReadOptions& options, Packing packing);

}  // namespace slabstream
