// Which axes of an array are x, y and z, and which index of the others is shown.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "data/volume_io/read_options.h"
#include "data/zarr/ome.h"

namespace slabstream::zarr {

struct AxisChoice {
  std::array<int, 3> axes = {-1, -1, -1};  // x, y and z; -1: there is none
  std::vector<std::uint64_t> at;           // index along each axis; 0 along x, y and z
  int times = 1, channels = 1;             // how many there are
  std::size_t channel = 0;
};

// The kinds of the axes of a plain array, by their names ("" where there is none) and, where these do not say it, by their order.
// InvalidArgument: there are fewer than two.
Result<std::vector<AxisKind>> KindsOfPlainAxes(const std::string& array, const std::vector<std::string>& names, const ReadOptions& options);

// `sizes`: of each axis. `any_channel`: without options.channel the first one is shown. InvalidArgument, naming `array`: an option is
// missing, or takes what there is not; an axis that is none of the known ones has several indices.
Result<AxisChoice> ChooseAxes(const std::string& array, const std::vector<AxisKind>& kinds, const std::vector<std::uint64_t>& sizes,
                              const ReadOptions& options, bool any_channel);

}  // namespace slabstream::zarr
