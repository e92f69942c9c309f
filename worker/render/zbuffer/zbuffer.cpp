#include "worker/render/zbuffer/zbuffer.h"

#include <cmath>
#include <type_traits>

#include "common/kernels/combine.h"
#include "worker/kernels/phong.h"
#include "worker/render/derived.h"
#include "worker/render/stage_clock.h"
#include "worker/render/zbuffer/pixel_rays.h"
#include "worker/render/zbuffer/surface_normal.h"

namespace slabstream {
namespace {

constexpr std::size_t kCancelInterval = 65536;  // voxels or pixels between two looks at the flag

Vec3 Centre(const SurfaceVoxel& voxel) { return {double(voxel.x), double(voxel.y), double(voxel.z)}; }

// Where cells lie on the screen. Half the size of a cell's projection is at most sum_i |x_i - x w_i| / 2, divided by the least w of the
// cell.
class CellBounds {
 public:
  explicit CellBounds(const Camera& camera) : camera_(camera) {}

  // Pixels whose rays may meet the cell: not exact, PixelRays::Meet decides.
  PixelBounds Of(const Vec3& centre) const {
    const double w = Apply(camera_.w_row, centre), x = Apply(camera_.x_row, centre) / w, y = Apply(camera_.y_row, centre) / w;
    double half_x = 0, half_y = 0, half_w = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      half_x += 0.5 * std::abs(camera_.x_row[i] - x * camera_.w_row[i]);
      half_y += 0.5 * std::abs(camera_.y_row[i] - y * camera_.w_row[i]);
      half_w += 0.5 * std::abs(camera_.w_row[i]);
    }
    constexpr double kSlack = 1e-3;  // pixels, for rounding
    const double least_w = w - half_w;
    half_x = half_x / least_w + kSlack;
    half_y = half_y / least_w + kSlack;
    return {ToPixel(x - half_x - 0.5, camera_.width), ToPixel(y - half_y - 0.5, camera_.height), ToPixel(x + half_x + 0.5, camera_.width),
            ToPixel(y + half_y + 0.5, camera_.height)};
  }

 private:
  static double Apply(const std::array<double, 4>& row, const Vec3& p) { return row[0] * p.x + row[1] * p.y + row[2] * p.z + row[3]; }
  static std::int32_t ToPixel(double x, std::int32_t limit) { return std::int32_t(std::clamp(std::ceil(x), 0.0, double(limit))); }

  const Camera& camera_;
};

// Faces through which a ray can enter the cell, as bits of SurfaceVoxel::open_faces.
class EntryFaces {
 public:
  explicit EntryFaces(const Camera& camera) : perspective_(camera.projection == Projection::kPerspective), eye_(camera.eye) {
    const Vec3 direction = camera.RayAt(0.5 * camera.width, 0.5 * camera.height).direction;
    for (int axis = 0; axis < 3; ++axis) {
      if (direction[axis] > 0) parallel_ |= 1 << (2 * axis);
      if (direction[axis] < 0) parallel_ |= 2 << (2 * axis);
    }
  }

  int Of(const Vec3& centre) const {
    if (!perspective_) return parallel_;
    int faces = 0;
    for (int axis = 0; axis < 3; ++axis) {
      if (eye_[axis] <= centre[axis] - 0.5) faces |= 1 << (2 * axis);
      if (eye_[axis] >= centre[axis] + 0.5) faces |= 2 << (2 * axis);
    }
    return faces;
  }

 private:
  bool perspective_;
  Vec3 eye_;
  int parallel_ = 0;
};

// Low 32 bits of the linear index in the volume.
std::uint32_t VoxelIndex(const SurfaceVoxel& voxel, const Index3& size) {
  return std::uint32_t((std::uint64_t{voxel.z} * std::uint64_t(size.y) + voxel.y) * std::uint64_t(size.x) + voxel.x);
}

// The image of surface voxels: depth and voxel planes, and for each pixel the number of the voxel that is seen (for shading).
struct Visible {
  LocalImage image;
  std::vector<std::uint32_t> number;  // in the list of surface voxels
};

// Pixels that any of the cells can cover: the hull of a box round all of them.
PixelBounds ScreenBounds(const std::vector<SurfaceVoxel>& voxels, const Camera& camera) {
  if (voxels.empty()) return {};
  Vec3 low = Centre(voxels.front()), high = low;
  for (const SurfaceVoxel& voxel : voxels) {
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], Centre(voxel)[axis]);
      high[axis] = std::max(high[axis], Centre(voxel)[axis]);
    }
  }
  const CellBounds cells(camera);
  PixelBounds bounds;
  bool first = true;
  for (double x : {low.x, high.x}) {
    for (double y : {low.y, high.y}) {
      for (double z : {low.z, high.z}) {
        const PixelBounds corner = cells.Of({x, y, z});  // may be empty, at a border of the frame
        bounds = first ? corner
                       : PixelBounds{std::min(bounds.x_begin, corner.x_begin), std::min(bounds.y_begin, corner.y_begin),
                                     std::max(bounds.x_end, corner.x_end), std::max(bounds.y_end, corner.y_end)};
        first = false;
      }
    }
  }
  return bounds.empty() ? PixelBounds{} : bounds;
}

