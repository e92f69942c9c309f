// Axes and coordinate transformations of OME-Zarr: where the voxels of a level lie.
//
// Pure. Every number is checked.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/volume/orientation.h"
#include "data/metadata/json_fields.h"
#include "data/sources/axis_kind.h"

namespace slabstream::zarr {

struct OmeAxis {
  std::string name;  // "z"
  AxisKind kind = AxisKind::kOther;
  std::optional<LengthUnit> unit = {};  // the unit of x, y and z
  std::string time_unit = {};           // the unit of time, as the file spells it; "": it states none
};

// `list`: of 2 to kMaxArrayAxes axes; not stated: those of 0.1 and 0.2. Axes of type space whose names say nothing are z, y and x in this
// order. InvalidArgument: two of a kind, or neither x nor y.
Result<std::vector<OmeAxis>> ReadOmeAxes(const metadata::Field& list);

// Where an image lies on each axis: position = scale * index + translation. Scales along x, y and z are above 0, and
// both are finite there.
struct OmePlace {
  std::vector<double> scale, translation;
  bool scaled = false, translated = false;  // a transformation states it
};

// Applies transformations, one after the other, to what `place` has so far: scale, translation, identity, sequence, and affine, rotation
// and mapAxis as long as they neither turn nor exchange axes. InvalidArgument: anything else, and numbers that are wrong.
Status ApplyTransformations(const metadata::Field& list, const std::vector<OmeAxis>& axes, OmePlace& place);

}  // namespace slabstream::zarr
