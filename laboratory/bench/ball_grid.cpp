#include "laboratory/bench/ball_grid.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <memory>
#include <random>

#include "common/mesh/lattice.h"

namespace slabstream {
namespace {

constexpr int kHexahedron = 12;  // VTK's number
constexpr double kMoved = 0.1, kRadius = 0.45, kMost = 255;

Status Validate(const GridRequest& request) {
  if (request.size < 8 || request.size > kMaxLatticeSide) {
    return Status::InvalidArgument(fmt::format("size of a grid is {}, must be in [8, {}]", request.size, kMaxLatticeSide));
  }
  if (request.cells < 2 || request.cells > 256) {
    return Status::InvalidArgument(fmt::format("cells of a grid is {}, must be in [2, 256]", request.cells));
  }
  return Status::Ok();
}

Mesh MakeMesh(const GridRequest& request) {
  const int points = request.cells + 1;
  const double side = double(request.size) / request.cells, middle = (request.size - 1) / 2.0;
  std::mt19937_64 bits(1);
  const auto moved = [&] { return side * kMoved * (double(bits() >> 11) * 0x1p-52 - 1); };
  Mesh mesh;
  for (int z = 0; z < points; ++z) {
    for (int y = 0; y < points; ++y) {
      for (int x = 0; x < points; ++x) {
        Vec3 at;
        for (const auto& [component, i] : {std::pair{&at.x, x}, {&at.y, y}, {&at.z, z}}) {
          *component = i * side - 0.5 + (i > 0 && i < request.cells ? moved() : 0);
        }
        mesh.points.push_back({float(at.x), float(at.y), float(at.z)});
        const double distance = Length(at - Vec3{middle, middle, middle});
        mesh.values.push_back(float(kMost * std::max(0.0, 1 - distance / (kRadius * request.size))));
        if (x == 0 || y == 0 || z == 0) continue;
        const auto number = [&](int dx, int dy, int dz) { return PointNumber(((z - dz) * points + y - dy) * points + x - dx); };
        const std::array<PointNumber, 8> corners = {number(1, 1, 1), number(0, 1, 1), number(0, 0, 1), number(1, 0, 1),
                                                    number(1, 1, 0), number(0, 1, 0), number(0, 0, 0), number(1, 0, 0)};
        SplitCell(*FindCellKind(kHexahedron), corners, mesh.tetrahedra);
      }
    }
  }
  return mesh;
}

}  // namespace

Result<Volume> MakeBallGrid(const GridRequest& request) {
  if (Status status = Validate(request); !status.ok()) return status;
  const auto mesh = std::make_shared<const Mesh>(MakeMesh(request));
  Volume volume = Resample(*mesh, {.size = {request.size, request.size, request.size}});
  volume.cells = mesh;
  return volume;
}

}  // namespace slabstream