Visible DrawCells(const std::vector<SurfaceVoxel>& voxels, const FrameSetup& setup, const PixelRays& rays,
                  const std::atomic<bool>& cancelled, RankReport& report) {
  const CellBounds cells(setup.camera);
  const EntryFaces entry(setup.camera);
  const auto can_be_seen = [&](const SurfaceVoxel& voxel) { return (entry.Of(Centre(voxel)) & voxel.open_faces) != 0; };
  const PixelBounds bounds = ScreenBounds(voxels, setup.camera);
  Visible visible{MakeLocalImage(PixelFormat::kDepth, bounds), {}};
  visible.number.resize(std::size_t(bounds.pixel_count()));
  for (std::size_t number = 0; number < voxels.size(); ++number) {
    if (number % kCancelInterval == 0 && cancelled) break;
    const SurfaceVoxel& voxel = voxels[number];
    if (!can_be_seen(voxel)) continue;
    const Vec3 centre = Centre(voxel);
    const PixelBounds cell = cells.Of(centre);
    if (cell.empty()) continue;
    ++report.drawn_voxels;
    const std::uint32_t index = VoxelIndex(voxel, setup.description.geometry.size);
    for (std::int32_t y = cell.y_begin; y < cell.y_end; ++y) {
      std::size_t pixel = std::size_t(y - bounds.y_begin) * std::size_t(bounds.width()) + std::size_t(cell.x_begin - bounds.x_begin);
      for (std::int32_t x = cell.x_begin; x < cell.x_end; ++x, ++pixel) {
        const RaySpan span = PixelRays::Meet(rays.At(x, y), centre);
        const auto depth = float(span.enter);
        if (span.enter > span.exit || !NearerDepth(depth, index, visible.image.depth[pixel], visible.image.voxel[pixel])) continue;
        visible.image.depth[pixel] = depth;
        visible.image.voxel[pixel] = index;
        visible.number[pixel] = std::uint32_t(number);
      }
    }
  }
  return visible;
}

int BinOfVoxel(const VoxelBlock& voxels, const ClassificationTable& table, const Index3& voxel) {
  return VisitScalarType(voxels.type, [&](auto* type) {
    return table.BinOf(double(voxels.samples<std::remove_cvref_t<decltype(*type)>>()[voxels.Offset(voxel)]));
  });
}

void ShadePixels(const SlabData& slab, const std::vector<SurfaceVoxel>& voxels, const ClassificationTable& table, const FrameSetup& setup,
                 const PixelRays& rays, const std::atomic<bool>& cancelled, Visible& visible) {
  const Phong phong(setup.shading, setup.camera.view_direction);
  const PixelBounds& bounds = visible.image.bounds;
  std::size_t pixel = 0;
  for (std::int32_t y = bounds.y_begin; y < bounds.y_end; ++y) {
    if (cancelled) return;
    for (std::int32_t x = bounds.x_begin; x < bounds.x_end; ++x, ++pixel) {
      if (std::isinf(visible.image.depth[pixel])) continue;
      const SurfaceVoxel& voxel = voxels[visible.number[pixel]];
      const Rgb& color = table.color[std::size_t(BinOfVoxel(slab.voxels(), table, {voxel.x, voxel.y, voxel.z}))];
      PhongFactors factors = phong.WithoutGradient();
      if (setup.shading.phong) {
        const PixelRays::Ray ray = rays.At(x, y);
        const Vec3 centre = Centre(voxel);
        Vec3 hit = ray.origin + PixelRays::Meet(ray, centre).enter * ray.direction;
        for (int axis = 0; axis < 3; ++axis) hit[axis] = std::clamp(hit[axis], centre[axis] - 0.5, centre[axis] + 0.5);
        const Vec3 gradient = GradientAt(slab.voxels(), setup.camera.spacing, {voxel.x, voxel.y, voxel.z}, hit);
        const double length = Length(gradient);
        if (length > 0 && std::isfinite(length)) factors = phong.AtNormal((1 / length) * gradient);
      }
      float* rgba = &visible.image.rgba[4 * pixel];
      const float channels[3] = {color.r, color.g, color.b};
      for (int c = 0; c < 3; ++c) rgba[c] = std::clamp(channels[c] * factors.diffuse + factors.specular, 0.0F, 1.0F);
      rgba[3] = 1;
    }
  }
}

}  // namespace

Result<LocalImage> ZBufferRenderer::Render(SlabData& slab, const Box& box, const FrameSetup& setup, const std::atomic<bool>& cancelled,
                                           RankReport& report) {
  StageClock clock(report);
  const ClassificationTable& table = slab.derived().Classification(setup);
  const std::vector<SurfaceVoxel>& voxels = slab.derived().Surface(setup, box);
  clock.Charge(Stage::kPrepare);
  const PixelRays rays(setup.camera);
  Visible visible = DrawCells(voxels, setup, rays, cancelled, report);
  clock.Charge(Stage::kZBuffer);
  ShadePixels(slab, voxels, table, setup, rays, cancelled, visible);
  clock.Charge(Stage::kShade);
  clock.Finish(Stage::kRender);
  if (cancelled) return Status::Cancelled("rendering was cancelled");
  return std::move(visible.image);
}

}  // namespace slabstream
