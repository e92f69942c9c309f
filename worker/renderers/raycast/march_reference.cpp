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
  static std::int64_t IndexOf(const RayBox& box, std::int32_t x, std::int32_t y, std::int32_t z) {
    return std::int64_t{box.slice} * (z - box.origin.z + 1) + std::int64_t{box.row} * (y - box.origin.y + 1) + (x - box.origin.x + 1);
  }
  template <class S = T>
  static float Interpolated(const Float3& p, const Index3& shift, const S* samples, const RayBox& box) {
    const std::int32_t x = std::int32_t(std::floor(p[0])), y = std::int32_t(std::floor(p[1])), z = std::int32_t(std::floor(p[2]));
    const float u = p[0] - std::floor(p[0]), v = p[1] - std::floor(p[1]), w = p[2] - std::floor(p[2]);
    const auto at = [&](int dx, int dy, int dz) {
      return float(samples[IndexOf(box, x + dx + shift.x, y + dy + shift.y, z + dz + shift.z)]);
    };
    const auto row = [&](int dy, int dz) { return Lerp(u, at(0, dy, dz), at(1, dy, dz)); };
    return Lerp(w, Lerp(v, row(0, 0), row(1, 0)), Lerp(v, row(0, 1), row(1, 1)));
  }
  float Interpolated(const Float3& p, const Index3& shift) const {
    return Interpolated(p, shift, reinterpret_cast<const T*>(box_.samples), box_);
  }
  template <class S>
  static std::array<double, 3> Gradient(const Float3& p, const S* samples, const RayBox& box) {
    std::array<double, 3> gradient{};
    for (std::size_t i = 0; i < 3; ++i) {
      Index3 step;
      step[kAxes[i]] = 1;
      gradient.at(i) = double(Interpolated(p, step, samples, box)) - double(Interpolated(p, -1 * step, samples, box));
    }
    return gradient;
  }

  // `steps`: the length that the sample stands for. `face`: the normal of the cut face that it lies on, or null.
  void Add(const Float3& p, double steps, const Float3* face, std::array<float, 4>& sum) const {
    const float* const own = EntryAt(look_, Interpolated(p, {}));
    Part volume;
    if (own != nullptr) {
      volume = {.opacity = double(own[3]), .color = {double(own[0]), double(own[1]), double(own[2])}};
    }
    std::array<double, 3> gradient = Gradient(p, reinterpret_cast<const T*>(box_.samples), box_);
    Part overlay;
    if (work_.layers != nullptr && work_.layers->labels != nullptr) AddLabel(p, volume, gradient);
    if (work_.layers != nullptr && work_.layers->overlay != nullptr) {
      const float* const samples = work_.layers->overlay_samples;
      if (const float* const entry = EntryAt(*work_.layers->overlay, Interpolated<float>(p, {}, samples, box_))) {
        overlay = {.opacity = double(entry[3]), .color = {double(entry[0]), double(entry[1]), double(entry[2])}};
        Shade(Gradient(p, samples, box_), face, overlay);
      }
    }
    const double opacity = volume.opacity + overlay.opacity - volume.opacity * overlay.opacity;
    if (!(opacity > 0)) return;
    Shade(gradient, face, volume);
    const double share = overlay.opacity / (volume.opacity + overlay.opacity);
    const double weight = (1 - double(sum[3])) * (1 - std::pow(1 - opacity, steps));
    for (std::size_t c = 0; c < 3; ++c) sum.at(c) += float(weight * ((1 - share) * volume.color.at(c) + share * overlay.color.at(c)));
    sum[3] += float(weight);
  }

  // What the volume or the overlay has of a sample.
  struct Part {
    double opacity = 0;
    std::array<double, 3> color{};
  };

  // Null: the sample is not finite.
  static const float* EntryAt(const RayLook& look, float sample) {
    if (!std::isfinite(sample)) return nullptr;
    return &look.entries[4 * std::size_t(std::clamp((sample - look.origin) * look.scale + look.rounding, 0.0F, look.last))];
  }

  std::int32_t LabelOf(std::int32_t x, std::int32_t y, std::int32_t z) const {
    const std::int64_t index = IndexOf(box_, x, y, z);
    return work_.layers->label_type == ScalarType::kUint8 ? reinterpret_cast<const std::uint8_t*>(work_.layers->label_samples)[index]
                                                          : reinterpret_cast<const std::uint16_t*>(work_.layers->label_samples)[index];
  }

  void AddLabel(const Float3& p, Part& volume, std::array<double, 3>& gradient) const {
    const LabelTables& tables = *work_.layers->labels;
    const auto nearest = [&](std::size_t i) {
      const float floor = std::floor(p.at(i));
      return std::int32_t(floor) + (p.at(i) - floor >= 0.5F ? 1 : 0);
    };
    const std::int32_t label = LabelOf(nearest(0), nearest(1), nearest(2));
    const float* const entry = &tables.entries[4 * std::size_t(label)];
    if (tables.surface) {
      if (entry[3] < 0) return;
      volume = {.opacity = double(entry[3]), .color = {double(entry[0]), double(entry[1]), double(entry[2])}};
      gradient = IndicatorGradient(p, label);
      return;
    }
    if (label == 0) return;
    const double steps = double(tables.steps_a_length), of_length = 1 - std::pow(1 - volume.opacity, steps);
    if (entry[3] < 1) volume.opacity = 1 - std::pow(1 - double(entry[3]) * of_length, 1 / steps);
    for (std::size_t c = 0; c < 3; ++c) volume.color.at(c) += double(tables.tint) * (double(entry[c]) - volume.color.at(c));
  }

  // The cubic B-spline and its derivative at the distance `v` from its middle.
  static double Spline(double v) {
    const double d = std::abs(v);
    return d < 1 ? 2.0 / 3 - d * d + d * d * d / 2 : d < 2 ? (2 - d) * (2 - d) * (2 - d) / 6 : 0;
  }
  static double SplineSlope(double v) {
    const double d = std::abs(v), slope = d < 1 ? d * (1.5 * d - 2) : d < 2 ? -(2 - d) * (2 - d) / 2 : 0;
    return v < 0 ? -slope : slope;
  }

  std::array<double, 3> IndicatorGradient(const Float3& p, std::int32_t label) const {
    const std::array<std::int32_t, 3> first = {std::int32_t(std::floor(p[0])) - 1, std::int32_t(std::floor(p[1])) - 1,
                                               std::int32_t(std::floor(p[2])) - 1};
    std::array<double, 3> gradient{};
    for (std::int32_t z = first[2]; z < first[2] + 4; ++z) {
      for (std::int32_t y = first[1]; y < first[1] + 4; ++y) {
        for (std::int32_t x = first[0]; x < first[0] + 4; ++x) {
          if (LabelOf(x, y, z) != label) continue;
          const double dx = double(p[0]) - x, dy = double(p[1]) - y, dz = double(p[2]) - z;
          gradient[0] += SplineSlope(dx) * Spline(dy) * Spline(dz);
          gradient[1] += Spline(dx) * SplineSlope(dy) * Spline(dz);
          gradient[2] += Spline(dx) * Spline(dy) * SplineSlope(dz);
        }
      }
    }
    const double square = gradient[0] * gradient[0] + gradient[1] * gradient[1] + gradient[2] * gradient[2];
    return square > 1e-4 ? gradient : std::array<double, 3>{};
  }

  // Lights the colour of a part.
  void Shade(std::array<double, 3> gradient, const Float3* face, Part& part) const {
    double diffuse = 1, specular = 0;
    if (look_.phong) Light(gradient, face, diffuse, specular);
    for (double& channel : part.color) channel = std::clamp(channel * diffuse + specular, 0.0, 1.0);
  }

  void Light(std::array<double, 3> gradient, const Float3* face, double& diffuse, double& specular) const {
    if (face != nullptr) std::copy(face->begin(), face->end(), gradient.begin());
    const auto dot = [&](const Float3& v) { return gradient[0] * double(v[0]) + gradient[1] * double(v[1]) + gradient[2] * double(v[2]); };
    double square = 0;
    for (std::size_t i = 0; i < 3; ++i) square += std::pow(gradient.at(i) * double(look_.inverse_spacing.at(i)), 2);
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
