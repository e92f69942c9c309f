#include "tests/worker/renderers/shear/reference_shear.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/renderers/shear/shear_parameters.h"
#include "common/view/phong.h"
#include "tests/worker/rays/pixel_ray.h"
#include "worker/rays/ray_look.h"
#include "worker/renderers/shear/shear_passes.h"

namespace slabstream::testing {
namespace {

using shear::Kernel;
using shear::ShearPasses;

// Mitchell and Netravali (1988), equation 8.
double KernelAt(Kernel kernel, double x) {
  x = std::abs(x);
  if (kernel == Kernel::kLinear) return std::max(1 - x, 0.0);
  const double b = kernel == Kernel::kMitchell ? 1.0 / 3 : kernel == Kernel::kBSpline ? 1.0 : 0.0;
  const double c = kernel == Kernel::kMitchell ? 1.0 / 3 : kernel == Kernel::kBSpline ? 0.0 : 0.5;
  if (x < 1) return ((12 - 9 * b - 6 * c) * x * x * x + (-18 + 12 * b + 6 * c) * x * x + (6 - 2 * b)) / 6;
  if (x < 2) return ((-b - 6 * c) * x * x * x + (6 * b + 30 * c) * x * x + (-12 * b - 48 * c) * x + (8 * b + 24 * c)) / 6;
  return 0;
}

// Reconstruction at x from value(n) at whole n.
template <class Value>
double Reconstruct(Kernel kernel, double x, Value&& value) {
  const double floor = std::floor(x);
  double sum = 0, low = 1e300, high = -1e300;
  for (int i = -1; i <= 2; ++i) {
    const double sample = value(int(floor) + i);
    sum += KernelAt(kernel, x - floor - i) * sample;
    low = std::min(low, sample);
    high = std::max(high, sample);
  }
  return std::clamp(sum, low, high);
}

class Reference {
 public:
  Reference(const Volume& volume, const FrameSetup& setup)
      : volume_(volume),
        setup_(setup),
        rate_(setup.parameters[0]),
        rays_(MakeViewRays(setup.camera, setup.description.geometry, rate_)),
        look_(MakeRayLook(Classify(setup.transfer, setup.description, setup.range), setup.transfer, setup.description, setup.camera,
                          setup.shading, rate_)),
        phong_(setup.shading, setup.camera.view_direction),
        kernel_(Kernel(int(setup.parameters[shear::kKernel]))),
        scale_(shear::SupersamplingOf(setup.parameters)) {
    const auto vector = [](const Float3& v) { return Vec3{double(v[0]), double(v[1]), double(v[2])}; };
    passes_ =
        shear::MakeShearPasses(vector(rays_.start), vector(rays_.right), vector(rays_.down), double(rays_.step) * vector(rays_.forward));
  }

  std::array<double, 4> Pixel(int px, int py) const {
    const PixelRay ray = RayOf(rays_, px, py);
    const double column = px - double(rays_.centre_x), row = py - double(rays_.centre_y);
    const double u = passes_.turned ? row : column, v = passes_.turned ? column : row;
    const auto inside = [&](int k) {
      const Float3 p = SamplePosition(ray, k);
      for (std::size_t i = 0; i < 3; ++i) {
        if (p[i] < -0.5F || p[i] >= rays_.volume_end[i]) return false;
      }
      return true;
    };
    double enter = -1e9, leave = 1e9;
    for (std::size_t i = 0; i < 3; ++i) {
      const double a = double(-0.5F - ray.first[i]) / double(ray.move[i]),
                   b = double(rays_.volume_end[i] - ray.first[i]) / double(ray.move[i]);
      enter = std::max(enter, std::min(a, b));
      leave = std::min(leave, std::max(a, b));
    }
    std::array<double, 4> sum{};
    for (int k = 0; k < rays_.sample_count; ++k) {
      if (!inside(k)) continue;
      const double before = inside(k - 1) ? 0.5 : std::clamp(k - enter, 0.0, 1.0),
                   behind = inside(k + 1) ? 0.5 : std::clamp(leave - k, 0.0, 1.0);
      Add(u, v, double(SamplePosition(ray, k)[std::size_t(Number(passes_.axes[2]))]), before + behind, sum);
    }
    return sum;
  }

