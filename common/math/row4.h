// Row4: one row of a matrix in homogeneous coordinates.
#pragma once

#include <array>

#include "common/math/vec.h"

namespace slabstream {

using Row4 = std::array<double, 4>;

// The dot product of `row` and (p, 1).
inline double Apply(const Row4& row, const Vec3& p) { return row[0] * p.x + row[1] * p.y + row[2] * p.z + row[3]; }

}  // namespace slabstream
