#include "worker/renderers/zbuffer/clip_rays.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace slabstream {
namespace {

constexpr double kAlong = 1e-9;              // physical: a ray that comes nearer to a side by less, a unit of depth, runs along it
constexpr double kRounding = 1e-9;           // of g, relative
constexpr double kAround = 1.0;              // pixels round the outline, for rounding and for footprints of faces
constexpr double kAroundBox = 0.5 + 0x1p-6;  // voxels round a box's outermost centres that its faces reach

// The cells of a box, a little larger.
std::vector<HalfSpace> HalfSpacesOf(const Box& box) {
  std::vector<HalfSpace> sides;
  for (const Axis axis : kAxes) {
    Vec3 normal;
    normal[axis] = 1;
    sides.push_back({normal, -(box.begin[axis] - kAroundBox)});
    sides.push_back({-normal, box.end[axis] - 1 + kAroundBox});
  }
  return sides;
}

}  // namespace

LinearInImage MakeLinear(const Camera& camera, double at_0, double at_right, double at_bottom) {
  return {at_0, (at_right - at_0) / camera.width, (at_bottom - at_0) / camera.height};
}

ClipRays::ClipRays(const ClipRegion& region, const Camera& camera, const Box& box)
    : perspective_(camera.projection == Projection::kPerspective),
      start_(perspective_ ? -double(kNeverMet) : 0),
      end_(perspective_ ? -1 / double(kNeverMet) : double(kNeverMet)),
      sides_(SidesOf(region.sides, camera)) {
  FindOutline({0, 0, camera.width, camera.height}, SidesOf(HalfSpacesOf(box), camera));
}

ClipRays::Sides ClipRays::SidesOf(const std::vector<HalfSpace>& half_spaces, const Camera& camera) const {
  const Camera::Ray first = camera.RayAt(0, 0), right = camera.RayAt(camera.width, 0), down = camera.RayAt(0, camera.height);
  Sides sides;
  for (std::size_t number = 0; number < half_spaces.size(); ++number) {
    const HalfSpace& side = half_spaces[number];
    // Along a ray, the distance from the side is start + depth * rise.
    const auto rise_of = [&](const Camera::Ray& ray) { return Dot(side.normal, ray.direction); };
    const LinearInImage start = MakeLinear(camera, side.Distance(first.origin), side.Distance(right.origin), side.Distance(down.origin));
    const LinearInImage rise = MakeLinear(camera, rise_of(first), rise_of(right), rise_of(down));
    // Perspective: all rays have the first one's start; orthographic: its rise.
    const double shared = perspective_ ? start.at_0 : rise.at_0;
    const LinearInImage& other = perspective_ ? rise : start;
    if (std::abs(shared) < kAlong) {
      sides.never.push_back(other);
      continue;
    }
    const double scale = (perspective_ ? 1 : -1) / shared;
    const bool enters = perspective_ ? shared < 0 : shared > 0;
    (enters ? sides.entered : sides.left).push_back({{scale * other.at_0, scale * other.by_x, scale * other.by_y}, number});
  }
  return sides;
}

