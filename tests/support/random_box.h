// RandomBox: any box of at least one voxel inside another one.
#pragma once

#include "common/volume/box.h"
#include "tests/support/random.h"

namespace slabstream {

inline Box RandomBox(Random& random, const Box& inside) {
  Box box;
  for (const Axis axis : kAxes) {
    box.begin[axis] = random.Integer(inside.begin[axis], inside.end[axis] - 1);
    box.end[axis] = random.Integer(box.begin[axis] + 1, inside.end[axis]);
  }
  return box;
}

}  // namespace slabstream
