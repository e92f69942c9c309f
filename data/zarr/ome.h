// What the attributes of an OME-Zarr image say (https://ngff.openmicroscopy.org, 0.4 to 0.6; images of 0.1 to 0.3 are read, too): which
// arrays are its levels, what their axes are, and where the voxels lie.
//
// Pure. Every number is checked.
#pragma once

#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/volume/field_info.h"
#include "data/metadata/json_fields.h"
#include "data/volume_io/stated_label.h"
#include "data/zarr/ome_axes.h"

namespace slabstream::zarr {

struct OmeLevel {
  std::string path;  // the path of its array, from the group
  OmePlace place;
};

struct OmeImage {
  std::string version;                      // "0.4"
  std::vector<OmeAxis> axes;                // slowest first
  std::vector<OmeLevel> levels;             // finest first, at least one
  bool scaled = false, translated = false;  // a level states it
  std::vector<FieldInfo> channels;          // those that are described, perhaps none; windows are of samples
  bool labels = false;
  std::vector<StatedLabel> looks = {};  // values ascend
  std::vector<std::string> notes = {};  // SourceInfo::notes
};

// What OME says in the attributes of a group: their member "ome", as from Zarr 3 on, or the attributes themselves, as some write there,
// too.
metadata::Field OmeField(const metadata::Field& attributes);

// `attributes`: of a group. Whether it is an image.
bool IsOmeImage(const metadata::Field& attributes);

// InvalidArgument, naming the field: it is missing, wrong, or something that is not supported.
Result<OmeImage> ParseOmeImage(const metadata::Field& attributes);

}  // namespace slabstream::zarr
