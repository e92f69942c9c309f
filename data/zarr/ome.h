// What the attributes of an OME-Zarr image say (https://ngff.openmicroscopy.org, 0.4 and 0.5; images of 0.1 to 0.3 are read, too): which
// arrays are its levels, what their axes are, and where the voxels lie.
//
// Pure. Every number is checked.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/volume/orientation.h"
#include "common/volume/summary.h"
#include "data/metadata/json_fields.h"
#include "data/sources/axis_choice.h"

namespace slabstream::zarr {

struct OmeAxis {
  std::string name;  // "z"
  AxisKind kind = AxisKind::kOther;
  std::optional<LengthUnit> unit = {};  // of x, y and z
};

struct OmeLevel {
  std::string path;  // of its array, from the group
  // Of each axis: position = scale * index + translation. Scales along x, y and z are above 0.
  std::vector<double> scale, translation;
};

struct OmeChannel {
  std::string name;                       // "": it has none
  std::optional<ValueRange> window = {};  // of data values, that its author shows
};

struct OmeImage {
  std::string version;                      // "0.4"
  std::vector<OmeAxis> axes;                // slowest first
  std::vector<OmeLevel> levels;             // finest first, at least one
  bool scaled = false, translated = false;  // a level states its scale, its translation
  std::vector<OmeChannel> channels;         // those that are described, perhaps none
  bool labels = false;
};

// `attributes`: of a group of that version of Zarr. Whether it is an image.
bool IsOmeImage(const metadata::Field& attributes, int zarr_version);

// InvalidArgument, naming the field: it is missing, wrong, or something that is not supported.
Result<OmeImage> ParseOmeImage(const metadata::Field& attributes, int zarr_version);

}  // namespace slabstream::zarr
