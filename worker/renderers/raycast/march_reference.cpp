#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <vector>

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
    std::deque<Crossing> crossings = CrossingsOf(ray, part);
    for (std::int32_t k = 0; k < work_.rays->sample_count; ++k) {
      const Float3 p = SamplePosition(ray, k);
      if (!Inside(p, box_.low, box_.high) || !in_part(k)) continue;
      AddCrossings(crossings, k, sum);
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
    AddCrossings(crossings, double(kRayEnd), sum);
  }

  struct Crossing {
    double at;
    Float3 position;
    std::size_t surface;
  };

  // Crossings of the ray with isosurfaces in the box and in `part`, nearest first.
  std::deque<Crossing> CrossingsOf(const PixelRay& ray, const RayPart& part) const {
    double from = std::max(double(part.enter), 0.0), to = double(part.leave);
    std::vector<double> planes;  // where the ray passes planes of voxel centres
    for (std::size_t i = 0; i < 3; ++i) {
      const double first = double(ray.first[i]), move = double(ray.move[i]);
      if (std::abs(move) < 1e-9) continue;
      const double a = (double(box_.low[i]) - first) / move, b = (double(box_.high[i]) - first) / move;
      from = std::max(from, std::min(a, b));
      to = std::min(to, std::max(a, b));
      for (double plane = std::floor(double(box_.low[i])); plane <= double(box_.high[i]) + 1; ++plane)
        planes.push_back((plane - first) / move);
    }
    std::deque<Crossing> crossings;
    if (!(from < to)) return crossings;
    std::erase_if(planes, [&](double at) { return at <= from || at >= to; });
    planes.insert(planes.end(), {from, to});
    std::ranges::sort(planes);
    for (std::size_t i = 1; i < planes.size(); ++i) AddCrossingsBetween(ray, planes[i - 1], planes[i], crossings);
    std::ranges::stable_sort(crossings, {}, &Crossing::at);
    return crossings;
  }

  // Between `from` and `to` the ray stays in one cell.
  void AddCrossingsBetween(const PixelRay& ray, double from, double to, std::deque<Crossing>& crossings) const {
    const auto at = [&](std::size_t i, double t) { return double(ray.first[i]) + t * double(ray.move[i]); };
    const double middle = (from + to) / 2;
    Index3 cell;
    for (std::size_t i = 0; i < 3; ++i) cell[int(i)] = std::int32_t(std::floor(at(i, middle)));
    double corners[8];
    for (int n = 0; n < 8; ++n) {
      corners[n] = double(Voxel(cell.x + (n & 1), cell.y + (n >> 1 & 1), cell.z + (n >> 2)));
      if (!std::isfinite(corners[n])) return;
    }
    const auto value = [&](double t) {
      double sum = 0;
      for (int n = 0; n < 8; ++n) {
        double weight = corners[n];
        for (std::size_t i = 0; i < 3; ++i) {
          const double fraction = std::clamp(at(i, t) - cell[int(i)], 0.0, 1.0);
          weight *= (n >> i & 1) != 0 ? fraction : 1 - fraction;
        }
        sum += weight;
      }
      return sum;
    };
    // Where the cubic polynomial through four values turns: c1 + 2 c2 x + 3 c3 x^2 = 0, x from 0 to 3.
    const double step = (to - from) / 3, f[4] = {value(from), value(from + step), value(to - step), value(to)};
    const double d1 = f[1] - f[0], d2 = f[2] - 2 * f[1] + f[0], d3 = f[3] - 3 * f[2] + 3 * f[1] - f[0];
    const double c1 = d1 - d2 / 2 + d3 / 3, c2 = (d2 - d3) / 2, c3 = d3 / 6;
    std::vector<double> ends = {from, to};
    for (const double sign : {-1.0, 1.0}) {
      const double q = -(c2 + std::copysign(std::sqrt(c2 * c2 - 3 * c3 * c1), c2)), x = sign < 0 ? q / (3 * c3) : c1 / q;
      if (x > 0 && x < 3) ends.push_back(from + x * step);
    }
    std::ranges::sort(ends);
    for (std::size_t surface = 0; surface < look_.isovalues.size(); ++surface) {
      const auto isovalue = double(look_.isovalues[surface]);
      for (std::size_t i = 1; i < ends.size(); ++i) {
        double low = ends[i - 1], high = ends[i];
        const bool above = value(low) >= isovalue;
        if (above == (value(high) >= isovalue)) continue;
        for (int n = 0; n < 50; ++n) ((value((low + high) / 2) >= isovalue) == above ? low : high) = (low + high) / 2;
        Crossing crossing{high, {}, surface};
        for (std::size_t c = 0; c < 3; ++c) {
          const auto begin = float(cell[int(c)]);  // single precision must not move the crossing into another cell
          crossing.position[c] = std::clamp(float(at(c, high)), begin, std::nextafter(begin + 1, begin));
        }
        crossings.push_back(crossing);
      }
    }
  }

  // Those up to `before`.
  void AddCrossings(std::deque<Crossing>& crossings, double before, std::array<float, 4>& sum) const {
    for (; !crossings.empty() && crossings.front().at <= before; crossings.pop_front()) {
      const Crossing& crossing = crossings.front();
      double diffuse = 1, specular = 0;
      if (look_.phong) Shade(GradientAt(crossing.position), diffuse, specular);
      const float* const rgba = &look_.surface_looks[4 * crossing.surface];
      Blend(rgba, double(rgba[3]), diffuse, specular, sum);
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
    const Float3 gradient = GradientAt(p);
    double opacity = double(rgba[3]);
    if (!look_.gradient_factors.empty()) {
      opacity *= GradientFactor(gradient);
      steps *= double(look_.step_exponent);
    }
    double diffuse = 1, specular = 0;
    if (look_.phong) Shade(face != nullptr ? *face : gradient, diffuse, specular);
    Blend(rgba, 1 - std::pow(1 - opacity, steps), diffuse, specular, sum);
  }

  // What lies behind `sum`.
  static void Blend(const float* color, double opacity, double diffuse, double specular, std::array<float, 4>& sum) {
    const double weight = (1 - double(sum[3])) * opacity;
    for (std::size_t c = 0; c < 3; ++c) sum[c] += float(weight * std::clamp(double(color[c]) * diffuse + specular, 0.0, 1.0));
    sum[3] += float(weight);
  }

  // Differences over two voxels.
  Float3 GradientAt(const Float3& p) const {
    return {Interpolated(p, {1, 0, 0}) - Interpolated(p, {-1, 0, 0}), Interpolated(p, {0, 1, 0}) - Interpolated(p, {0, -1, 0}),
            Interpolated(p, {0, 0, 1}) - Interpolated(p, {0, 0, -1})};
  }

  double GradientFactor(const Float3& gradient) const {
    double square = 0;
    for (std::size_t i = 0; i < 3; ++i) square += std::pow(double(gradient[i]) * double(look_.inverse_spacing[i]), 2);
    const double magnitude = std::isfinite(square) ? std::sqrt(square) : 0;
    return double(
        look_.gradient_factors[std::size_t(std::min(magnitude * double(look_.gradient_scale) + 0.5, double(look_.gradient_last)))]);
  }

  void Shade(const Float3& normal, double& diffuse, double& specular) const {
    const double gradient[3] = {double(normal[0]), double(normal[1]), double(normal[2])};
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
