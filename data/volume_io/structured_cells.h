// The cells of a curvilinear grid: hexahedra between points that have three numbers each, x first.
//
// One thread at a time.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "common/base/status.h"
#include "data/volume_io/mesh_builder.h"

namespace slabstream {

// Points of a grid along its three axes, at least one each.
using GridPoints = std::array<std::int64_t, 3>;

// No axis has one point alone.
bool HasVolume(const GridPoints& points);
std::string ToText(const GridPoints& points);  // "4 x 3 x 2 points"
// InvalidArgument, naming `where`: more points than a mesh may have.
Status CheckPointCount(const std::string& where, const GridPoints& points);

// Adds the cells of the piece that the builder has begun, which has a volume and these points. ResourceExhausted: too many.
Status AddStructuredCells(const GridPoints& points, MeshBuilder& builder);

}  // namespace slabstream
