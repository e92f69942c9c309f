// Plotfiles of AMReX for tests, as it writes them.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "common/volume/box.h"
#include "data/volume_io/sample_type.h"

namespace slabstream {

struct AmrexSpec {
  Index3 first, size;  // the domain at the coarsest level: its first cell, and how many there are
  Vec3 corner = {0, 0, 0};
  double spacing = 1;  // of the coarsest cells
  struct Level {
    int factor = 1;          // cells along one of the coarsest level
    std::vector<Box> boxes;  // counted from the domain's first cell at this level
  };
  std::vector<Level> levels;  // coarsest first
  SampleType type = SampleType::kFloat64;
  bool big_endian = false;
  int ghosts = 0;
  bool apart = false;  // each box lies in a file of its own, the last one in the first file
};

// The value of a cell by the place of its centre in the world.
using AmrexField = std::function<double(const Vec3& place)>;

// The variable "v" is that of `field`, "w" its negative.
void WritePlotfile(const std::string& folder, const AmrexSpec& spec, const AmrexField& field);

}  // namespace slabstream
