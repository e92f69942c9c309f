#include "tests/render/reference_splatting.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/classification/classification_table.h"
#include "worker/kernels/gaussian_kernel.h"
#include "worker/kernels/phong.h"

namespace slabstream::testing {
namespace {

double Apply(const std::array<double, 4>& row, const Vec3& p) { return row[0] * p.x + row[1] * p.y + row[2] * p.z + row[3]; }

double Stored(const VoxelBlock& block, const Index3& v) {
  return VisitScalarType(block.type,
                         [&](auto* tag) { return double(block.samples<std::remove_cvref_t<decltype(*tag)>>()[block.Offset(v)]); });
}

// d(x, y) / d(data axis) at a data-space point.
struct Jacobian {
  std::array<double, 3> x{}, y{};
};
Jacobian JacobianAt(const Camera& camera, const Vec3& p) {
  const double w = Apply(camera.w_row, p), x = Apply(camera.x_row, p) / w, y = Apply(camera.y_row, p) / w;
  Jacobian j;
  for (std::size_t i = 0; i < 3; ++i) {
    j.x[i] = (camera.x_row[i] - x * camera.w_row[i]) / w;
    j.y[i] = (camera.y_row[i] - y * camera.w_row[i]) / w;
  }
  return j;
}

struct Sigma {
  double x, y;
};
Sigma FootprintOf(const FrameSetup& setup, const Index3& voxel) {
  const bool perspective = setup.camera.projection == Projection::kPerspective;
  Vec3 centre = ToVec3(voxel);
  for (Axis axis : kAxes) {
    if (axis == setup.camera.traversal_axis) continue;
    const int first = voxel[axis] / kFootprintCell * kFootprintCell;
    centre[axis] = 0.5 * (first + std::min(first + kFootprintCell, setup.description.geometry.size[axis]) - 1);
  }
  const Jacobian j = JacobianAt(setup.camera, centre);
  double xx = 0, yy = 0, xy = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    xx += j.x[i] * j.x[i];
    yy += j.y[i] * j.y[i];
    xy += j.x[i] * j.y[i];
  }
  const auto sigma = [&](double variance) {
    const double s = std::sqrt(kFootprintVoxelVariance * (variance + std::abs(xy)) + kFootprintPixelVariance);
    return perspective ? std::exp2(std::round(32 * std::log2(s)) / 32) : s;
  };
  return {sigma(xx), sigma(yy)};
}

}  // namespace

Vec3 ReferenceGradient(const Volume& volume, const Index3& voxel) {
  const VolumeGeometry& geometry = volume.description.geometry;
  Vec3 gradient;
  for (int axis = 0; axis < 3; ++axis) {
    const int below = std::max(voxel[axis] - 1, 0), above = std::min(voxel[axis] + 1, geometry.size[axis] - 1);
    if (above == below) continue;
    const int other = (axis + 1) % 3, another = (axis + 2) % 3;
    double difference = 0;
    for (int i = -1; i <= 1; ++i) {
      for (int j = -1; j <= 1; ++j) {
        Index3 at;
        at[other] = std::clamp(voxel[other] + i, 0, geometry.size[other] - 1);
        at[another] = std::clamp(voxel[another] + j, 0, geometry.size[another] - 1);
        const double weight = (2 - std::abs(i)) * (2 - std::abs(j)) / 16.0;
        at[axis] = above;
        difference += weight * Stored(volume.block, at);
        at[axis] = below;
        difference -= weight * Stored(volume.block, at);
      }
    }
    gradient[axis] = difference / ((above - below) * geometry.spacing[axis]);
  }
  return gradient;
}

