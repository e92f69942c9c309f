// Which axes of an array are x, y and z, and which index of the others is shown.
//
// Pure.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "data/sources/axis_kind.h"
#include "data/sources/volume_source.h"
#include "data/volume_io/read_options.h"

namespace slabstream {

struct ChosenAxes {
  std::array<int, 3> axes = {-1, -1, -1};  // x, y and z; -1: there is none
  std::vector<std::uint64_t> at;           // index along each axis; 0 along x, y and z
  int time_axis = -1, channel_axis = -1;   // the same of time and channel
  std::vector<FieldInfo> channels = {};    // at least one
  int times = 1, time = 0, channel = 0;

  // Its times and channels.
  void Describe(SourceInfo& info) const;
};

// The kinds of the axes of a plain array, by their names ("" where there is none) and, where these do not say it, by their order.
// InvalidArgument: there are fewer than two.
Result<std::vector<AxisKind>> KindsOfPlainAxes(const std::string& array, const std::vector<std::string>& names, const ReadOptions& options);

// `sizes`: of each axis. `channels`: what is said of the first ones. InvalidArgument, naming `array`: no time is taken although there are
// several; an option takes what there is not; an axis that is none of the known ones has several indices; too many channels.
Result<ChosenAxes> ChooseAxes(const std::string& array, const std::vector<AxisKind>& kinds, const std::vector<std::uint64_t>& sizes,
                              const ReadOptions& options, std::vector<FieldInfo> channels = {});

}  // namespace slabstream
