#include "common/view/camera_path.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <utility>

namespace slabstream {
namespace {

// ---- rotations

Rotation Product(const Rotation& a, const Rotation& b) {
  return {a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3], a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
          a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1], a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]};
}
Rotation Inverse(const Rotation& a) { return {a[0], -a[1], -a[2], -a[3]}; }

// By |turn| radians about `turn`.
Rotation RotationBy(const Vec3& turn) {
  const double half = 0.5 * Length(turn);
  const double scale = half < 1e-9 ? 0.5 : 0.5 * std::sin(half) / half;
  return {std::cos(half), scale * turn.x, scale * turn.y, scale * turn.z};
}
// The shortest turn that makes the rotation.
Vec3 TurnOf(const Rotation& rotation) {
  const double sign = rotation[0] < 0 ? -1 : 1;
  const Vec3 axis = sign * Vec3{rotation[1], rotation[2], rotation[3]};
  const double sine = Length(axis);
  return (sine < 1e-9 ? 2 : 2 * std::atan2(sine, sign * rotation[0]) / sine) * axis;
}
Vec3 TurnBetween(const Rotation& from, const Rotation& to) { return TurnOf(Product(Inverse(from), to)); }

// From the matrix whose columns are right, up and backwards (Shepperd 1978: the largest of the four is computed first).
Rotation RotationOf(const ViewAxes& axes) {
  const Vec3 x = axes.right, y = axes.up, z = -axes.forward;
  const std::array<double, 4> squares = {1 + x.x + y.y + z.z, 1 + x.x - y.y - z.z, 1 - x.x + y.y - z.z, 1 - x.x - y.y + z.z};
  const auto largest = std::ranges::max_element(squares) - squares.begin();
  const double twice = std::sqrt(squares[std::size_t(largest)]), scale = 0.5 / twice;
  const double xy = x.y + y.x, yz = y.z + z.y, zx = z.x + x.z;
  const double from_x = y.z - z.y, from_y = z.x - x.z, from_z = x.y - y.x;
  switch (largest) {
    case 0: return {0.5 * twice, scale * from_x, scale * from_y, scale * from_z};
    case 1: return {scale * from_x, 0.5 * twice, scale * xy, scale * zx};
    case 2: return {scale * from_y, scale * xy, 0.5 * twice, scale * yz};
    default: return {scale * from_z, scale * zx, scale * yz, 0.5 * twice};
  }
}
ViewAxes AxesOfRotation(const Rotation& q) {
  const auto [w, x, y, z] = q;
  return {.right = {1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)},
          .up = {2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)},
          .forward = {-2 * (x * z + w * y), -2 * (y * z - w * x), -1 + 2 * (x * x + y * y)}};
}

// ---- curves

// The slope of the parabola through three points, at the middle one: `before` and `after` are the slopes of its chords.
template <class T>
T SlopeBetween(const T& before, const T& after, double seconds_before, double seconds_after) {
  return (1 / (seconds_before + seconds_after)) * (seconds_after * before + seconds_before * after);
}

// Cubic Bernstein polynomials, summed up from the last one (Kim, Kim and Shin 1995, section 4.2).
std::array<double, 3> CumulativeBernstein(double t) {
  const double rest = 1 - t;
  return {1 - rest * rest * rest, t * t * (3 - 2 * t), t * t * t};
}

constexpr int kZoom = 3, kDistance = 4, kFov = 5;

constexpr double kDegree = std::numbers::pi / 180;

// Angles that turn a view to these axes.
void TurnTo(const ViewAxes& axes, ViewParameters& view) {
  view.eye.reset();
  view.up.reset();
  const double sine = std::clamp(-axes.forward.z, -1.0, 1.0);
  view.elevation_degrees = std::asin(sine) / kDegree;
  // At a pole, azimuth and roll turn the picture alike.
  const bool pole = std::hypot(axes.forward.x, axes.forward.y) < 1e-9;
  const Vec3& along = axes.right;
  view.azimuth_degrees = (pole ? std::atan2(along.y, along.x) : std::atan2(-axes.forward.x, axes.forward.y)) / kDegree;
  view.roll_degrees = 0;
  const ViewAxes level = AxesOf(view, {});
  view.roll_degrees = std::atan2(Dot(axes.right, level.up), Dot(axes.right, level.right)) / kDegree;
}

