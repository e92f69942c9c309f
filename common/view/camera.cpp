#include "common/view/camera.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/view/range_status.h"

namespace slabstream {
namespace {

struct SinCos {
  double sin, cos;
};

// Exact at multiples of 90 degrees, so that axis-parallel views have axis-parallel rays.
SinCos SinCosDegrees(double degrees) {
  int quadrant = 0;
  const double rest = std::remquo(degrees, 90.0, &quadrant) * (std::numbers::pi / 180);
  const double s = std::sin(rest), c = std::cos(rest);
  switch (quadrant & 3) {
    case 0: return {s, c};
    case 1: return {c, -s};
    case 2: return {-s, -c};
    default: return {-c, s};
  }
}

// Orthonormal: right, up and the view direction, in physical space. Azimuth and elevation turn a sphere's tangent frame, which exists at
// the poles too, so that elevation +-90 needs no special case.
struct Frame {
  Vec3 right, up, forward;
};

Frame ViewFrame(const ViewParameters& view) {
  const auto [sin_azimuth, cos_azimuth] = SinCosDegrees(view.azimuth_degrees);
  const auto [sin_elevation, cos_elevation] = SinCosDegrees(view.elevation_degrees);
  const auto [sin_roll, cos_roll] = SinCosDegrees(view.roll_degrees);
  const Vec3 right = {cos_azimuth, sin_azimuth, 0};
  const Vec3 up = {-sin_elevation * sin_azimuth, sin_elevation * cos_azimuth, cos_elevation};
  const Vec3 forward = {-cos_elevation * sin_azimuth, cos_elevation * cos_azimuth, -sin_elevation};
  return {cos_roll * right + sin_roll * up, cos_roll * up - sin_roll * right, forward};
}

// The data axis nearest to `direction`. The tolerance keeps rounding noise from choosing between axes that tie (azimuth 45).
Axis NearestAxis(const Vec3& direction) {
  constexpr double kTie = 1e-9;
  Axis nearest = Axis::kZ;
  for (Axis axis : {Axis::kY, Axis::kX}) {
    if (std::abs(direction[axis]) > std::abs(direction[nearest]) + kTie) nearest = axis;
  }
  return nearest;
}

// Row of a data-space form: data point p -> scale * Dot(direction, spacing * (p - centre)) + offset.
std::array<double, 4> Row(const Vec3& direction, double scale, double offset, const Vec3& spacing, const Vec3& centre) {
  const Vec3 row = scale * (direction * spacing);
  return {row.x, row.y, row.z, offset - Dot(row, centre)};
}

double Apply(const std::array<double, 4>& row, const Vec3& p) { return row[0] * p.x + row[1] * p.y + row[2] * p.z + row[3]; }

Vec3 Linear(const std::array<double, 4>& row) { return {row[0], row[1], row[2]}; }

}  // namespace

Status Validate(const ViewParameters& view) {
  if (view.projection != Projection::kOrthographic && view.projection != Projection::kPerspective) {
    return Status::InvalidArgument(
        fmt::format("view.projection is {}, but must be 1 (orthographic) or 2 (perspective)", int(view.projection)));
  }
  if (Status s = InRange("view.azimuth", view.azimuth_degrees, -kMaxAngleDegrees, kMaxAngleDegrees); !s.ok()) return s;
  if (Status s = InRange("view.elevation", view.elevation_degrees, -kMaxAngleDegrees, kMaxAngleDegrees); !s.ok()) return s;
  if (Status s = InRange("view.roll", view.roll_degrees, -kMaxAngleDegrees, kMaxAngleDegrees); !s.ok()) return s;
  if (Status s = InRange("view.zoom", view.zoom, kMinZoom, kMaxZoom); !s.ok()) return s;
  return InRange("view.fov", view.fov_degrees, kMinFovDegrees, kMaxFovDegrees);
}

Status Validate(const ImageSize& size) {
  if (Status s = InRange("size.width", size.width, 1, kMaxImageSide); !s.ok()) return s;
  if (Status s = InRange("size.height", size.height, 1, kMaxImageSide); !s.ok()) return s;
  return InRange("size.width * size.height", double(size.width) * size.height, 1, double(kMaxImagePixels));
}

Camera MakeCamera(const ViewParameters& view, ImageSize size, const VolumeGeometry& geometry, bool supersampled) {
  const bool perspective = view.projection == Projection::kPerspective;
  const Vec3 spacing = geometry.spacing;
  const Vec3 extent = ToVec3(geometry.size) * spacing;
  const Vec3 centre = 0.5 * (ToVec3(geometry.size) - Vec3{1, 1, 1});
  const double radius = 0.5 * Length(extent);
  const Frame frame = ViewFrame(view);

  // From the volume's centre to the eye plane, and pixels a physical unit at unit depth (perspective) or everywhere (orthographic).
  const double half_fov = view.fov_degrees * (std::numbers::pi / 360);
  const double distance = perspective ? radius / std::sin(half_fov) : 2 * radius;
  const double half_side = 0.5 * std::min(size.width, size.height);
  double scale = view.zoom * half_side / (perspective ? std::tan(half_fov) : radius);

  // Supersampling by the farthest point of the bounding sphere, so that it does not change while the view turns.
  const double pixel_width = (perspective ? distance + radius : 1.0) / scale;
  const double voxel_width = std::min({spacing.x, spacing.y, spacing.z});
  int supersample = 1;
  while (supersampled && supersample < kMaxSupersample && pixel_width > kMaxVoxelsPerPixel * voxel_width * supersample) supersample *= 2;
  scale *= supersample;

  Camera camera;
  camera.projection = view.projection;
  camera.width = size.width * supersample;
  camera.height = size.height * supersample;
  camera.supersample = supersample;
  camera.spacing = spacing;
  camera.view_direction = frame.forward;
  camera.right = frame.right;
  camera.up = frame.up;
  camera.eye = centre - distance * (frame.forward / spacing);

  const double middle_x = 0.5 * camera.width, middle_y = 0.5 * camera.height;
  camera.depth_row = Row(frame.forward, 1, distance, spacing, centre);
  if (perspective) {
    camera.w_row = camera.depth_row;
    camera.x_row = Row(scale * frame.right + middle_x * frame.forward, 1, middle_x * distance, spacing, centre);
    camera.y_row = Row(-scale * frame.up + middle_y * frame.forward, 1, middle_y * distance, spacing, centre);
  } else {
    camera.w_row = {0, 0, 0, 1};
    camera.x_row = Row(frame.right, scale, middle_x, spacing, centre);
    camera.y_row = Row(frame.up, -scale, middle_y, spacing, centre);
  }
  camera.traversal_axis = NearestAxis(frame.forward);
  camera.ascending = frame.forward[camera.traversal_axis] > 0;
  return camera;
}

Camera::ImagePoint Camera::Project(const Vec3& data_point) const {
  const double w = Apply(w_row, data_point);
  return {Apply(x_row, data_point) / w, Apply(y_row, data_point) / w, Apply(depth_row, data_point)};
}

Camera::Ray Camera::RayAt(double x, double y) const {
  // x_row holds scale * right (and, under perspective, a multiple of the view direction, to which right is perpendicular).
  const double scale = Dot(Linear(x_row) / spacing, right);
  const Vec3 offset = ((x - 0.5 * width) / scale * right - (y - 0.5 * height) / scale * up) / spacing;
  const Vec3 forward = view_direction / spacing;
  if (projection == Projection::kPerspective) return {eye, forward + offset};
  return {eye + offset, forward};
}

}  // namespace slabstream
