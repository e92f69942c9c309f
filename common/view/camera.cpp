#include "common/view/camera.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/math/row4.h"
#include "common/view/supersampled_voxel.h"

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

constexpr double kParallel = 1e-6;  // the length of the cross product of two unit vectors that are

Vec3 ExtentOf(const VolumeGeometry& geometry) { return ToVec3(geometry.size) * geometry.spacing; }
double HalfFov(const ViewParameters& view) { return view.fov_degrees * (std::numbers::pi / 360); }

// From an eye that is given.
ViewAxes AxesFromEye(const ViewParameters& view, const Vec3& target) {
  const Vec3 forward = Normalized(target - *view.eye);
  Vec3 right = Cross(forward, view.up ? Normalized(*view.up) : Vec3{0, 0, 1});
  if (Length(right) < kParallel) right = Cross(forward, {0, 1, 0});
  right = Normalized(right);
  return {right, Cross(right, forward), forward};
}

// Azimuth and elevation turn a sphere's tangent frame, which exists at the poles too, so that elevation +-90 needs no special case.
ViewAxes AxesByAngles(const ViewParameters& view) {
  const auto [sin_azimuth, cos_azimuth] = SinCosDegrees(view.azimuth_degrees.value_or(0));
  const auto [sin_elevation, cos_elevation] = SinCosDegrees(view.elevation_degrees.value_or(0));
  const Vec3 right = {cos_azimuth, sin_azimuth, 0};
  const Vec3 up = {-sin_elevation * sin_azimuth, sin_elevation * cos_azimuth, cos_elevation};
  const Vec3 forward = {-cos_elevation * sin_azimuth, cos_elevation * cos_azimuth, -sin_elevation};
  return {right, up, forward};
}

// What a view is of a volume, in physical space.
struct Look {
  ViewAxes axes;
  Vec3 target;          // of the picture's centre
  double distance = 0;  // from the target to the eye (perspective), or to the eye plane
};

Look LookOf(const ViewParameters& view, const VolumeGeometry& geometry) {
  const Orientation& orientation = geometry.orientation;
  const Vec3 centre = geometry.ToWorld(geometry.centre());
  const Vec3 target = view.look_at.value_or(centre);
  const double radius = BoundingRadius(geometry);
  const ViewAxes axes = AxesOf(view, target);
  Look look;
  look.axes = {orientation.FromWorld(axes.right), orientation.FromWorld(axes.up), orientation.FromWorld(axes.forward)};
  if (view.look_at) look.target = orientation.FromWorld(target - centre);
  if (view.projection != Projection::kPerspective) {
    // The eye plane stands 2 R before the volume's centre, or as far before it as before that of another level.
    look.distance = (view.distance != 0 ? view.distance : 2 * radius) + Dot(look.axes.forward, look.target);
  } else if (view.eye) {
    look.distance = Length(target - *view.eye);
  } else {
    look.distance = view.distance > 0 ? view.distance : radius / std::sin(HalfFov(view));
  }
  return look;
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

// The axis nearest in physical space. If voxels are so long along it that the central ray passes more than kMostShear others from slice to
// slice, it is the axis nearest in data space, whose slices the ray meets most often. Usual scans keep the nearest one.
Axis TraversalAxisOf(const Look& look, const VolumeGeometry& geometry, bool perspective) {
  const Vec3& forward = look.axes.forward;
  const Axis nearest = NearestAxis(forward);
  const Vec3 voxels = Absolute(forward / geometry.spacing);  // passed a unit
  const Axis most = *std::ranges::max_element(kAxes, {}, [&](Axis axis) { return voxels[axis]; });
  constexpr double kMostShear = 8;
  if (voxels[most] <= kMostShear * voxels[nearest]) return nearest;
  // Slices next to the eye would be magnified too much.
  constexpr double kFar = 2;
  const double before = look.distance * std::abs(forward[most]) - std::copysign(look.target[most], look.target[most] * forward[most]);
  return perspective && before < kFar * 0.5 * ExtentOf(geometry)[most] ? nearest : most;
}

// Row of a data-space form: data point p -> scale * Dot(direction, spacing * (p - centre)) + offset.
std::array<double, 4> Row(const Vec3& direction, double scale, double offset, const Vec3& spacing, const Vec3& centre) {
  const Vec3 row = scale * (direction * spacing);
  return {row.x, row.y, row.z, offset - Dot(row, centre)};
}

Vec3 Linear(const std::array<double, 4>& row) { return {row[0], row[1], row[2]}; }

// Pixels a physical unit at unit depth (perspective) or everywhere (orthographic): x_row holds scale * right (and, under perspective, a
// multiple of the view direction, to which right is perpendicular).
double ScaleOf(const Camera& camera) { return Dot(Linear(camera.x_row) / camera.spacing, camera.right); }

// Points of the world may be anywhere, but renderers compute in single precision. From farther away nothing would be seen.
Status CheckNear(const char* field, const char* what, const Vec3& away, const VolumeGeometry& geometry) {
  constexpr double kMostRadii = 1e9;
  const double farthest = kMostRadii * BoundingRadius(geometry), distance = std::hypot(away.x, away.y, away.z);
  if (distance <= farthest) return Status::Ok();
  return Status::InvalidArgument(fmt::format("{} is {:.6g} from {}, but must be at most {:.6g}, {:g} times half the volume's diagonal",
                                             field, distance, what, farthest, kMostRadii));
}

}  // namespace

