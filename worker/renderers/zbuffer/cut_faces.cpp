#include "worker/renderers/zbuffer/cut_faces.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

#include "worker/kernels/surface_face.h"

namespace slabstream {
namespace {

constexpr double kSlack = 0x1p-8;  // of the least spacing
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::uint32_t kCutAxis = 3;  // of FaceIndex: not the axis of a face

}  // namespace

CutFaces::CutFaces(SlabData& slab, const FrameSetup& setup, const Box& box, const BinSelection& opaque)
    : voxels_(slab.voxels()), box_(box), keep_(setup.clip.mode == ClipMode::kKeep), table_(slab.Classification(setup)), opaque_(opaque) {
  const VolumeGeometry& geometry = setup.description.geometry;
  const Camera& camera = setup.camera;
  slack_ = kSlack * std::min({geometry.spacing.x, geometry.spacing.y, geometry.spacing.z});
  bricks_x_ = std::uint32_t(geometry.size.x + kFaceBrick - 1) / kFaceBrick;
  bricks_y_ = std::uint32_t(geometry.size.y + kFaceBrick - 1) / kFaceBrick;

  const Camera::Ray first = camera.RayAt(0, 0), right = camera.RayAt(camera.width, 0), down = camera.RayAt(0, camera.height);
  const auto linear = [&](double at_0, double at_right, double at_bottom) {
    return Linear{at_0, (at_right - at_0) / camera.width, (at_bottom - at_0) / camera.height};
  };
  for (const Axis axis : kAxes) {
    const auto i = std::size_t(Number(axis));
    origin_[i] = linear(first.origin[axis], right.origin[axis], down.origin[axis]);
    direction_[i] = linear(first.direction[axis], right.direction[axis], down.direction[axis]);
  }
  const Phong phong(setup.shading, camera.view_direction);
  for (const HalfSpace& side : setup.clip.sides) {
    const auto along = [&](const Vec3& v) { return Dot(side.normal, v); };
    const bool lit = setup.shading.model == ShadingModel::kPhong;
    sides_.push_back({linear(side.Distance(first.origin), side.Distance(right.origin), side.Distance(down.origin)),
                      linear(along(first.direction), along(right.direction), along(down.direction)),
                      lit ? phong.AtNormal(Normalized(side.normal / geometry.spacing)) : PhongFactors{}});
  }
  VisitScalarType(voxels_.type, [&]<class T>(const T*) {
    if constexpr (std::is_integral_v<T>) {
      const BinLookup<T> lookup(table_, opaque_);
      for (std::size_t sample = 0; sample <= std::numeric_limits<T>::max(); ++sample) bins_.push_back(lookup(T(sample)));
    }
  });
}

CutFaces::Crossing CutFaces::CrossingOf(std::int32_t column, std::int32_t row) const {
  const double x = column + 0.5, y = row + 0.5;
  Crossing crossing{0, kInfinity, nullptr, nullptr};
  for (const Side& side : sides_) {
    const double start = side.start.At(x, y), rise = side.rise.At(x, y), at = -start / rise;
    if (std::abs(rise) < 1e-9) {
      if (start < 0) crossing.to = -1;
    } else if (rise > 0) {
      if (at <= crossing.from) continue;
      crossing.from = at;
      crossing.in = &side;
    } else if (at < crossing.to) {
      crossing.to = at;
      crossing.out = &side;
    }
  }
  return crossing;
}

void CutFaces::Limits(std::int32_t column, std::int32_t row, std::size_t count, float* from, float* to) const {
  const double inwards = keep_ ? slack_ : -slack_;
  for (std::size_t n = 0; n < count; ++n) {
    const Crossing crossing = CrossingOf(column + std::int32_t(n), row);
    const bool any = crossing.from <= crossing.to;
    from[n] = float(any && crossing.in != nullptr ? crossing.from + inwards : any ? 0 : kInfinity);
    to[n] = float(any ? crossing.to - inwards : -1);
  }
}

std::uint16_t CutFaces::BinOf(const Index3& voxel) const {
  const auto at = std::size_t(voxels_.Offset(voxel));
  switch (voxels_.type) {
    case ScalarType::kUint8: return bins_[voxels_.samples<std::uint8_t>()[at]];
    case ScalarType::kUint16: return bins_[voxels_.samples<std::uint16_t>()[at]];
    case ScalarType::kFloat32: break;
  }
  const float sample = voxels_.samples<float>()[at];
  if (!std::isfinite(sample)) return kNotSelected;
  const int bin = table_.BinOf(double(sample));
  return opaque_.selected[std::size_t(bin)] != 0 ? std::uint16_t(bin) : kNotSelected;
}

void CutFaces::Draw(std::int32_t column, std::int32_t row, std::size_t count, float* rgba, float* depth, std::uint32_t* voxel) const {
  for (std::size_t n = 0; n < count; ++n) {
    const Crossing crossing = CrossingOf(column + std::int32_t(n), row);
    if (crossing.from > crossing.to) continue;
    const Side* const side = keep_ ? crossing.in : crossing.out;
    const double at = keep_ ? crossing.from : crossing.to;
    if (side == nullptr || float(at) > depth[n]) continue;
    // The voxel just behind the cut.
    const double x = column + std::int32_t(n) + 0.5, y = row + 0.5;
    Index3 site;
    for (const Axis axis : kAxes) {
      const auto i = std::size_t(Number(axis));
      const double p = origin_[i].At(x, y) + (at + slack_) * direction_[i].At(x, y);
      site[axis] = std::int32_t(std::floor(std::clamp(p + 0.5, -1.0, double(kMaxVolumeSide))));
    }
    if (!box_.Contains(site)) continue;
    const std::uint16_t bin = BinOf(site);
    if (bin == kNotSelected) continue;
    const Rgb& color = table_.color[bin];
    const auto lit = [&](float channel) { return std::clamp(channel * side->light.diffuse + side->light.specular, 0.0F, 1.0F); };
    const float pixel[4] = {lit(color.r), lit(color.g), lit(color.b), 1};
    std::copy_n(pixel, 4, rgba + 4 * n);
    depth[n] = float(at);
    voxel[n] = FaceIndex(std::uint32_t(site.x), std::uint32_t(site.y), std::uint32_t(site.z), kCutAxis, bricks_x_, bricks_y_);
  }
}

}  // namespace slabstream
