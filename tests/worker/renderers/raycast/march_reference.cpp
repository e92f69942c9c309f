#include "tests/worker/renderers/raycast/march_reference.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <type_traits>
#include <vector>

#include "common/frame/smooth_label.h"
#include "tests/worker/rays/pixel_ray.h"
#include "tests/worker/rays/whole_weights.h"

namespace slabstream::testing {
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

  // What the volume or another field has of a sample.
  struct Part {
    double opacity = 0;  // of a step
    std::array<double, 3> color{};
  };
  // A sample of the volume, or of another field whose work this is, lit.
  Part LitPartAt(const Float3& p, const Float3* face) const {
    const ValueAndGradient at = SampleAt(p);
    Part part = PartOf(EntryAt(look_, at.value));
    Light(face != nullptr ? *face : at.gradient, part);
    return part;
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
      Add(ray, k, before + behind, float(k) < part.face_end ? &part.face : nullptr, sum);
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
      const float* const rgba = &look_.surface_looks[4 * crossing.surface];
      Part surface = {.opacity = double(rgba[3]), .color = {double(rgba[0]), double(rgba[1]), double(rgba[2])}};
      if (work_.labels != nullptr) {
        const LabelTables& tables = work_.labels->tables;
        const float* const entry = &tables.entries[4 * LabelAt(AmongLabels(crossing.position)).label];
        if (entry[3] >= 0) {
          surface.opacity *= tables.surface ? 0 : double(entry[3]);
          Tint(entry, surface);
        }
      }
      Light(LitGradientAt(crossing.position), surface);
      Blend(surface.color, surface.opacity, sum);
    }
  }

  static bool Inside(const Float3& p, const Float3& low, const Float3& high) {
    bool inside = true;
    for (std::size_t i = 0; i < 3; ++i) inside = inside && p[i] >= low[i] && p[i] < high[i];
    return inside;
  }
  const T* samples() const { return reinterpret_cast<const T*>(box_.samples); }
  std::int64_t IndexOf(std::int32_t x, std::int32_t y, std::int32_t z) const {
    return std::int64_t{box_.slice} * (z - box_.origin.z + 1) + std::int64_t{box_.row} * (y - box_.origin.y + 1) + (x - box_.origin.x + 1);
  }
  float Voxel(std::int32_t x, std::int32_t y, std::int32_t z) const { return float(samples()[IndexOf(x, y, z)]); }

  // `of`: samples of the volume.
  template <class S>
  float Interpolated(const S* of, const Float3& p, const Index3& shift) const {
    const std::int32_t x = std::int32_t(std::floor(p[0])), y = std::int32_t(std::floor(p[1])), z = std::int32_t(std::floor(p[2]));
    const float u = p[0] - std::floor(p[0]), v = p[1] - std::floor(p[1]), w = p[2] - std::floor(p[2]);
    const auto row = [&](int dy, int dz) {
      const std::int64_t at = IndexOf(x + shift.x, y + dy + shift.y, z + dz + shift.z);
      return Lerp(u, float(of[at]), float(of[at + 1]));
    };
    return Lerp(w, Lerp(v, row(0, 0), row(1, 0)), Lerp(v, row(0, 1), row(1, 1)));
  }

  // Null: the sample is not finite.
  static const float* EntryAt(const RayLook& look, float sample) {
    if (!std::isfinite(sample)) return nullptr;
    return &look.entries[4 * std::size_t(std::clamp((sample - look.origin) * look.scale + look.rounding, 0.0F, look.last))];
  }
  static Part PartOf(const float* entry) {
    if (entry == nullptr) return {};
    return {.opacity = double(entry[3]), .color = {double(entry[0]), double(entry[1]), double(entry[2])}};
  }

  // `steps`: the length that the sample stands for. `face`: the normal of the cut face that it lies on, or null.
  void Add(const PixelRay& ray, std::int32_t k, double steps, const Float3* face, std::array<float, 4>& sum) const {
    const Float3 p = SamplePosition(ray, k);
    const ValueAndGradient at = SampleAt(p);
    Part volume = PartOf(EntryAt(look_, at.value));
    Float3 gradient = at.gradient;
    if (!look_.gradient_factors.empty()) {
      const Float3 central = work_.smooth ? GradientAt(p) : gradient;
      volume.opacity = 1 - std::pow(1 - volume.opacity * GradientFactor(central), double(look_.step_exponent));
    }
    if (work_.labels != nullptr) AddLabel(p, volume, gradient);
    if (work_.fields != nullptr) {
      Light(face != nullptr ? *face : gradient, volume);
      return AddMixed(ray, k, steps, face, volume, sum);
    }
    if (!(volume.opacity > 0)) return;
    Light(face != nullptr ? *face : gradient, volume);
    Blend(volume.color, 1 - std::pow(1 - volume.opacity, steps), sum);
  }

  // The volume's part of a sample and those of other fields.
  void AddMixed(const PixelRay& ray, std::int32_t k, double steps, const Float3* face, const Part& volume,
                std::array<float, 4>& sum) const {
    double weight = volume.opacity, transmittance = 1 - volume.opacity;
    std::array<double, 3> color{};
    for (std::size_t c = 0; c < 3; ++c) color.at(c) = volume.opacity * volume.color.at(c);
    for (const RayField& field : work_.fields->fields.subspan(1)) {
      const auto by = [](const std::array<Float3, 3>& columns, const Float3& v) {
        Float3 sum_of{};
        for (std::size_t i = 0; i < 3; ++i) sum_of.at(i) = v[0] * columns[0].at(i) + v[1] * columns[1].at(i) + v[2] * columns[2].at(i);
        return sum_of;
      };
      PixelRay among = {by(field.map.steps, ray.first), by(field.map.steps, ray.move)};
      for (std::size_t i = 0; i < 3; ++i) among.first.at(i) += field.map.offset.at(i);
      const Float3 there = SamplePosition(among, k), face_there = face != nullptr ? by(field.normals, *face) : Float3{};
      if (!Inside(there, field.map.low, field.map.high)) continue;
      const MarchWork of_field = {.box = &field.voxels, .look = field.look, .smooth = work_.smooth};
      const auto [opacity, lit] = VisitScalarType(field.voxels.type, [&]<class S>(const S*) {
        const auto part = ReferenceMarch<S>(of_field).LitPartAt(there, face != nullptr ? &face_there : nullptr);
        return std::pair(part.opacity, part.color);
      });
      if (!(opacity > 0)) continue;
      if (field.over) {
        const double cover = 1 - std::pow(1 - opacity, double(field.steps_a_length));
        weight *= 1 - cover;
        for (double& of : color) of *= 1 - cover;
        transmittance = transmittance > 0 ? std::pow(transmittance, 1 - cover) : 0;
      }
      weight += opacity;
      for (std::size_t c = 0; c < 3; ++c) color.at(c) += opacity * lit.at(c);
      transmittance *= 1 - opacity;
    }
    if (!(weight > 0)) return;
    for (double& of : color) of /= work_.fields->flat ? 1 - transmittance : weight;
    Blend(color, 1 - std::pow(transmittance, steps), sum);
  }

  // What lies behind `sum`.
  static void Blend(const std::array<double, 3>& color, double opacity, std::array<float, 4>& sum) {
    const double weight = (1 - double(sum[3])) * opacity;
    for (std::size_t c = 0; c < 3; ++c) sum.at(c) += float(weight * color.at(c));
    sum[3] += float(weight);
  }

  // A position of the volume, on the grid of the labels. To the same bit as kernels: half-way between two voxels a bit decides.
  Float3 AmongLabels(const Float3& p) const {
    const RayLabels& labels = *work_.labels;
    Float3 there{};
    for (std::size_t i = 0; i < 3; ++i) {
      there.at(i) = labels.offset[i] + p[0] * labels.steps[0][i] + p[1] * labels.steps[1][i] + p[2] * labels.steps[2][i];
    }
    return there;
  }
  // The number of a voxel of the labels.
  std::uint32_t LabelOf(std::int32_t x, std::int32_t y, std::int32_t z) const {
    const RayBox& voxels = work_.labels->voxels;
    const std::int64_t index = std::int64_t{voxels.slice} * (z - voxels.origin.z + 1) +
                               std::int64_t{voxels.row} * (y - voxels.origin.y + 1) + (x - voxels.origin.x + 1);
    return VisitLabelType(voxels.type, [&]<class L>(const L*) { return std::uint32_t(reinterpret_cast<const L*>(voxels.samples)[index]); });
  }
  LabelledVoxel VoxelOf(std::uint32_t label) const { return {label, double(work_.labels->tables.entries[4 * std::size_t(label) + 3])}; }
  // At a position on the grid of the labels: of the nearest voxel, or smoothed. Outside of the grid there is none.
  LabelledVoxel LabelAt(const Float3& p) const {
    if (!Inside(p, work_.labels->low, work_.labels->high)) return VoxelOf(0);
    if (work_.labels->tables.smooth) {
      const auto first = [&](std::size_t i) { return std::int32_t(std::floor(p.at(i))) - 1; };
      const auto fraction = [&](std::size_t i) { return double(p.at(i)) - std::floor(double(p.at(i))); };
      std::array<LabelledVoxel, 64> around;
      for (std::int32_t i = 0; i < 64; ++i)
        around.at(std::size_t(i)) = VoxelOf(LabelOf(first(0) + i % 4, first(1) + i / 4 % 4, first(2) + i / 16));
      return SmoothLabel(around, {fraction(0), fraction(1), fraction(2)});
    }
    const auto nearest = [&](std::size_t i) {
      const float floor = std::floor(p.at(i));
      return std::int32_t(floor) + (p.at(i) - floor >= 0.5F ? 1 : 0);
    };
    return VoxelOf(LabelOf(nearest(0), nearest(1), nearest(2)));
  }

  void Tint(const float* entry, Part& volume) const {
    for (std::size_t c = 0; c < 3; ++c) volume.color.at(c) += double(work_.labels->tables.tint) * (double(entry[c]) - volume.color.at(c));
  }

  void AddLabel(const Float3& p, Part& volume, Float3& gradient) const {
    const LabelTables& tables = work_.labels->tables;
    const Float3 there = AmongLabels(p);
    const LabelledVoxel label = LabelAt(there);
    const float* const entry = &tables.entries[4 * label.label];
    if (entry[3] < 0) return;
    if (tables.surface) {
      volume = PartOf(entry);
      gradient = MembershipGradient(there, label);
      return;
    }
    const double steps = double(tables.steps_a_length), of_length = 1 - std::pow(1 - volume.opacity, steps);
    if (entry[3] < 1) volume.opacity = 1 - std::pow(1 - double(entry[3]) * of_length, 1 / steps);
    Tint(entry, volume);
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

  // Whether a voxel is one of those of which the normal is that of the border. Beyond the padding the last one is repeated.
  bool IsMember(const std::array<std::int32_t, 3>& voxel, const LabelledVoxel& label) const {
    const RayBox& voxels = work_.labels->voxels;
    const auto within = [&](int i) {
      return std::clamp(voxel.at(std::size_t(i)), voxels.origin[i] - 1, voxels.origin[i] + voxels.padded[i] - 2);
    };
    const LabelledVoxel there = VoxelOf(LabelOf(within(0), within(1), within(2)));
    return work_.labels->tables.smooth ? there.opacity >= label.opacity : there.label == label.label;
  }
  // `p`: on the grid of the labels. The gradient is along the volume's axes.
  Float3 MembershipGradient(const Float3& p, const LabelledVoxel& label) const {
    const int shifts = work_.labels->tables.smooth ? 1 : 0, reach = 2 + shifts;  // it is the mean of places that are so far away
    const auto mean = [&](double distance, double (*of)(double)) {
      double sum = 0;
      for (int shift = -shifts; shift <= shifts; ++shift) sum += of(distance + shift);
      return sum / (2 * shifts + 1);
    };
    const auto floor = [&](std::size_t i) { return std::int32_t(std::floor(p.at(i))); };
    std::array<double, 3> gradient{};
    for (std::int32_t z = floor(2) - reach + 1; z <= floor(2) + reach; ++z) {
      for (std::int32_t y = floor(1) - reach + 1; y <= floor(1) + reach; ++y) {
        for (std::int32_t x = floor(0) - reach + 1; x <= floor(0) + reach; ++x) {
          if (!IsMember({x, y, z}, label)) continue;
          const double dx = double(p[0]) - x, dy = double(p[1]) - y, dz = double(p[2]) - z;
          gradient[0] += mean(dx, SplineSlope) * mean(dy, Spline) * mean(dz, Spline);
          gradient[1] += mean(dx, Spline) * mean(dy, SplineSlope) * mean(dz, Spline);
          gradient[2] += mean(dx, Spline) * mean(dy, Spline) * mean(dz, SplineSlope);
        }
      }
    }
    const double square = gradient[0] * gradient[0] + gradient[1] * gradient[1] + gradient[2] * gradient[2];
    Float3 of_volume{};
    if (!(square > 1e-4)) return of_volume;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (std::size_t i = 0; i < 3; ++i) of_volume.at(axis) += float(gradient.at(i)) * work_.labels->steps.at(axis).at(i);
    }
    return of_volume;
  }

  // Lights the colour of a part.
  void Light(const Float3& gradient, Part& part) const {
    double diffuse = 1, specular = 0;
    if (look_.phong) Shade(gradient, diffuse, specular);
    for (double& channel : part.color) channel = std::clamp(channel * diffuse + specular, 0.0, 1.0);
  }

  // Differences over two voxels.
  Float3 GradientAt(const Float3& p) const {
    const T* const of = samples();
    return {Interpolated(of, p, {1, 0, 0}) - Interpolated(of, p, {-1, 0, 0}),
            Interpolated(of, p, {0, 1, 0}) - Interpolated(of, p, {0, -1, 0}),
            Interpolated(of, p, {0, 0, 1}) - Interpolated(of, p, {0, 0, -1})};
  }
  // The difference of the slices before and behind a voxel, each smoothed by (1, 2, 1) / 4 along its two axes.
  double SmoothSlope(const Index3& voxel, int axis) const {
    double sum = 0;
    for (int a = -1; a <= 1; ++a) {
      for (int b = -1; b <= 1; ++b) {
        Index3 behind = voxel;
        behind[(axis + 1) % 3] += a;
        behind[(axis + 2) % 3] += b;
        Index3 before = behind;
        ++behind[axis];
        --before[axis];
        const double difference = double(Voxel(behind.x, behind.y, behind.z)) - double(Voxel(before.x, before.y, before.z));
        sum += (2 - std::abs(a)) * (2 - std::abs(b)) / 16.0 * difference;
      }
    }
    return sum;
  }
  // That of light, from the eight voxels around.
  Float3 LitGradientAt(const Float3& p) const {
    if (!work_.smooth) return GradientAt(p);
    const Float3 floor = {std::floor(p[0]), std::floor(p[1]), std::floor(p[2])};
    double sums[3] = {};
    for (int corner = 0; corner < 8; ++corner) {
      Index3 voxel;
      double weight = 1;
      for (int i = 0; i < 3; ++i) {
        const int upper = corner >> i & 1;
        const double fraction = double(p.at(std::size_t(i)) - floor.at(std::size_t(i)));
        voxel[i] = std::int32_t(floor.at(std::size_t(i))) + upper;
        weight *= upper != 0 ? fraction : 1 - fraction;
      }
      for (int i = 0; i < 3; ++i) sums[i] += weight * SmoothSlope(voxel, i);
    }
    return {float(sums[0]), float(sums[1]), float(sums[2])};
  }

  // Of whole numbers: eight weights in 2^-14, which sum to 1.
  struct ValueAndGradient {
    float value;
    Float3 gradient;
  };
  ValueAndGradient SampleAt(const Float3& p) const {
    return std::is_same_v<T, float> ? ValueAndGradient{Interpolated(samples(), p, {}), LitGradientAt(p)} : AtWholeWeights(p);
  }
  ValueAndGradient AtWholeWeights(const Float3& p) const {
    const Float3 floor = {std::floor(p[0]), std::floor(p[1]), std::floor(p[2])};
    double sums[4] = {};
    for (int corner = 0; corner < 8; ++corner) {
      const int dx = corner & 1, dy = corner >> 1 & 1, dz = corner >> 2;
      const double weight = WholeWeight({p[0] - floor[0], p[1] - floor[1], p[2] - floor[2]}, corner);
      const std::array<double, 4> voxel =
          VoxelAndGradient(std::int32_t(floor[0]) + dx, std::int32_t(floor[1]) + dy, std::int32_t(floor[2]) + dz);
      for (std::size_t i = 0; i < 4; ++i) sums[i] += weight / 16384 * voxel[i];
    }
    return {float(sums[0]), {float(sums[1]), float(sums[2]), float(sums[3])}};
  }
  // Differences over two voxels; those of halved samples where one of the three does not fit into 16 bits. Smoothed ones of 16-bit samples
  // are rounded.
  std::array<double, 4> VoxelAndGradient(std::int32_t x, std::int32_t y, std::int32_t z) const {
    if (work_.smooth) {
      std::array<double, 3> d = {SmoothSlope({x, y, z}, 0), SmoothSlope({x, y, z}, 1), SmoothSlope({x, y, z}, 2)};
      const bool large = std::max({std::abs(d[0]), std::abs(d[1]), std::abs(d[2])}) > 32767;
      if (sizeof(T) == 2) std::ranges::transform(d, d.begin(), [&](double slope) { return std::nearbyint(large ? slope / 2 : slope); });
      return {double(Voxel(x, y, z)), d[0], d[1], d[2]};
    }
    const auto differences = [&](int divisor) {
      const auto voxel = [&](int dx, int dy, int dz) { return std::floor(double(Voxel(x + dx, y + dy, z + dz)) / divisor); };
      return std::array<double, 3>{voxel(1, 0, 0) - voxel(-1, 0, 0), voxel(0, 1, 0) - voxel(0, -1, 0), voxel(0, 0, 1) - voxel(0, 0, -1)};
    };
    std::array<double, 3> d = differences(1);
    if (std::max({std::abs(d[0]), std::abs(d[1]), std::abs(d[2])}) > 32767) d = differences(2);
    return {double(Voxel(x, y, z)), d[0], d[1], d[2]};
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
      diffuse = double(look_.ambient) + double(look_.diffuse) * 0.5 * double(look_.lights.size());  // Phong::WithoutGradient
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

}  // namespace slabstream::testing