void ClipRays::FindOutline(const PixelBounds& frame, const Sides& of_box) {
  outline_ = {{0, 0}, {double(frame.x_end), 0}, {double(frame.x_end), double(frame.y_end)}, {0, double(frame.y_end)}};
  // Sutherland and Hodgman 1974: keeps the part of the outline where inside(x, y) >= 0.
  std::vector<Point> clipped;
  const auto keep = [&](auto&& inside) {
    clipped.clear();
    for (std::size_t i = 0; i < outline_.size(); ++i) {
      const Point &a = outline_[i], &b = outline_[(i + 1) % outline_.size()];
      const double at_a = inside(a), at_b = inside(b);
      if (at_a >= 0) clipped.push_back(a);
      if ((at_a < 0) == (at_b < 0)) continue;
      const double t = at_a / (at_a - at_b);
      clipped.push_back({a.x + t * (b.x - a.x), a.y + t * (b.y - a.y)});
    }
    outline_.swap(clipped);
  };
  const auto keep_below = [&](const LinearInImage& a, const LinearInImage& b) {
    keep([&](const Point& p) {
      const double at_a = a.At(p.x, p.y), at_b = b.At(p.x, p.y);
      return (at_b - at_a) + kRounding * (std::abs(at_a) + std::abs(at_b));
    });
  };
  std::vector<LinearInImage> entered = {{start_}}, left = {{end_}};
  for (const Sides* sides : {&std::as_const(sides_), &of_box}) {
    for (const Side& side : sides->entered) entered.push_back(side.g);
    for (const Side& side : sides->left) left.push_back(side.g);
    for (const LinearInImage& g : sides->never) keep([&](const Point& p) { return g.At(p.x, p.y) + kAlong; });
  }
  for (const LinearInImage& a : entered) {
    for (const LinearInImage& b : left) keep_below(a, b);
  }
  if (outline_.empty()) return;

  const auto [left_end, right_end] = std::ranges::minmax(outline_, {}, &Point::x);
  const auto [top, bottom] = std::ranges::minmax(outline_, {}, &Point::y);
  const auto pixel = [](double at) { return std::int32_t(std::floor(at)); };
  bounds_ = Intersection(
      frame, {pixel(left_end.x - kAround), pixel(top.y - kAround), pixel(right_end.x + kAround) + 1, pixel(bottom.y + kAround) + 1});

  // Linear functions are least at corners. The least of their greatest is at least the greatest of their leasts.
  const auto least = [&](const LinearInImage& g) {
    double result = end_;
    for (const Point& p : outline_) result = std::min(result, g.At(p.x, p.y));
    return result;
  };
  double enter = start_, leave = end_;
  for (const Side& side : sides_.entered) enter = std::max(enter, least(side.g));
  for (const Side& side : sides_.left) leave = std::min(leave, least(side.g));
  const auto rounded_down = [&](double g) { return float(std::max(0.0, DepthAt(std::max(g, start_)) * (1 - 1e-6))); };
  if (!sides_.entered.empty()) least_enter_ = rounded_down(enter);
  if (!sides_.left.empty()) least_leave_ = rounded_down(leave);
}

ClipRays::Columns ClipRays::ColumnsOf(std::int32_t row, const PixelBounds& within) const {
  const double top = row - kAround, bottom = row + 1 + kAround;
  double least = std::numeric_limits<double>::infinity(), greatest = -least;
  for (std::size_t i = 0; i < outline_.size(); ++i) {
    const Point &a = outline_[i], &b = outline_[(i + 1) % outline_.size()];
    if (std::max(a.y, b.y) < top || std::min(a.y, b.y) > bottom) continue;
    for (const double y : {std::clamp(a.y, top, bottom), std::clamp(b.y, top, bottom)}) {
      const double x = a.y == b.y ? a.x : a.x + (y - a.y) / (b.y - a.y) * (b.x - a.x);
      least = std::min(least, x);
      greatest = std::max(greatest, x);
    }
    if (a.y != b.y) continue;
    least = std::min(least, b.x);
    greatest = std::max(greatest, b.x);
  }
  const auto pixel = [](double x) { return std::int32_t(std::clamp(std::floor(x), -1.0, double(kMaxImageSide) * kMaxSupersample)); };
  if (least > greatest) return {0, 0};
  return {std::max(pixel(least - kAround), within.x_begin), std::min(pixel(greatest + kAround) + 1, within.x_end)};
}

RegionRow ClipRays::Row(std::int32_t row) const {
  RegionRow result{.perspective = perspective_, .start = start_, .end = end_};
  for (const Side& side : sides_.entered) result.entered.push_back(side.g.InRow(row));
  for (const Side& side : sides_.left) result.left.push_back(side.g.InRow(row));
  for (const LinearInImage& g : sides_.never) result.never.push_back(g.InRow(row));
  return result;
}

std::size_t ClipRays::SideEntered(std::int32_t column, std::int32_t row) const {
  return std::ranges::max_element(sides_.entered, {}, [&](const Side& side) { return side.g.At(column + 0.5, row + 0.5); })->number;
}

std::size_t ClipRays::SideLeft(std::int32_t column, std::int32_t row) const {
  return std::ranges::min_element(sides_.left, {}, [&](const Side& side) { return side.g.At(column + 0.5, row + 0.5); })->number;
}

}  // namespace slabstream
