// The JSON of an OME-Zarr image that a volume is written as. Pure.
//
// What the specification has no place for stands under "slabstream" among the attributes of the image:
//
//   "slabstream": {"orientation": {"world": "patient", "origin": [x, y, z], "axes": [[...], [...], [...]]},
//                  "values": {"scale": s, "offset": o}}
//
// A point p (x, y, z) of the image's coordinate system, in which the centre of a voxel lies at scale * index + translation, is at
// origin + p.x axes[0] + p.y axes[1] + p.z axes[2] in the world. A data value is s * element + o.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/volume/volume.h"
#include "data/volume_io/sample_type.h"
#include "data/zarr_writer/level_plan.h"

namespace slabstream {

enum class OmeZarrVersion { k04, k05 };             // Zarr v2; Zarr v3 with shards
std::string_view ToString(OmeZarrVersion version);  // "0.4"

// What an image is written with.
struct ZarrLayout {
  OmeZarrVersion version = OmeZarrVersion::k05;
  SampleType type = SampleType::kUint8;
  std::int32_t chunk_side = 64;    // elements
  Index3 shard = {256, 256, 256};  // elements: multiples of chunk_side; of version 0.5
  int codec_level = 3;             // zstd's level
};

// Side of a shard of a level along an axis: no longer than the chunks that hold all of it.
Index3 ShardOf(const ZarrLayout& layout, const WrittenLevel& level);

struct MetadataFile {
  std::string key;  // "0/zarr.json"
  std::string text;
};

// Files in the order in which they are to be written: the last one makes an image of the folder. `mapping`: from elements to data values.
std::vector<MetadataFile> OmeMetadata(const ZarrLayout& layout, const std::vector<WrittenLevel>& levels, const std::string& name,
                                      const Orientation& orientation, const ValueMapping& mapping, bool labels);

}  // namespace slabstream
