#include "worker/renderers/zbuffer/cut_faces.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "worker/kernels/surface_face.h"

namespace slabstream {
namespace {

constexpr double kSlack = 0x1p-8;  // of the least spacing
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kAlong = 1e-9;        // a ray that comes nearer to a side by less runs along it: physical, a unit of depth
constexpr std::uint32_t kCutAxis = 3;  // of FaceIndex: not the axis of a face

}  // namespace

CutFaces::CutFaces(SlabData& slab, const FrameSetup& setup, const Box& box, const BinSelection& opaque)
    : voxels_(slab.voxels()),
      box_(box),
      keep_(setup.clip.mode == ClipMode::kKeep),
      slack_(kSlack * Least(setup.description.geometry.spacing)),
      table_(slab.Classification(setup)),
      opaque_(opaque),
      bricks_(CubesOver(setup.description.geometry.size, kFaceBrick)) {
  const VolumeGeometry& geometry = setup.description.geometry;
  const Camera& camera = setup.camera;
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
}

void CutFaces::Limits(std::int32_t column, std::int32_t row, std::size_t count, float* from, float* to) const {
  // Side after side along the row, without branches. All is computed from a pixel's own x and y, so that it is the same in every box.
  std::vector<double> enters(count), leaves(count, kInfinity);
  for (const Side& side : sides_) {
    const double start = side.start.At(0, row + 0.5), rise = side.rise.At(0, row + 0.5);
    const auto x = [column](std::size_t n) { return double(column + std::int32_t(n)) + 0.5; };
    const bool parallel = side.rise.by_x == 0;  // the row's rays
    if (parallel && std::abs(rise) >= kAlong) {
      const double first = -start / rise, slope = -side.start.by_x / rise;
      for (std::size_t n = 0; n < count; ++n) {
        const double at = first + slope * x(n);
        enters[n] = rise > 0 && at > enters[n] ? at : enters[n];
        leaves[n] = rise < 0 && at < leaves[n] ? at : leaves[n];
      }
      continue;
    }
    for (std::size_t n = 0; n < count; ++n) {
      const double starts = start + side.start.by_x * x(n), rises = rise + side.rise.by_x * x(n), at = -starts / rises;
      const bool along = std::abs(rises) < kAlong;
      enters[n] = !along && rises > 0 && at > enters[n] ? at : enters[n];
      leaves[n] = along ? (starts < 0 ? -1 : leaves[n]) : rises < 0 && at < leaves[n] ? at : leaves[n];
    }
  }
  const double inwards = keep_ ? slack_ : -slack_;
  for (std::size_t n = 0; n < count; ++n) {
    const bool any = enters[n] <= leaves[n];
    from[n] = float(!any ? kInfinity : enters[n] > 0 ? enters[n] + inwards : 0);
    to[n] = float(any ? leaves[n] - inwards : -1);
  }
}

const CutFaces::Side& CutFaces::CutAt(double x, double y, double depth) const {
  const auto distance = [&](const Side& side) { return std::abs(side.start.At(x, y) + depth * side.rise.At(x, y)); };
  return *std::ranges::min_element(sides_, {}, distance);
}

std::uint16_t CutFaces::BinOf(const Index3& voxel) const {
  return VisitScalarType(voxels_.type, [&]<class T>(const T*) {
    const auto sample = double(voxels_.samples<T>()[voxels_.Offset(voxel)]);
    if (!std::isfinite(sample)) return kNotSelected;
    const auto bin = std::uint16_t(table_.BinOf(sample));
    return opaque_.selected[bin] != 0 ? bin : kNotSelected;
  });
}

void CutFaces::Draw(std::int32_t column, std::int32_t row, std::size_t count, const float* from, const float* to, float* rgba, float* depth,
                    std::uint32_t* voxel) const {
  const float* const behind = keep_ ? from : to;  // a cut by slack_
  for (std::size_t n = 0; n < count; ++n) {
    const double at = double(behind[n]) - slack_;
    if (behind[n] <= 0 || std::isinf(behind[n]) || float(at) > depth[n]) continue;
    // The voxel just behind the cut.
    const double x = column + std::int32_t(n) + 0.5, y = row + 0.5;
    Index3 site;
    for (const Axis axis : kAxes) {
      const auto i = std::size_t(Number(axis));
      const double p = origin_[i].At(x, y) + double(behind[n]) * direction_[i].At(x, y);
      site[axis] = std::int32_t(std::floor(std::clamp(p + 0.5, -1.0, double(kMaxVolumeSide))));
    }
    if (!box_.Contains(site)) continue;
    const std::uint16_t bin = BinOf(site);
    if (bin == kNotSelected) continue;
    const Rgb& color = table_.color[bin];
    const PhongFactors& light = CutAt(x, y, at).light;
    const auto lit = [&](float channel) { return std::clamp(channel * light.diffuse + light.specular, 0.0F, 1.0F); };
    const float pixel[4] = {lit(color.r), lit(color.g), lit(color.b), 1};
    std::copy_n(pixel, 4, rgba + 4 * n);
    depth[n] = float(at);
    voxel[n] = FaceIndex(std::uint32_t(site.x), std::uint32_t(site.y), std::uint32_t(site.z), kCutAxis, std::uint32_t(bricks_.x),
                         std::uint32_t(bricks_.y));
  }
}

}  // namespace slabstream
