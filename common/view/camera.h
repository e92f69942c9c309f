// From what a user asks for (ViewParameters) to how the renderers project (Camera).
//
// Physical space: data-space voxel coordinates times spacing, the origin moved to the volume's centre; its axes are those of the voxels.
// Bounding sphere: centre 0, radius R = half the diagonal of size * spacing. At zoom 1 the sphere touches the shorter side of the picture.
// Angles are about the axes of the volume's world (common/volume/orientation.h). Azimuth 0, elevation 0 looks along +y, +x to the right, +z
// up; azimuth turns the eye about +z, counter-clockwise seen from +z; elevation lifts it towards +z; roll turns the picture clockwise (the
// camera counter-clockwise). An eye that is given replaces these angles by its direction. A view may leave azimuth, elevation and `fit` to
// the volume (default_view.h); functions of this header take angles that are left out as 0.
//
// The picture's centre shows the target: `look_at`, or the volume's centre. Perspective: the eye stands at `distance` from the target, or
// else at R / sin(fov / 2), so that the sphere fits the cone of `fov` exactly at zoom 1; zoom magnifies the picture and leaves the eye
// where it is. The whole volume must lie before the eye (CheckView).
//
// Image space: x to the right and y downwards in pixels, origin at the upper left corner, so pixel (column, row) has its centre at
// (column + 0.5, row + 0.5). Depth: distance from the eye plane along the view direction in physical units; for an orthographic camera the
// eye plane is 2 R before the centre. Depth is positive for everything in the volume.
//
// Supersampling (Z-buffer, rays): where more than kMaxVoxelsPerPixel voxels (SupersampledVoxel) would fall on one pixel's width, all is
// rendered on a grid `supersample` (a power of two) times finer in x and y, and box-filtered at the end, so that minified pictures do not
// alias. Camera and all pixel bounds are then in that finer grid. Splatting has a grid of its own: sheet_grid.h.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "common/base/status.h"
#include "common/view/ball.h"
#include "common/volume/volume.h"

namespace slabstream {

enum class Projection : std::uint8_t { kOrthographic = 1, kPerspective = 2 };
constexpr std::string_view NameOf(Projection projection) { return projection == Projection::kPerspective ? "perspective" : "orthographic"; }

inline constexpr double kMaxVoxelsPerPixel = 2;
inline constexpr double kMinZoom = 1e-3, kMaxZoom = 1e4;
inline constexpr double kMinFovDegrees = 1, kMaxFovDegrees = 60;
inline constexpr int kMaxImageSide = 16384;                             // pixels
inline constexpr std::int64_t kMaxImagePixels = std::int64_t{1} << 26;  // 8192 x 8192: about 2.5 GB of working memory a worker
inline constexpr int kMaxSupersample = 1024;

struct ImageSize {
  int width = 512, height = 512;  // pixels, [1, kMaxImageSide], and at most kMaxImagePixels in all
  friend bool operator==(const ImageSize&, const ImageSize&) = default;
};

struct ViewParameters {
  Projection projection = Projection::kOrthographic;
  std::optional<double> azimuth_degrees = 0, elevation_degrees = 0;  // none: the volume's (WithDefaults)
  double roll_degrees = 0;
  double zoom = 1;
  double fov_degrees = 30;  // perspective only
  // Points of the world; none: the volume's centre, and where the angles say.
  std::optional<Vec3> look_at, eye;
  std::optional<Vec3> up;  // a direction that is upwards in the picture; only with an eye; none: +z, or +y if one looks along z
  double distance = 0;     // from the target to the eye, in the world's unit; perspective without `eye` only; 0: see above
  // The picture frames what the transfer function shows, not the whole volume (FitView); not with look_at. None: WithDefaults decides.
  std::optional<bool> fit = false;
  bool of_patient = false;  // the angles are meant for a patient: volumes without such an orientation are refused
  friend bool operator==(const ViewParameters&, const ViewParameters&) = default;
};

// The radius of the bounding sphere, physical.
inline double BoundingRadius(const VolumeGeometry& geometry) { return 0.5 * Length(ToVec3(geometry.size) * geometry.spacing); }

// InvalidArgument naming field, value and limits: a valid view that cannot be had of this volume.
Status CheckView(const ViewParameters& view, const VolumeGeometry& geometry);

// Everything about one view of one volume, in double precision. p is a data-space point.
//   w = Dot(w_row, (p, 1)); x = Dot(x_row, (p, 1)) / w; y = Dot(y_row, (p, 1)) / w; depth = Dot(depth_row, (p, 1))
// Orthographic: w_row = (0, 0, 0, 1). Perspective: w_row = depth_row.
struct Camera {
  Projection projection = Projection::kOrthographic;
  std::array<double, 4> x_row{}, y_row{}, w_row{}, depth_row{};
  Vec3 eye;                   // data space; orthographic: the point of the eye plane on the central ray
  Vec3 view_direction;        // physical space, unit, away from the eye
  Vec3 right, up;             // physical space, unit
  Vec3 spacing;               // the volume's spacing: physical = spacing * data
  int width = 0, height = 0;  // pixels of the (supersampled) grid
  int supersample = 1;        // power of two
  double target_depth = 1;    // depth of the target, which the picture's centre shows; perspective: its distance from the eye, > 0
  // The traversal: slices perpendicular to `traversal_axis`, from index 0 up if `ascending`, else from the last one down: nearest slice
  // first. It is the data axis nearest to the view direction in physical space (ties go to the higher axis), if slices lie close enough.
  Axis traversal_axis = Axis::kY;
  bool ascending = true;

  struct ImagePoint {
    double x, y, depth;
  };
  ImagePoint Project(const Vec3& data_point) const;  // the point must lie before the eye (perspective)

  // The image of all points p with low <= p <= high on every axis. The projection of a convex body is bounded by its
  // corners.
  struct ImageExtent {
    double x_begin = 1e9, y_begin = 1e9, x_end = -1e9, y_end = -1e9;
    double nearest = 1e300;  // depth
  };
  ImageExtent ProjectBetween(const Vec3& low, const Vec3& high) const;

  // Ray of a point of the image: data-space origin (eye or eye-plane point) and direction, scaled so that depth grows by 1 per unit.
  struct Ray {
    Vec3 origin, direction;
  };
  Ray RayAt(double x, double y) const;

  // Physical length of a side of the finished picture's pixels at this depth, which matters under perspective only (> 0).
  double PixelSizeAt(double depth) const;

  friend bool operator==(const Camera&, const Camera&) = default;
};

// Unit vectors at right angles, of the world: to the right and upwards in the picture, and away from the viewer.
struct ViewAxes {
  Vec3 right, up, forward;
};
// `target`: view.look_at, or what stands for it.
ViewAxes AxesOf(const ViewParameters& view, const Vec3& target);

// The view in the same direction whose target is the middle of `ball`, and in which `ball` touches the shorter side of the picture at
// zoom 1. The eye's distance stays. `fit` is off afterwards.
ViewParameters FitView(const ViewParameters& view, const VolumeGeometry& geometry, const Ball& ball);

// `view` and `size` valid, and CheckView is ok. `farthest_voxel`: the width of voxels where the volume is farthest from the eye, for
// supersampling; 0: supersample is 1.
Camera MakeCamera(const ViewParameters& view, ImageSize size, const VolumeGeometry& geometry, double farthest_voxel = 0);

}  // namespace slabstream
