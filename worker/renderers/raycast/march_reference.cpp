#include <algorithm>
#include <array>
#include <cmath>

#include "worker/renderers/raycast/march.h"

namespace slabstream {
namespace {

float Lerp(float t, float a, float b) { return a + t * (b - a); }

template <class T>
class ReferenceMarch {
 public:
  explicit ReferenceMarch(const MarchWork& work) : work_(work), box_(*work.box), look_(*work.look) {}

  std::array<float, 4> Pixel(std::int32_t x, std::int32_t y) const {
    const PixelRay ray = RayOf(*work_.rays, x, y);
    std::array<float, 4> sum{};
    for (const RayPart& part : PartsOf(work_.rays->clip, ray)) AddPart(ray, part, sum);
    return sum;
  }

 private:
  void AddPart(const PixelRay& ray, const RayPart& part, std::array<float, 4>& sum) const {
    const Float3 volume_begin = {-0.5F, -0.5F, -0.5F}, &volume_end = work_.rays->volume_end;
    const auto in_part = [&](std::int32_t k) {
      return Inside(SamplePosition(ray, k), volume_begin, volume_end) && float(k) >= part.begin && float(k) < part.end;
    };
    for (std::int32_t k = 0; k < work_.rays->sample_count; ++k) {
      const Float3 p = SamplePosition(ray, k);
      if (!Inside(p, box_.low, box_.high) || !in_part(k)) continue;
      double enter = part.enter, leave = part.leave;
      for (std::size_t i = 0; i < 3; ++i) {
        const double move = double(ray.move[i]), to_begin = double(volume_begin[i] - ray.first[i]),
                     to_end = double(volume_end[i] - ray.first[i]);
        if (move == 0) continue;
        enter = std::max(enter, std::min(to_begin / move, to_end / move));
        leave = std::min(leave, std::max(to_begin / move, to_end / move));
      }
      const bool first = !in_part(k - 1), last = !in_part(k + 1);
      const double before = first ? std::clamp(k - enter, 0.0, 1.0) : 0.5, behind = last ? std::clamp(leave - k, 0.0, 1.0) : 0.5;
      Add(p, before + behind, float(k) < part.face_end ? &part.face : nullptr, sum);
    }
  }

  static bool Inside(const Float3& p, const Float3& low, const Float3& high) {
    bool inside = true;
    for (std::size_t i = 0; i < 3; ++i) inside = inside && p[i] >= low[i] && p[i] < high[i];
    return inside;
  }
  float Voxel(std::int32_t x, std::int32_t y, std::int32_t z) const {
    const std::int64_t index =
        std::int64_t{box_.slice} * (z - box_.origin.z + 1) + std::int64_t{box_.row} * (y - box_.origin.y + 1) + (x - box_.origin.x + 1);
    return float(reinterpret_cast<const T*>(box_.samples)[index]);
  }
  float Interpolated(const Float3& p, const Index3& shift) const {
    const std::int32_t x = std::int32_t(std::floor(p[0])), y = std::int32_t(std::floor(p[1])), z = std::int32_t(std::floor(p[2]));
    const float u = p[0] - std::floor(p[0]), v = p[1] - std::floor(p[1]), w = p[2] - std::floor(p[2]);
    const auto row = [&](int dy, int dz) {
      return Lerp(u, Voxel(x + shift.x, y + dy + shift.y, z + dz + shift.z), Voxel(x + 1 + shift.x, y + dy + shift.y, z + dz + shift.z));
    };
    return Lerp(w, Lerp(v, row(0, 0), row(1, 0)), Lerp(v, row(0, 1), row(1, 1)));
  }

  // `steps`: the length that the sample stands for. `face`: the normal of the cut face that it lies on, or null.
  void Add(const Float3& p, double steps, const Float3* face, std::array<float, 4>& sum) const {
    const float sample = Interpolated(p, {});
    if (!std::isfinite(sample)) return;
    const auto entry = std::size_t(std::clamp((sample - look_.origin) * look_.scale + look_.rounding, 0.0F, look_.last));
    const float* const rgba = &look_.entries[4 * entry];
    if (rgba[3] == 0) return;
    double diffuse = 1, specular = 0;
    if (look_.phong) Shade(p, face, diffuse, specular);
    const double weight = (1 - double(sum[3])) * (1 - std::pow(1 - double(rgba[3]), steps));
    for (std::size_t c = 0; c < 3; ++c) sum[c] += float(weight * std::clamp(double(rgba[c]) * diffuse + specular, 0.0, 1.0));
    sum[3] += float(weight);
  }

  void Shade(const Float3& p, const Float3* face, double& diffuse, double& specular) const {
    double gradient[3] = {double(Interpolated(p, {1, 0, 0})) - double(Interpolated(p, {-1, 0, 0})),
                          double(Interpolated(p, {0, 1, 0})) - double(Interpolated(p, {0, -1, 0})),
                          double(Interpolated(p, {0, 0, 1})) - double(Interpolated(p, {0, 0, -1}))};
    if (face != nullptr) std::copy(face->begin(), face->end(), gradient);
    const auto dot = [&](const Float3& v) { return gradient[0] * double(v[0]) + gradient[1] * double(v[1]) + gradient[2] * double(v[2]); };
    double square = 0;
    for (std::size_t i = 0; i < 3; ++i) square += std::pow(gradient[i] * double(look_.inverse_spacing[i]), 2);
    if (!(square > 0) || !std::isfinite(square)) {
      diffuse = double(look_.diffuse_without_gradient);
      return;
    }
    const double per_length = 1 / std::sqrt(square), n_v = dot(look_.viewer) * per_length;
    double lit = 0, shine = 0;
    for (const RayLook::Light& light : look_.lights) {
      const double n_l = dot(light.direction) * per_length;
      lit += std::abs(n_l);
      shine += std::pow(std::clamp(2 * n_l * n_v - double(light.to_viewer), 0.0, 1.0), double(look_.shininess));
    }
    diffuse = double(look_.ambient) + double(look_.diffuse) * lit;
    specular = double(look_.specular) * shine;
  }

  const MarchWork& work_;
  const RayBox& box_;
  const RayLook& look_;
};

}  // namespace

void MarchTileReference(const MarchWork& work, const PixelBounds& tile, float* rgba, std::size_t floats_a_row) {
  VisitScalarType(work.box->type, [&]<class T>(const T*) {
    const ReferenceMarch<T> march(work);
    for (std::int32_t y = tile.y_begin; y < tile.y_end; ++y) {
      for (std::int32_t x = tile.x_begin; x < tile.x_end; ++x) {
        const std::array<float, 4> pixel = march.Pixel(x, y);
        std::copy(pixel.begin(), pixel.end(), rgba + std::size_t(y - tile.y_begin) * floats_a_row + 4 * std::size_t(x - tile.x_begin));
      }
    }
  });
}

}  // namespace slabstream