Status CheckCameras(std::span<const PathCamera> cameras) {
  if (cameras.size() < kMinPathCameras || cameras.size() > kMaxPathCameras) {
    return Status::InvalidArgument(
        fmt::format("a path has {} cameras, but must have {} to {}", cameras.size(), kMinPathCameras, kMaxPathCameras));
  }
  const ViewParameters& first = cameras.front().view;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const ViewParameters& view = cameras[i].view;
    const auto refuse = [&](const std::string& what) {
      return Status::InvalidArgument(fmt::format("camera {} of the path {}", i + 1, what));
    };
    if (view.projection != first.projection) {
      return refuse(fmt::format("is {}, but the first one is {}", NameOf(view.projection), NameOf(first.projection)));
    }
    if (view.eye && !view.look_at) return refuse("has an eye, but no look-at");
    if (view.look_at.has_value() != first.look_at.has_value()) {
      return refuse(view.look_at ? "has a look-at, but the first one has none" : "has no look-at, but the first one has");
    }
    const bool has_distance = view.eye || view.distance > 0, first_has_distance = first.eye || first.distance > 0;
    if (view.projection == Projection::kPerspective && has_distance != first_has_distance) {
      return refuse(has_distance ? "has a distance or an eye, but the first one has none"
                                 : "has no distance and no eye, but the first one has");
    }
    if (i > 0 && !(cameras[i].seconds > cameras[i - 1].seconds)) {
      return refuse(
          fmt::format("has the time {:g}, which must be more than {:g} of the one before", cameras[i].seconds, cameras[i - 1].seconds));
    }
  }
  return Status::Ok();
}

}  // namespace

Result<CameraPath> CameraPath::Make(std::span<const PathCamera> cameras) {
  if (Status status = CheckCameras(cameras); !status.ok()) return status;
  std::vector<Knot> knots;
  for (const auto& [seconds, view] : cameras) {
    const Vec3 target = view.look_at.value_or(Vec3{});
    const double distance = view.eye ? Length(target - *view.eye) : view.distance;
    knots.push_back(
        {.seconds = seconds,
         .view = view,
         .numbers = {target.x, target.y, target.z, std::log(view.zoom), distance > 0 ? std::log(distance) : 0, view.fov_degrees},
         .rotation = RotationOf(AxesOf(view, target))});
  }
  return CameraPath(std::move(knots));
}

CameraPath::CameraPath(std::vector<Knot> knots) : knots_(std::move(knots)) {
  const std::size_t last = knots_.size() - 1;
  const auto seconds_after = [&](std::size_t i) { return knots_[i + 1].seconds - knots_[i].seconds; };
  const auto chord = [&](std::size_t i, std::size_t number) {
    return (knots_[i + 1].numbers[number] - knots_[i].numbers[number]) / seconds_after(i);
  };
  const auto turn = [&](std::size_t i) { return (1 / seconds_after(i)) * TurnBetween(knots_[i].rotation, knots_[i + 1].rotation); };
  for (std::size_t i = 0; i <= last; ++i) {
    const std::size_t before = i == 0 ? 0 : i - 1, after = i == last ? last - 1 : i;
    const double first = seconds_after(before), second = seconds_after(after);
    for (std::size_t number = 0; number < kNumbers; ++number) {
      knots_[i].slopes[number] = SlopeBetween(chord(before, number), chord(after, number), first, second);
    }
    knots_[i].spin = SlopeBetween(turn(before), turn(after), first, second);
  }
}

ViewParameters CameraPath::At(double seconds) const {
  const auto after = std::ranges::upper_bound(knots_, seconds, {}, &Knot::seconds);
  if (after == knots_.begin()) return knots_.front().view;
  const Knot& a = *std::prev(after);
  if (after == knots_.end() || seconds == a.seconds) return a.view;
  const Knot& b = *after;
  const double length = b.seconds - a.seconds, t = (seconds - a.seconds) / length;

  // Hermite curves as Bezier curves: their inner points lie a third of the slopes away.
  const auto [b1, b2, b3] = CumulativeBernstein(t);
  std::array<double, kNumbers> numbers{};
  for (std::size_t i = 0; i < kNumbers; ++i) {
    const double first = a.slopes[i] * length / 3, third = b.slopes[i] * length / 3;
    numbers[i] = a.numbers[i] + b1 * first + b2 * (b.numbers[i] - a.numbers[i] - first - third) + b3 * third;
  }
  const Vec3 first = (length / 3) * a.spin, third = (length / 3) * b.spin;
  const Vec3 second = TurnOf(Product(Product(RotationBy(-first), Product(Inverse(a.rotation), b.rotation)), RotationBy(-third)));
  const Rotation rotation = Product(Product(Product(a.rotation, RotationBy(b1 * first)), RotationBy(b2 * second)), RotationBy(b3 * third));

  ViewParameters view = a.view;
  TurnTo(AxesOfRotation(rotation), view);
  if (view.look_at) view.look_at = Vec3{numbers[0], numbers[1], numbers[2]};
  view.zoom = std::clamp(std::exp(numbers[kZoom]), kMinZoom, kMaxZoom);
  view.distance = view.projection == Projection::kPerspective && (a.view.eye || a.view.distance > 0) ? std::exp(numbers[kDistance]) : 0;
  view.fov_degrees = std::clamp(numbers[kFov], kMinFovDegrees, kMaxFovDegrees);
  return view;
}

}  // namespace slabstream
