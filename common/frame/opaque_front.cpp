#include "common/frame/opaque_front.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "common/frame/frame_setup.h"

namespace slabstream {
namespace {

// The ray of a point of the frame. Nothing: it does not meet all slices in the camera's order.
std::optional<TileBeam::Ray> RayOf(const FrameSetup& setup, double x, double y) {
  const auto [c, u, v] = AxesOf(setup.camera.traversal_axis);
  if (!setup.sheets.empty()) {
    const SheetGrid& grid = setup.sheets;
    return TileBeam::Ray{(x * grid.w_0 - grid.x_0) / grid.x_u, (x * grid.w_c - grid.x_c) / grid.x_u, (y * grid.w_0 - grid.y_0) / grid.y_v,
                         (y * grid.w_c - grid.y_c) / grid.y_v};
  }
  const Camera::Ray ray = setup.camera.RayAt(x, y);
  const double along = setup.camera.ascending ? ray.direction[c] : -ray.direction[c];
  if (!(along > 1e-3 * Length(ray.direction))) return std::nullopt;
  const double nearest = setup.camera.ascending ? -1 : setup.description.geometry.size[c];
  const bool behind_eye = (setup.camera.ascending ? nearest - ray.origin[c] : ray.origin[c] - nearest) < 0;
  if (behind_eye && setup.camera.projection == Projection::kPerspective) return std::nullopt;
  const double u_k = ray.direction[u] / ray.direction[c], v_k = ray.direction[v] / ray.direction[c];
  return TileBeam::Ray{ray.origin[u] - ray.origin[c] * u_k, u_k, ray.origin[v] - ray.origin[c] * v_k, v_k};
}

}  // namespace

TileBeam::Area TileBeam::Between(double j, double k) const {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Area area = {kInfinity, kInfinity, -kInfinity, -kInfinity};
  for (const Ray& ray : corners_) {
    for (const double slice : {j, k}) {
      const double u = ray.u_0 + slice * ray.u_k, v = ray.v_0 + slice * ray.v_k;
      area = {std::min(area.u_begin, u), std::min(area.v_begin, v), std::max(area.u_end, u), std::max(area.v_end, v)};
    }
  }
  return area;
}

double TileBeam::LeastLength(const SliceAxes& axes, const Vec3& spacing) const {
  // With t the angle between a ray and the normal of slices, the length is the slices' distance over cos t. A ray between the corners has
  // an angle to one of them that is at most the largest one between two corners, `across`.
  const double distance = spacing[axes.c];
  double cos_least = 0, cos_across = 1;
  std::array<Vec3, 4> directions;
  for (std::size_t i = 0; i < corners_.size(); ++i) {
    directions[i] = Normalized(Vec3{corners_[i].u_k * spacing[axes.u], corners_[i].v_k * spacing[axes.v], distance});
    cos_least = std::max(cos_least, directions[i].z);
    for (std::size_t j = 0; j < i; ++j) cos_across = std::min(cos_across, Dot(directions[i], directions[j]));
  }
  if (cos_least >= cos_across) return distance;
  const auto sine = [](double cosine) { return std::sqrt(std::max(0.0, 1 - cosine * cosine)); };
  return distance / (cos_least * cos_across + sine(cos_least) * sine(cos_across));
}

std::optional<double> TileBeam::FirstIn(const Area& area, double begin, bool ascending) const {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  constexpr int kRounds = 4;  // a place that is too near is right as well
  const double sign = ascending ? 1 : -1;
  double k = begin;
  // Moves k on until a coordinate of one of the rays is at least `limit` (`up` 1) or at most `limit` (-1). False: no ray comes there.
  const auto pass = [&](double limit, double up, double Ray::*at_0, double Ray::*slope) {
    double nearest = kInfinity;  // slices from k on
    for (const Ray& ray : corners_) {
      const double missing = up * (limit - (ray.*at_0 + k * ray.*slope)), speed = up * sign * ray.*slope;
      if (missing <= 0) return true;
      if (speed > 0) nearest = std::min(nearest, missing / speed);
    }
    k += sign * nearest;
    return nearest < kInfinity;
  };
  for (int round = 0; round < kRounds; ++round) {
    const double before = k;
    if (!pass(area.u_begin, 1, &Ray::u_0, &Ray::u_k) || !pass(area.u_end, -1, &Ray::u_0, &Ray::u_k) ||
        !pass(area.v_begin, 1, &Ray::v_0, &Ray::v_k) || !pass(area.v_end, -1, &Ray::v_0, &Ray::v_k)) {
      return std::nullopt;
    }
    if (k == before) break;
  }
  return k;
}

std::vector<std::optional<TileBeam>> TileBeams(const FrameSetup& setup, std::int32_t tile, const PixelBounds& tiles) {
  const auto columns = std::size_t(tiles.width());
  std::vector<std::optional<TileBeam::Ray>> corners;
  for (std::int32_t y = tiles.y_begin; y <= tiles.y_end; ++y) {
    for (std::int32_t x = tiles.x_begin; x <= tiles.x_end; ++x) corners.push_back(RayOf(setup, double(x) * tile, double(y) * tile));
  }
  std::vector<std::optional<TileBeam>> beams;
  for (std::size_t y = 0; y < std::size_t(tiles.height()); ++y) {
    for (std::size_t x = 0; x < columns; ++x) {
      const auto corner = [&](std::size_t dx, std::size_t dy) -> const std::optional<TileBeam::Ray>& {
        return corners[(y + dy) * (columns + 1) + x + dx];
      };
      const bool all = corner(0, 0) && corner(1, 0) && corner(0, 1) && corner(1, 1);
      beams.push_back(all ? std::optional(TileBeam({*corner(0, 0), *corner(1, 0), *corner(0, 1), *corner(1, 1)})) : std::nullopt);
    }
  }
  return beams;
}

std::int32_t FrontTile(const FrameSetup& setup) {
  const PixelBounds frame = FrameBounds(setup);
  constexpr std::int32_t kLeast = 2 * kOcclusionTile;
  return ((std::max(frame.width(), frame.height()) - 1) / (kLeast * OpaqueFront::kMostTiles) + 1) * kLeast;
}

Status CheckFits(const OpaqueFront& front, const FrameSetup& setup) {
  if (front.empty()) return Status::Ok();
  if (setup.format != PixelFormat::kRgba || !(setup.termination > 0)) return Status::InvalidArgument("a front in a frame that uses none");
  const PixelBounds frame = FrameBounds(setup);
  const std::int32_t tile = FrontTile(setup);
  const std::int32_t tiles_x = (frame.width() - 1) / tile + 1, tiles_y = (frame.height() - 1) / tile + 1;
  if (front.tile == tile && front.tiles_x == tiles_x && front.tiles_y == tiles_y) return Status::Ok();
  return Status::InvalidArgument(fmt::format("{} x {} tiles of {} pixels, but the frame has {} x {} of {}", front.tiles_x, front.tiles_y,
                                             front.tile, tiles_x, tiles_y, tile));
}

OcclusionMask MaskBefore(const Box& box, const FrameSetup& setup) {
  const OpaqueFront& front = setup.front;
  if (front.empty()) return {};
  const SliceAxes axes = AxesOf(setup.camera.traversal_axis);
  const bool ascending = setup.camera.ascending;
  const Index3& size = setup.description.geometry.size;
  const std::int32_t slices = size[axes.c];
  // Samples of the box lie up to half a voxel beyond it, and on the volume's rim as far as footprints reach.
  const auto low_end = [&](Axis axis) { return double(box.begin[axis] - 1 - (box.begin[axis] == 0 ? setup.halo : 0)); };
  const auto high_end = [&](Axis axis) { return double(box.end[axis] + (box.end[axis] == size[axis] ? setup.halo : 0)); };
  const TileBeam::Area area = {low_end(axes.u), low_end(axes.v), high_end(axes.u), high_end(axes.v)};
  const double nearest = ascending ? box.begin[axes.c] - 1 : box.end[axes.c];
  const double deepest = box.end[axes.c] - box.begin[axes.c] + 1;  // slices behind the nearest one
  const PixelBounds frame = FrameBounds(setup);
  OcclusionMask mask{OcclusionTiles(frame.width()), OcclusionTiles(frame.height()), {}};
  mask.steps.assign(std::size_t(mask.tiles_x) * std::size_t(mask.tiles_y), kOcclusionSteps);
  const PixelBounds reach = ReachOf(box, setup);
  if (reach.empty()) return mask;
  // Rays of a smaller tile come to the box at places that differ less.
  const std::int32_t tile = front.tile / 2, inside = tile / kOcclusionTile;
  const PixelBounds tiles = {reach.x_begin / tile, reach.y_begin / tile, (reach.x_end - 1) / tile + 1, (reach.y_end - 1) / tile + 1};
  const std::vector<std::optional<TileBeam>> beams = TileBeams(setup, tile, tiles);
  const auto steps_of = [&](const std::optional<TileBeam>& beam, const OpaqueFront::Depths& depths) {
    if (!beam) return std::uint8_t{0};
    const std::optional<double> first = beam->FirstIn(area, nearest, ascending);
    if (!first || std::abs(*first - nearest) > deepest) return kOcclusionSteps;
    const double before = std::floor(ascending ? *first : slices - 1 - *first);  // slices
    return front.StepsAt(depths, before);
  };
  std::size_t number = 0;
  for (std::int32_t y = tiles.y_begin; y < tiles.y_end; ++y) {
    for (std::int32_t x = tiles.x_begin; x < tiles.x_end; ++x, ++number) {
      const std::uint8_t steps = steps_of(beams[number], front.tiles[std::size_t(y / 2) * std::size_t(front.tiles_x) + std::size_t(x / 2)]);
      for (std::int32_t ty = y * inside; ty < std::min((y + 1) * inside, mask.tiles_y); ++ty) {
        for (std::int32_t tx = x * inside; tx < std::min((x + 1) * inside, mask.tiles_x); ++tx) {
          mask.steps[std::size_t(ty) * std::size_t(mask.tiles_x) + std::size_t(tx)] = steps;
        }
      }
    }
  }
  return mask;
}

}  // namespace slabstream
