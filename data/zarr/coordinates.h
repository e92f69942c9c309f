// Coordinates of an array's axes, as xarray keeps them: beside the array, each in an array of one axis that is called like it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "data/zarr/zarr_array.h"

namespace slabstream::zarr {

struct AxisCoordinates {
  std::vector<double> values;  // one for each index along the axis
  std::string unit;            // "m"; "": none is stated
};

// Those in the array `name` of a group that has one axis of `size` elements. nullopt: there is no such array, or it holds no numbers.
// Errors of reading its chunks. Waits.
Result<std::optional<AxisCoordinates>> ReadCoordinates(const ArrayContext& context, const std::string& group, const std::string& name,
                                                       std::uint64_t size);

}  // namespace slabstream::zarr
