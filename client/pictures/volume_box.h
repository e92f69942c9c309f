// The box of a volume as its picture shows it: where its edges lie, which of them lie behind the volume, and the coordinates along them.
// Pure; client/pictures/annotations.h draws it.
#pragma once

#include <array>
#include <optional>
#include <string>

#include "client/pictures/mark.h"
#include "common/image/pixel_bounds.h"
#include "common/view/picture_geometry.h"

namespace slabstream {

// Where the picture shows a point of the world. None: it is not before the eye.
std::optional<InkPoint> Project(const PictureGeometry& geometry, ImageSize size, const Vec3& point);

// The part of a line's middle within these pixels. None: it passes by.
std::optional<Stroke> Clipped(Stroke line, const PixelBounds& area);

class VolumeBox {
 public:
  // None: the box is not known, or a corner of it is not before the eye.
  static std::optional<VolumeBox> Of(const PictureGeometry& geometry, ImageSize size);

  // A line along an axis, from the side of the box where the axis begins to the other one.
  struct Edge {
    Axis axis = Axis::kX;
    Vec3 begin;            // on the box, each coordinate in [0, 1]; that of `axis` is 0
    bool hidden = false;   // it lies behind the volume: none of its two faces faces the viewer
    bool outline = false;  // one of them does: beside it lies nothing of the volume
  };
  std::array<Edge, 12> Edges() const;
  // That of the outline which lies lowest, or farthest to the left if the axis runs upwards rather than sideways; one that the picture
  // shows is preferred. None: the axis runs along the line of sight.
  std::optional<Edge> LabelledEdge(Axis axis) const;

  // A point of the box, each coordinate in [0, 1].
  InkPoint At(const Vec3& place) const;
  Stroke LineOf(const Edge& edge, double width) const;
  bool Faces(Axis axis, bool far) const;  // whether the face at this end of the axis faces the viewer

  // What stands at the two ends of an axis: coordinates of the world if it runs along that axis of the world, else distances from the
  // first.
  std::array<double, 2> ValuesOf(Axis axis) const;
  std::string NameOf(Axis axis) const;  // "x"; of patients the side that it runs to: "R"

 private:
  VolumeBox(const PictureGeometry& geometry, ImageSize size) : geometry_(geometry), size_(size) {}
  Vec3 PointAt(const Vec3& place) const;
  const Vec3& EdgeOf(Axis axis) const { return geometry_.box_edges[std::size_t(Number(axis))]; }
  bool RunsAlongTheWorlds(Axis axis) const;

  PictureGeometry geometry_;
  ImageSize size_;
};

}  // namespace slabstream
