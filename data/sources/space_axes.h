// Arrays whose axes have no names: the last three are z, y and x, and one before them may be time.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "data/volume_io/read_options.h"

namespace slabstream {

struct SpaceAxes {
  std::array<int, 3> axes = {-1, -1, -1};  // x, y and z; -1: there is none
  std::vector<std::uint64_t> at;           // index along each axis; 0 along x, y and z
  int times = 1;
};

// InvalidArgument, beginning with `named`: fewer than two axes; more than one before the last three is longer than 1; no such time or
// channel.
Result<SpaceAxes> LastAxesAreSpace(const std::string& named, const std::vector<std::uint64_t>& size, const ReadOptions& options);

}  // namespace slabstream
