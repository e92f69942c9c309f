#include "worker/renderers/zbuffer/vertex_normals.h"

#include <algorithm>
#include <cmath>

namespace slabstream {
namespace {

std::int32_t Inside(const Box& box, int axis, std::int32_t at) { return std::clamp(at, box.begin[axis], box.end[axis] - 1); }

}  // namespace

VertexNormals::Filters VertexNormals::FiltersAlong(int axis, const Box& box, double spacing, std::int32_t origin) {
  Filters filters;
  for (std::int32_t vertex = 0; vertex < kVertices; ++vertex) {
    const std::int32_t lower = origin + vertex - 1;
    std::array<double, 4> smooth{}, slope{};
    const auto tap = [&](std::int32_t at) { return std::size_t(std::clamp(at - lower + 1, 0, 3)); };
    for (std::int32_t neighbour : {lower, lower + 1}) {
      const std::int32_t at = Inside(box, axis, neighbour), below = Inside(box, axis, at - 1), above = Inside(box, axis, at + 1);
      smooth[tap(below)] += 0.125;
      smooth[tap(at)] += 0.25;
      smooth[tap(above)] += 0.125;
      if (above == below) continue;  // the volume is one voxel thick
      const double per_distance = 0.5 / ((above - below) * spacing);
      slope[tap(below)] -= per_distance;
      slope[tap(above)] += per_distance;
    }
    const auto v = std::size_t(vertex);
    for (std::size_t i = 0; i < 4; ++i) filters.smooth[i][v] = float(smooth[i]);
    // As differences, which are exactly 0 if samples are equal.
    filters.slope[0][v] = float(-slope[0]);
    filters.slope[1][v] = float(-(slope[0] + slope[1]));
    filters.slope[2][v] = float(slope[3]);
  }
  return filters;
}

void VertexNormals::Compute(const VoxelBlock& voxels, const Vec3& spacing, const Index3& origin) {
  const Box& box = voxels.box;
  const Filters along_x = FiltersAlong(0, box, spacing.x, origin.x), along_y = FiltersAlong(1, box, spacing.y, origin.y);
  along_z_ = FiltersAlong(2, box, spacing.z, origin.z);
  VisitScalarType(voxels.type, [&]<class T>(const T*) {
    const T* all = voxels.samples<T>();
    for (std::int32_t z = 0; z < kSamples; ++z) {
      for (std::int32_t y = 0; y < kSamples; ++y) {
        const T* samples = all + voxels.Offset({box.begin.x, Inside(box, 1, origin.y + y - 2), Inside(box, 2, origin.z + z - 2)});
        std::array<float, kSamples + 4> row{};
        for (std::int32_t x = 0; x < kSamples; ++x) row[std::size_t(x)] = float(samples[Inside(box, 0, origin.x + x - 2) - box.begin.x]);
        Row& smooth = smooth_x_[std::size_t(z)][std::size_t(y)];
        Row& slope = slope_x_[std::size_t(z)][std::size_t(y)];
        for (std::size_t x = 0; x < kSamples; ++x) {  // samples from kVertices on have no weights
          const float a = row[x], b = row[x + 1], c = row[x + 2], d = row[x + 3];
          smooth[x] = (a * along_x.smooth[0][x] + b * along_x.smooth[1][x]) + (c * along_x.smooth[2][x] + d * along_x.smooth[3][x]);
          slope[x] = ((b - a) * along_x.slope[0][x] + (c - b) * along_x.slope[1][x]) + (d - c) * along_x.slope[2][x];
        }
      }
    }
  });
  for (std::size_t z = 0; z < kSamples; ++z) {
    for (std::size_t y = 0; y < kVertices; ++y) {
      const Row* v = &smooth_x_[z][y];
      const Row* dx = &slope_x_[z][y];
      const float s0 = along_y.smooth[0][y], s1 = along_y.smooth[1][y], s2 = along_y.smooth[2][y], s3 = along_y.smooth[3][y];
      const float d0 = along_y.slope[0][y], d1 = along_y.slope[1][y], d2 = along_y.slope[2][y];
      for (std::size_t x = 0; x < kSamples; ++x) {
        value_[z][y][x] = (v[0][x] * s0 + v[1][x] * s1) + (v[2][x] * s2 + v[3][x] * s3);
        dx_[z][y][x] = (dx[0][x] * s0 + dx[1][x] * s1) + (dx[2][x] * s2 + dx[3][x] * s3);
        dy_[z][y][x] = ((v[1][x] - v[0][x]) * d0 + (v[2][x] - v[1][x]) * d1) + (v[3][x] - v[2][x]) * d2;
      }
    }
  }
}

Vec3 VertexNormals::Gradient(const Index3& vertex) const {
  const auto x = std::size_t(vertex.x), y = std::size_t(vertex.y), z = std::size_t(vertex.z);
  const auto smooth = [&](const auto& field) {
    return (field[z][y][x] * along_z_.smooth[0][z] + field[z + 1][y][x] * along_z_.smooth[1][z]) +
           (field[z + 2][y][x] * along_z_.smooth[2][z] + field[z + 3][y][x] * along_z_.smooth[3][z]);
  };
  const float a = value_[z][y][x], b = value_[z + 1][y][x], c = value_[z + 2][y][x], d = value_[z + 3][y][x];
  return {smooth(dx_), smooth(dy_), ((b - a) * along_z_.slope[0][z] + (c - b) * along_z_.slope[1][z]) + (d - c) * along_z_.slope[2][z]};
}

std::uint32_t PackNormal(const Vec3& gradient) {
  const double length = Length(gradient);
  if (!(length > 0) || !std::isfinite(length)) return 0;
  const double scale = double(kNormalUnit) / length;
  const auto component = [&](double value) {
    return std::uint32_t(std::int32_t(std::floor(scale * value + 0.5))) & ((1U << kNormalBits) - 1);
  };
  return component(gradient.x) | component(gradient.y) << kNormalBits | component(gradient.z) << (2 * kNormalBits);
}

}  // namespace slabstream