ViewAxes AxesOf(const ViewParameters& view, const Vec3& target) {
  const auto [right, up, forward] = view.eye ? AxesFromEye(view, target) : AxesByAngles(view);
  const auto [sin_roll, cos_roll] = SinCosDegrees(view.roll_degrees);
  return {cos_roll * right + sin_roll * up, cos_roll * up - sin_roll * right, forward};
}

ViewParameters FitView(const ViewParameters& view, const VolumeGeometry& geometry, const Ball& ball) {
  ViewParameters fitted = view;
  fitted.fit = false;
  fitted.look_at = ball.centre;
  if (view.projection == Projection::kPerspective) {
    const double sine = ball.radius / LookOf(fitted, geometry).distance;  // of the angle at which the eye sees the ball's radius
    if (sine < 1) fitted.zoom *= std::tan(HalfFov(view)) * std::sqrt(1 - sine * sine) / sine;
  } else {
    fitted.zoom *= BoundingRadius(geometry) / ball.radius;
  }
  fitted.zoom = std::clamp(fitted.zoom, kMinZoom, kMaxZoom);
  return fitted;
}

double SupersampledVoxel(const VolumeGeometry& geometry) {
  const double mean = BoundingRadius(geometry) / (0.5 * Length(ToVec3(geometry.size)));
  return std::max(Least(geometry.spacing), std::min(mean / kMaxStretch, 0.5 * Least(ExtentOf(geometry)) / kMaxVoxelsPerPixel));
}

Status CheckView(const ViewParameters& view, const VolumeGeometry& geometry) {
  if (view.of_patient && geometry.orientation.world != World::kPatient) {
    return Status::InvalidArgument(
        "view: the volume has no patient's orientation, so it has no anterior, posterior, superior or inferior side; front, back, left, "
        "right, top and bottom are possible");
  }
  const Look look = LookOf(view, geometry);
  const Vec3 centre = geometry.ToWorld(geometry.centre());
  Status near = CheckNear("view.look_at", "the volume's centre", look.target, geometry);
  if (near.ok() && view.eye)
    near = CheckNear("view.eye", "the point that it looks at", view.look_at.value_or(centre) - *view.eye, geometry);
  if (near.ok()) near = CheckNear("view.distance: the eye", "the point that it looks at", {view.distance, 0, 0}, geometry);
  if (!near.ok()) return near;
  const Vec3& forward = look.axes.forward;
  if (!std::isfinite(Length(forward))) return Status::InvalidArgument("view.eye is at the point that it looks at");
  const Vec3 up = view.up ? geometry.orientation.FromWorld(Normalized(*view.up)) : Vec3{};
  if (view.up && Length(Cross(up, forward)) < kParallel) return Status::InvalidArgument("view.up points along the direction of view");
  if (view.projection != Projection::kPerspective) return Status::Ok();

  // Every corner lies before the eye, and the eye before the first slice.
  const Vec3 half = 0.5 * ExtentOf(geometry);
  const double corners = Dot(Absolute(forward), half);
  const Axis c = NearestAxis(forward);
  const double before = std::max(corners + Dot(forward, look.target), half[c] / std::abs(forward[c]) + look.target[c] / forward[c]);
  constexpr double kMargin = 1.001;
  const double least = kMargin * std::max(before, 0.0);
  if (look.distance >= least) return Status::Ok();
  return Status::InvalidArgument(
      fmt::format("view.{} is {:.6g} from the point that it looks at, but must be at least {:.6g} in this direction, so that "
                  "the whole volume is in front of it; view.zoom magnifies the picture",
                  view.eye ? "eye" : "distance: the eye", look.distance, least));
}