 private:
  void Add(double u, double v, double z, double steps, std::array<double, 4>& sum) const {
    const double slice = z * scale_;
    const double value = Reconstruct(kernel_, slice, [&](int n) { return AtLattice(u, v, n); });
    const double entry = std::clamp((value - double(look_.origin)) * double(look_.scale) + double(look_.rounding), 0.0, double(look_.last));
    const float* const look = &look_.entries[4 * std::size_t(entry)];
    const double opacity = 1 - std::pow(1 - double(look[3]), steps);
    if (!(opacity > 0)) return;
    PhongFactors light;
    if (setup_.shading.model == ShadingModel::kPhong) {
      const Vec3 slopes = SlopesAt(u, v, z);
      const Vec3 gradient = slopes / setup_.description.geometry.spacing;
      const double length = Length(gradient);
      light = length > 0 ? phong_.AtNormal((1 / length) * gradient) : phong_.WithoutGradient();
    }
    const double weight = (1 - sum[3]) * opacity;
    for (std::size_t c = 0; c < 3; ++c) {
      sum[c] += weight * std::clamp(double(look[c]) * double(light.diffuse) + double(light.specular), 0.0, 1.0);
    }
    sum[3] += weight;
  }

  // After pass 2: of slice n / scale.
  double AtLattice(double u, double v, int n) const {
    return Reconstruct(kernel_, YOf(u, v, n) * scale_, [&](int beam) { return OnBeam(u, beam, n); });
  }
  // Central differences of the volume's samples, through the same passes by linear interpolation.
  Vec3 SlopesAt(double u, double v, double z) const {
    const auto between = [](double place, auto&& at) {
      const double floor = std::floor(place);
      return (1 - (place - floor)) * at(int(floor)) + (place - floor) * at(int(floor) + 1);
    };
    Vec3 slopes;
    for (int i = 0; i < 3; ++i) {
      const int dx = i == 0 ? 1 : 0, dy = i == 1 ? 1 : 0, dz = i == 2 ? 1 : 0;
      slopes[passes_.axes[std::size_t(i)]] = between(z, [&](int slice) {
        return between(passes_.y_0 + passes_.y_u * u + passes_.y_v * v + passes_.y_z * slice, [&](int row) {
          return between(passes_.x_0 + passes_.x_u * u + passes_.x_y * row + passes_.x_z * slice,
                         [&](int x) { return (At(x + dx, row + dy, slice + dz) - At(x - dx, row - dy, slice - dz)) / 2; });
        });
      });
    }
    return slopes;
  }

  double YOf(double u, double v, int n) const { return passes_.y_0 + passes_.y_u * u + passes_.y_v * v + passes_.y_z * n / scale_; }
  double XOf(double u, int beam, int n) const {
    return passes_.x_0 + passes_.x_u * u + passes_.x_y * beam / scale_ + passes_.x_z * n / scale_;
  }

  // After pass 1.
  double OnBeam(double u, int beam, int n) const {
    return Reconstruct(kernel_, XOf(u, beam, n), [&](int i) { return Sample(i, beam, n); });
  }

  // Sample i of a beam that may lie between those of the volume.
  double Sample(int i, int beam, int n) const {
    if (scale_ == 1) return At(i, beam, n);
    return Reconstruct(kernel_, double(n) / scale_,
                       [&](int slice) { return Reconstruct(kernel_, double(beam) / scale_, [&](int row) { return At(i, row, slice); }); });
  }

  double At(int x, int y, int z) const {
    Index3 voxel;
    const int place[3] = {x, y, z};
    for (std::size_t i = 0; i < 3; ++i) {
      voxel[passes_.axes[i]] = std::clamp(place[i], 0, volume_.description.geometry.size[passes_.axes[i]] - 1);
    }
    return VisitScalarType(volume_.block.type,
                           [&]<class T>(const T*) { return double(volume_.block.samples<T>()[volume_.block.Offset(voxel)]); });
  }

  const Volume& volume_;
  const FrameSetup& setup_;
  const double rate_;
  const ViewRays rays_;
  const RayLook look_;
  const Phong phong_;
  const Kernel kernel_;
  const int scale_;
  ShearPasses passes_;
};

}  // namespace

LocalImage ReferenceShear(const Volume& volume, const FrameSetup& setup) {
  LocalImage image = MakeLocalImage(setup.format, FrameBounds(setup));
  const Reference reference(volume, setup);
  for (int y = 0; y < setup.camera.height; ++y) {
    for (int x = 0; x < setup.camera.width; ++x) {
      const std::array<double, 4> pixel = reference.Pixel(x, y);
      for (std::size_t c = 0; c < 4; ++c)
        image.rgba[4 * (std::size_t(y) * std::size_t(setup.camera.width) + std::size_t(x)) + c] = float(pixel[c]);
    }
  }
  return image;
}

}  // namespace slabstream::testing
