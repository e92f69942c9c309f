#include "laboratory/measure/point_zbuffer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "common/base/check.h"

namespace slabstream {

TransformMatrix MatrixOf(const Camera& camera) {
  CHECK(camera.projection == Projection::kOrthographic);
  TransformMatrix matrix{};
  const std::array<const std::array<double, 4>*, 3> rows = {&camera.x_row, &camera.y_row, &camera.depth_row};
  for (std::size_t c = 0; c < 3; ++c) std::ranges::transform(*rows[c], matrix[c].begin(), [](double number) { return float(number); });
  return matrix;
}

PointZBuffer::PointZBuffer(ImageSize size)
    : size_(size), depth_(std::size_t(size.width) * std::size_t(size.height)), voxel_(depth_.size()) {}

template <class Visit>
void PointZBuffer::ForEachPoint(const TransformMatrix& matrix, const Index3& size, const std::uint8_t* occupied, Visit visit) const {
  const Index3 slice = {size.x, size.y, 1};
  const std::size_t count = CountIn(slice);
  TransformedPoints points(slice);
  FindTransformMethod("phases").Run(matrix, slice, points);
  const float *x = points.components[0].data(), *y = points.components[1].data(), *depth = points.components[2].data();
  for (int z = 0; z < size.z; ++z, occupied += count) {
    for (std::size_t i = 0; i < count; ++i) {
      if (occupied[i] == 0 || x[i] < 0 || y[i] < 0) continue;
      const auto column = int(x[i]), row = int(y[i]);
      if (column >= size_.width || row >= size_.height) continue;
      visit(std::size_t(row) * std::size_t(size_.width) + std::size_t(column), depth[i], std::uint32_t(std::size_t(z) * count + i + 1));
    }
    for (std::size_t c = 0; c < 3; ++c) AddStep(points.components[c].data(), points.components[c].data(), count, matrix[c][2]);
  }
}

void PointZBuffer::Draw(const TransformMatrix& matrix, const Index3& size, const std::uint8_t* occupied) {
  std::ranges::fill(depth_, std::numeric_limits<float>::infinity());
  std::ranges::fill(voxel_, 0);
  ForEachPoint(matrix, size, occupied, [this](std::size_t pixel, float depth, std::uint32_t voxel) {
    if (depth >= depth_[pixel]) return;
    depth_[pixel] = depth;
    voxel_[pixel] = voxel;
  });
}

std::size_t PointZBuffer::CountDoubled(const TransformMatrix& matrix, const Index3& size, const std::uint8_t* occupied) const {
  std::vector<bool> doubled(voxel_.size());
  ForEachPoint(matrix, size, occupied, [&](std::size_t pixel, float depth, std::uint32_t voxel) {
    if (voxel != voxel_[pixel] && depth < depth_[pixel] + 1) doubled[pixel] = true;
  });
  return std::size_t(std::ranges::count(doubled, true));
}

PointZBuffer::Holes PointZBuffer::HolesIn(const std::vector<float>& faces) const {
  CHECK_EQ(faces.size(), voxel_.size());
  Holes holes;
  for (std::size_t pixel = 0; pixel < faces.size(); ++pixel) {
    if (!std::isfinite(faces[pixel])) continue;
    ++holes.covered;
    if (!Written(pixel)) {
      ++holes.empty;
    } else if (depth_[pixel] > faces[pixel] + std::numbers::sqrt3_v<float>) {
      ++holes.behind;
    }
  }
  return holes;
}

}  // namespace slabstream