Camera MakeCamera(const ViewParameters& view, ImageSize size, const VolumeGeometry& geometry, double farthest_voxel) {
  const bool perspective = view.projection == Projection::kPerspective;
  const Vec3 spacing = geometry.spacing;
  const double radius = BoundingRadius(geometry);
  const Look look = LookOf(view, geometry);
  const auto& [axes, target, distance] = look;
  const Vec3 centre = geometry.centre() + target / spacing;  // data space, of the picture

  // Pixels a physical unit at unit depth (perspective) or everywhere (orthographic).
  const double half_fov = HalfFov(view);
  const double half_side = 0.5 * std::min(size.width, size.height);
  double scale = view.zoom * half_side / (perspective ? std::tan(half_fov) : radius);

  // Supersampling by the farthest point that the bounding sphere can have, so that it does not change while the view turns.
  const double pixel_width = (perspective ? distance + Length(target) + radius : 1.0) / scale;
  int supersample = 1;
  if (farthest_voxel > 0) {
    while (supersample < kMaxSupersample && pixel_width > kMaxVoxelsPerPixel * farthest_voxel * supersample) supersample *= 2;
  }
  scale *= supersample;

  Camera camera;
  camera.projection = view.projection;
  camera.width = size.width * supersample;
  camera.height = size.height * supersample;
  camera.supersample = supersample;
  camera.target_depth = distance;
  camera.spacing = spacing;
  camera.view_direction = axes.forward;
  camera.right = axes.right;
  camera.up = axes.up;
  camera.eye = centre - distance * (axes.forward / spacing);

  const double middle_x = 0.5 * camera.width, middle_y = 0.5 * camera.height;
  camera.depth_row = Row(axes.forward, 1, distance, spacing, centre);
  if (perspective) {
    camera.w_row = camera.depth_row;
    camera.x_row = Row(scale * axes.right + middle_x * axes.forward, 1, middle_x * distance, spacing, centre);
    camera.y_row = Row(-scale * axes.up + middle_y * axes.forward, 1, middle_y * distance, spacing, centre);
  } else {
    camera.w_row = {0, 0, 0, 1};
    camera.x_row = Row(axes.right, scale, middle_x, spacing, centre);
    camera.y_row = Row(axes.up, -scale, middle_y, spacing, centre);
  }
  camera.traversal_axis = TraversalAxisOf(look, geometry, perspective);
  camera.ascending = axes.forward[camera.traversal_axis] > 0;
  return camera;
}

Camera::ImagePoint Camera::Project(const Vec3& data_point) const {
  const double w = Apply(w_row, data_point);
  return {Apply(x_row, data_point) / w, Apply(y_row, data_point) / w, Apply(depth_row, data_point)};
}

Camera::ImageExtent Camera::ProjectBetween(const Vec3& low, const Vec3& high) const {
  ImageExtent extent;
  for (int corner = 0; corner < 8; ++corner) {
    const ImagePoint at =
        Project({(corner & 1) != 0 ? high.x : low.x, (corner & 2) != 0 ? high.y : low.y, (corner & 4) != 0 ? high.z : low.z});
    extent = {std::min(extent.x_begin, at.x), std::min(extent.y_begin, at.y), std::max(extent.x_end, at.x), std::max(extent.y_end, at.y),
              std::min(extent.nearest, at.depth)};
  }
  return extent;
}

Camera::Ray Camera::RayAt(double x, double y) const {
  const double scale = ScaleOf(*this);
  const Vec3 offset = ((x - 0.5 * width) / scale * right - (y - 0.5 * height) / scale * up) / spacing;
  const Vec3 forward = view_direction / spacing;
  if (projection == Projection::kPerspective) return {eye, forward + offset};
  return {eye + offset, forward};
}

double Camera::PixelSizeAt(double depth) const {
  return (projection == Projection::kPerspective ? depth : 1.0) * supersample / ScaleOf(*this);
}

}  // namespace slabstream