LocalImage ReferenceSplatting(const Volume& volume, const FrameSetup& setup) {
  const Camera& camera = setup.camera;
  const Index3& size = volume.description.geometry.size;
  const Vec3& spacing = camera.spacing;
  const Axis c = camera.traversal_axis, u = c == Axis::kX ? Axis::kY : Axis::kX, v = c == Axis::kZ ? Axis::kY : Axis::kZ;
  const ClassificationTable table = Classify(setup.transfer, setup.description, setup.range);
  const Phong phong(setup.shading, camera.view_direction);
  const double central_distance = spacing[c] / std::abs(camera.view_direction[c]);
  const double exponent = central_distance / (table.opacity_distance * std::min({spacing.x, spacing.y, spacing.z}));

  const std::size_t pixels = std::size_t(camera.width) * std::size_t(camera.height);
  std::vector<std::array<double, 4>> image(pixels), sheet(pixels);
  for (int i = 0; i < size[c]; ++i) {
    std::fill(sheet.begin(), sheet.end(), std::array<double, 4>{});
    Index3 q;
    q[c] = camera.ascending ? i : size[c] - 1 - i;
    for (q[v] = 0; q[v] < size[v]; ++q[v]) {
      for (q[u] = 0; q[u] < size[u]; ++q[u]) {
        const double stored = Stored(volume.block, q);
        if (!std::isfinite(stored)) continue;
        const auto bin = std::size_t(table.BinOf(stored));
        if (table.opacity[bin] == 0) continue;
        const double opacity = 1 - std::pow(1 - double(table.opacity[bin]), exponent);
        const Vec3 gradient = ReferenceGradient(volume, q);
        const PhongFactors factors = Length(gradient) > 0 ? phong.AtNormal(Normalized(gradient)) : phong.WithoutGradient();
        const Rgb& color = table.color[bin];
        std::array<double, 4> value = {color.r, color.g, color.b, 1};
        for (std::size_t k = 0; k < 3; ++k) value[k] = opacity * std::clamp(value[k] * factors.diffuse + factors.specular, 0.0, 1.0);
        value[3] = opacity;

        const Camera::ImagePoint at = camera.Project(ToVec3(q));
        const Jacobian j = JacobianAt(camera, ToVec3(q));
        const auto nu = std::size_t(Number(u)), nv = std::size_t(Number(v));
        const double area = std::abs(j.x[nu] * j.y[nv] - j.x[nv] * j.y[nu]);
        const Sigma sigma = FootprintOf(setup, q);
        for (int y = std::max(0, int(at.y - 3 * sigma.y) - 1); y < std::min(camera.height, int(at.y + 3 * sigma.y) + 2); ++y) {
          const double wy = GaussianWeight(y + 0.5 - at.y, sigma.y);
          for (int x = std::max(0, int(at.x - 3 * sigma.x) - 1); x < std::min(camera.width, int(at.x + 3 * sigma.x) + 2); ++x) {
            const double weight = area * wy * GaussianWeight(x + 0.5 - at.x, sigma.x);
            for (std::size_t k = 0; k < 4; ++k) sheet[std::size_t(y) * std::size_t(camera.width) + std::size_t(x)][k] += weight * value[k];
          }
        }
      }
    }
    for (std::size_t p = 0; p < pixels; ++p) {
      const std::array<double, 4>& s = sheet[p];
      if (s[3] == 0) continue;
      const Vec3 d =
          spacing * camera.RayAt(double(p % std::size_t(camera.width)) + 0.5, double(p / std::size_t(camera.width)) + 0.5).direction;
      const double alpha = std::min(s[3], 1.0), distance = spacing[c] * Length(d) / std::abs(d[c]);
      const double corrected = 1 - std::pow(1 - alpha, distance / central_distance);
      const double rest = 1 - image[p][3];
      for (std::size_t k = 0; k < 3; ++k) image[p][k] += rest * s[k] * corrected / s[3];
      image[p][3] += rest * corrected;
    }
  }

  LocalImage result = MakeLocalImage(PixelFormat::kRgba, {0, 0, camera.width, camera.height});
  for (std::size_t p = 0; p < pixels; ++p) {
    for (std::size_t k = 0; k < 4; ++k) result.rgba[4 * p + k] = float(image[p][k]);
  }
  return result;
}

}  // namespace slabstream::testing
