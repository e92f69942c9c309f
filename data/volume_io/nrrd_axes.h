// Which axes of a NRRD are those of space, and what the others hold. Samples of an axis in front of those of space lie together in a voxel:
// its components. An axis behind them counts volumes: times, or channels.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/math/vec.h"
#include "data/volume_io/text_header.h"

namespace slabstream {

struct NrrdAxes {
  std::size_t first = 0;                          // the first of the three axes of space
  double components = 1;                          // samples of the axes in front of them
  std::vector<double> sizes;                      // sizes of these three, and of the axes of time behind them
  double channels = 1;                            // samples of an axis behind them that is none of time
  std::optional<std::array<Vec3, 3>> directions;  // directions of these three, as in `space directions`
  std::size_t space_numbers = 3;                  // numbers of a position: 3, or with time 4
  std::optional<std::size_t> time;                // the axis of time, if it is the only one
  std::optional<double> time_step;                // its step in the space, of four numbers
  std::vector<std::string> notes;                 // what was guessed
};

// By `space directions`, where an axis that is none of space has none; else by `kinds`; else the first axis has components if it is one of
// four and as short as a colour. InvalidArgument, naming the file: a field is malformed, there are not three axes of space, or another one
// lies between them.
Result<NrrdAxes> ReadNrrdAxes(const TextHeader& text);

}  // namespace slabstream
