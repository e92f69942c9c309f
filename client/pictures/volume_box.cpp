#include "client/pictures/volume_box.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "client/pictures/picture_labels.h"

namespace slabstream {
namespace {

constexpr double kSmall = 1e-9;  // of angles: what is seen from its edge does not face the viewer

Vec3 EndOf(const VolumeBox::Edge& edge) {
  Vec3 end = edge.begin;
  end[edge.axis] = 1;
  return end;
}

}  // namespace

std::optional<InkPoint> Project(const PictureGeometry& geometry, ImageSize size, const Vec3& point) {
  const Vec3 from = point - geometry.target;
  double pixel = geometry.pixel_size;
  if (geometry.projection == Projection::kPerspective) {
    const double k = 1 + Dot(from, geometry.forward) / geometry.target_depth;
    if (!(k > kSmall)) return std::nullopt;
    pixel *= k;
  }
  return InkPoint{0.5 * size.width + Dot(from, geometry.right) / pixel, 0.5 * size.height - Dot(from, geometry.up) / pixel};
}

// Liang and Barsky, 1984.
std::optional<Stroke> Clipped(Stroke line, const PixelBounds& area) {
  const InkPoint from = line.begin;
  const double dx = line.end.x - from.x, dy = line.end.y - from.y;
  double first = 0, last = 1;
  // Keeps where start + t * step >= 0.
  const auto keep = [&](double start, double step) {
    if (step > 0) first = std::max(first, -start / step);
    if (step < 0) last = std::min(last, -start / step);
    if (step == 0 && start < 0) last = -1;
  };
  keep(from.x - area.x_begin, dx);
  keep(area.x_end - from.x, -dx);
  keep(from.y - area.y_begin, dy);
  keep(area.y_end - from.y, -dy);
  if (!(first <= last)) return std::nullopt;
  line.begin = {from.x + first * dx, from.y + first * dy};
  line.end = {from.x + last * dx, from.y + last * dy};
  return line;
}

std::optional<VolumeBox> VolumeBox::Of(const PictureGeometry& geometry, ImageSize size) {
  const VolumeBox box(geometry, size);
  for (const Axis axis : kAxes) {
    if (!(Length(box.EdgeOf(axis)) > 0)) return std::nullopt;
  }
  for (const Edge& edge : box.Edges()) {
    for (const Vec3& place : {edge.begin, EndOf(edge)}) {
      const std::optional<InkPoint> point = Project(geometry, size, box.PointAt(place));
      if (!point || !std::isfinite(point->x) || !std::isfinite(point->y)) return std::nullopt;
    }
  }
  return box;
}

std::array<VolumeBox::Edge, 12> VolumeBox::Edges() const {
  std::array<Edge, 12> edges;
  std::size_t count = 0;
  for (const Axis axis : kAxes) {
    const Axis u = Axis((Number(axis) + 1) % 3), v = Axis((Number(axis) + 2) % 3);
    for (const bool far_u : {false, true}) {
      for (const bool far_v : {false, true}) {
        Edge& edge = edges[count++];
        edge.axis = axis;
        edge.begin[u] = far_u ? 1 : 0;
        edge.begin[v] = far_v ? 1 : 0;
        const bool one = Faces(u, far_u), other = Faces(v, far_v);
        edge.hidden = !one && !other;
        edge.outline = one != other;
      }
    }
  }
  return edges;
}

std::optional<VolumeBox::Edge> VolumeBox::LabelledEdge(Axis axis) const {
  Vec3 low = {0.5, 0.5, 0.5}, high = low;
  low[axis] = 0;
  high[axis] = 1;
  const InkPoint from = At(low), to = At(high);
  const bool sideways = std::abs(to.x - from.x) >= std::abs(to.y - from.y);
  std::optional<Edge> best;
  std::pair<bool, double> most;  // whether it shows, and how far it lies below or to the left
  for (const Edge& edge : Edges()) {
    if (edge.axis != axis || !edge.outline) continue;
    const Stroke line = LineOf(edge, 0);
    const std::pair found = {Clipped(line, {0, 0, size_.width, size_.height}).has_value(),
                             sideways ? line.begin.y + line.end.y : -(line.begin.x + line.end.x)};
    if (best && found <= most) continue;
    best = edge;
    most = found;
  }
  return best;
}

Vec3 VolumeBox::PointAt(const Vec3& place) const {
  Vec3 point = geometry_.box_corner;
  for (const Axis axis : kAxes) point = point + place[axis] * EdgeOf(axis);
  return point;
}

InkPoint VolumeBox::At(const Vec3& place) const { return *Project(geometry_, size_, PointAt(place)); }

Stroke VolumeBox::LineOf(const Edge& edge, double width) const { return {At(edge.begin), At(EndOf(edge)), width}; }

bool VolumeBox::Faces(Axis axis, bool far) const {
  const Vec3& edge = EdgeOf(axis);
  const Vec3 outwards = (far ? 1 : -1) / Length(edge) * edge;
  Vec3 to_viewer = -geometry_.forward;
  if (geometry_.projection == Projection::kPerspective) {
    const Vec3 face = far ? geometry_.box_corner + edge : geometry_.box_corner;
    to_viewer = 1 / geometry_.target_depth * (geometry_.target - face) - geometry_.forward;
  }
  return Dot(outwards, to_viewer) > kSmall;
}

bool VolumeBox::RunsAlongTheWorlds(Axis axis) const {
  const Vec3& edge = EdgeOf(axis);
  return edge[axis] > (1 - kSmall) * Length(edge);
}

std::array<double, 2> VolumeBox::ValuesOf(Axis axis) const {
  const double first = RunsAlongTheWorlds(axis) ? geometry_.box_corner[axis] : 0;
  return {first, first + Length(EdgeOf(axis))};
}

std::string VolumeBox::NameOf(Axis axis) const {
  const Vec3& edge = EdgeOf(axis);
  return geometry_.world == World::kPatient ? PatientSides(1 / Length(edge) * edge) : std::string(1, Letter(axis));
}

}  // namespace slabstream
