// What attributes of N5 say of the axes of a dataset and of where its voxels lie, in the dialects of those who write them: COSEM's
// `transform`, Fiji's `pixelWidth`, and the `pixelResolution`, `resolution` and `offset` of BigDataViewer and Paintera. Sources:
// https://github.com/saalfeldlab/n5-universe, https://github.com/janelia-cellmap/schemas
//
// Pure.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/math/vec.h"
#include "common/volume/field_info.h"
#include "common/volume/orientation.h"
#include "data/metadata/json_fields.h"

namespace slabstream::n5 {

// Names of the axes of a dataset of this size, slowest first ("" where there is none): by its own attributes, else by those of its group.
// InvalidArgument: the channels and times that Fiji states are not those of the size.
Result<std::vector<std::string>> AxisNames(const metadata::Field& own, const metadata::Field& group,
                                           const std::vector<std::uint64_t>& size);

// The times of a dataset that has `count`: by its own attributes, else by those of its group.
TimeAxis TimesOf(const metadata::Field& own, const metadata::Field& group, int count);

struct Place {
  Vec3 spacing = {1, 1, 1};         // each > 0, finite
  std::optional<Vec3> origin = {};  // the first voxel's centre, if the attributes state it
  std::optional<LengthUnit> unit = {};
  bool of_level = false;       // it is that of this level, not of the finest one
  std::string attribute = {};  // the attribute that says so
};

// None: they say nothing of it. InvalidArgument: a transform that is wrong, or whose axes have different units; names the field.
Result<std::optional<Place>> PlaceOf(const metadata::Field& attributes);

}  // namespace slabstream::n5
