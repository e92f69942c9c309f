#include "tests/worker/renderers/splat/reference_splatting.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "common/classification/classification_table.h"
#include "common/kernels/resample.h"
#include "tests/common/kernels/resample_reference.h"
#include "worker/kernels/phong_table.h"

namespace slabstream::testing {
namespace {

double Stored(const VoxelBlock& block, const Index3& v) {
  return VisitScalarType(block.type,
                         [&](auto* tag) { return double(block.samples<std::remove_cvref_t<decltype(*tag)>>()[block.Offset(v)]); });
}

// What the voxels of one axis weigh at the pixels of the grid along it, in one slice.
class Footprint {
 public:
  // A pixel is 1 / scale voxels wide and its centre lies `first_place` + pixel / scale voxels from voxel 0; `shear`: of the central ray.
  // `width`: times the usual one.
  Footprint(double shear, double scale, double first_place, double width) : scale_(scale), first_place_(first_place) {
    shear = std::min(std::abs(shear), 3.0);
    sigma_ = std::min(width * std::sqrt(std::max(0.36 * (1 + shear * shear), 0.3 / (scale * scale))), 2.0);
  }

  double Weight(int pixel, int voxel) const {
    const double place = first_place_ + pixel / scale_, weight = Bell(place - voxel);
    if (weight == 0) return 0;
    double sum = 0;
    for (double n = std::ceil(place - 3 * sigma_); n <= place + 3 * sigma_; ++n) sum += Bell(place - n);
    return weight / sum;
  }
  // Pixels that a voxel may reach.
  int Begin(int voxel) const { return int(std::floor((voxel - 3 * sigma_ - first_place_) * scale_)); }
  int End(int voxel) const { return int(std::ceil((voxel + 3 * sigma_ - first_place_) * scale_)) + 1; }

 private:
  double Bell(double distance) const {
    const double d = distance / sigma_;
    return std::abs(d) < 3 ? std::exp(-0.5 * d * d) - std::exp(-4.5) : 0;
  }
  double scale_, first_place_, sigma_ = 0;
};

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
  const SheetGrid& grid = setup.sheets;
  const Index3& size = volume.description.geometry.size;
  const Vec3& spacing = camera.spacing;
  const auto [c, u, v] = AxesOf(camera.traversal_axis);
  const ClassificationTable table = Classify(setup.transfer, setup.description, setup.range);
  const Phong phong(setup.shading, camera.view_direction);
  const double voxel_length = std::min({spacing.x, spacing.y, spacing.z});
  const Vec3 central_ray = camera.view_direction / spacing;

  using Color = std::array<double, 4>;
  std::vector<Color> image(std::size_t(grid.width) * std::size_t(grid.height)), sheet(image.size());
  for (int i = 0; i < size[c]; ++i) {
    std::fill(sheet.begin(), sheet.end(), Color{});
    Index3 q;
    q[c] = camera.ascending ? i : size[c] - 1 - i;
    const double w = grid.w_c * q[c] + grid.w_0;
    const Footprint along_u(central_ray[u] / central_ray[c], grid.x_u / w, (0.5 * w - grid.x_c * q[c] - grid.x_0) / grid.x_u,
                            setup.parameters.at(0));
    const Footprint along_v(central_ray[v] / central_ray[c], grid.y_v / w, (0.5 * w - grid.y_c * q[c] - grid.y_0) / grid.y_v,
                            setup.parameters.at(0));
    for (q[v] = 0; q[v] < size[v]; ++q[v]) {
      for (q[u] = 0; q[u] < size[u]; ++q[u]) {
        const double stored = Stored(volume.block, q);
        if (!std::isfinite(stored)) continue;
        const auto bin = std::size_t(table.BinOf(stored));
        if (table.opacity[bin] == 0) continue;
        // Between two sheets the voxel's ray travels that far.
        const Vec3 ray = camera.projection == Projection::kPerspective ? spacing * (ToVec3(q) - camera.eye) : camera.view_direction;
        const double distance = spacing[c] * Length(ray) / std::abs(ray[c]);
        const double opacity = 1 - std::pow(1 - double(table.opacity[bin]), distance / (table.opacity_distance * voxel_length));
        const Vec3 gradient = ReferenceGradient(volume, q);
        const PhongFactors factors = Length(gradient) > 0 ? phong.AtNormal(Normalized(gradient)) : phong.WithoutGradient();
        const Rgb& color = table.color[bin];
        Color value = {color.r, color.g, color.b, 1};
        for (std::size_t k = 0; k < 3; ++k) value[k] = opacity * std::clamp(value[k] * factors.diffuse + factors.specular, 0.0, 1.0);
        value[3] = opacity;

        for (int y = std::max(0, along_v.Begin(q[v])); y < std::min(grid.height, along_v.End(q[v])); ++y) {
          const double row_weight = along_v.Weight(y, q[v]);
          if (row_weight == 0) continue;
          for (int x = std::max(0, along_u.Begin(q[u])); x < std::min(grid.width, along_u.End(q[u])); ++x) {
            const double weight = row_weight * along_u.Weight(x, q[u]);
            Color& pixel = sheet[std::size_t(y) * std::size_t(grid.width) + std::size_t(x)];
            for (std::size_t k = 0; k < 4; ++k) pixel[k] += weight * value[k];
          }
        }
      }
    }
    for (std::size_t p = 0; p < image.size(); ++p) {
      const double rest = 1 - image[p][3];
      for (std::size_t k = 0; k < 4; ++k) image[p][k] += rest * sheet[p][k];
    }
  }

  LocalImage result = MakeLocalImage(PixelFormat::kRgba, FrameBounds(setup));
  for (std::size_t p = 0; p < image.size(); ++p) {
    for (std::size_t k = 0; k < 4; ++k) result.rgba[4 * p + k] = float(image[p][k]);
  }
  return result;
}

LocalImage ReferencePicture(const LocalImage& frame, const FrameSetup& setup) {
  LocalImage picture = MakeLocalImage(PixelFormat::kRgba, {0, 0, setup.camera.width, setup.camera.height});
  ResampleRowsReference(frame, setup.sheets.from_picture, 0, setup.camera.height, picture);
  return picture;
}

}  // namespace slabstream::testing
