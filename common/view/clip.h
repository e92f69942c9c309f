// Clipping: which part of a volume is drawn. A client gives a box, a slab and planes (Clipping); renderers see half-spaces of data space
// (ClipRegion). Whether a sample is drawn depends on its position alone, never on the box of a partition that owns it.
//
// The region is what lies in the box, in the slab and on the kept side of every plane: a convex polyhedron. It is kept, or cut away.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "common/volume/volume.h"

namespace slabstream {

inline constexpr std::size_t kMaxClipPlanes = 16;

enum class ClipMode : std::uint8_t {
  kKeep = 1,     // draw what lies in the region
  kCutAway = 2,  // draw everything else
};

// What the bounds of a clip box count.
enum class ClipUnit : std::uint8_t {
  kWorld = 1,    // along the axes of the world (common/volume/orientation.h)
  kVoxels = 2,   // indices: voxels low <= v < high, along the axes of the voxels
  kPercent = 3,  // percent of the volume's sides, along the axes of the voxels; 0 and 100 are its borders
};

// low < high along each axis; each in [-kMaxCoordinate, kMaxCoordinate]. A bound there does not clip.
struct ClipBox {
  Vec3 low, high;
  ClipUnit unit = ClipUnit::kWorld;
  friend bool operator==(const ClipBox&, const ClipBox&) = default;
};

// Keeps the points p of the world with Dot(normal, p) + offset >= 0 (as glClipPlane of OpenGL 1.0 does). The normal's length does not
// matter, but it is not zero.
struct ClipPlane {
  Vec3 normal;
  double offset = 0;
  friend bool operator==(const ClipPlane&, const ClipPlane&) = default;
};

// What lies within thickness / 2 of the plane through `through` that is perpendicular to `normal`. Thickness 0: a slice, that is, a slab so
// thin that values hardly change in it.
struct ClipSlab {
  Vec3 normal = {0, 0, 1};      // a direction of the world, not zero
  std::optional<Vec3> through;  // a point of the world; none: the volume's centre
  // Instead of `through`: the slice with this index along the axis of the voxels that is nearest to the normal, in its middle.
  std::optional<std::int32_t> index;  // [0, kMaxVolumeSide)
  double thickness = 0;               // unit of the world, [0, kMaxCoordinate]
  friend bool operator==(const ClipSlab&, const ClipSlab&) = default;
};

struct Clipping {
  std::optional<ClipBox> box;
  std::optional<ClipSlab> slab;
  std::vector<ClipPlane> planes;  // at most kMaxClipPlanes
  ClipMode mode = ClipMode::kKeep;

  bool empty() const { return !box && !slab && planes.empty(); }
  friend bool operator==(const Clipping&, const Clipping&) = default;
};

// The points p of data space with Distance(p) >= 0. Distance is in the unit of the spacing: |normal / spacing| is 1.
struct HalfSpace {
  Vec3 normal;
  double offset = 0;

  double Distance(const Vec3& p) const { return Dot(normal, p) + offset; }
  friend bool operator==(const HalfSpace&, const HalfSpace&) = default;
};

inline constexpr std::size_t kMaxClipSides = kMaxClipPlanes + 6 + 2;  // planes, box and slab

// Least spacings. Samples so near behind a cut are lit by its plane and not by their gradient: a visible sample lies up to about one behind
// the cut, gathers most from voxels nearer than 1.5, and is seen through others where the matter is not quite opaque.
inline constexpr double kFaceDepth = 2.5;

struct ClipRegion {
  std::vector<HalfSpace>
      sides;  // at most kMaxClipSides, of points inside no Distance is negative; none: nothing is clipped, in either mode
  ClipMode mode = ClipMode::kKeep;

  bool empty() const { return sides.empty(); }
  // Whether any sample in the voxels of `box` (not empty) may be drawn. False is certain.
  bool MayKeep(const Box& box) const;
  // Whether every point of the voxels of `box` (not empty) is drawn, and all round them that are nearer than `margin`, in the unit of the
  // spacing. True is certain.
  bool KeepsAll(const Box& box, double margin) const;
  friend bool operator==(const ClipRegion&, const ClipRegion&) = default;
};

// The axis of the voxels that is nearest to the slab's normal.
Axis AxisAcross(const ClipSlab& slab, const VolumeGeometry& geometry);
// InvalidArgument: the volume has no slice with the slab's index. `name`: what the message calls the slab.
Status CheckSlice(std::string_view name, const ClipSlab& slab, const VolumeGeometry& geometry);
// A point of the world in the middle of a slab whose slice there is.
Vec3 MiddleOf(const ClipSlab& slab, const VolumeGeometry& geometry);
// The plane in its middle, whose normal is the slab's. Distance is 0 on it.
HalfSpace MiddlePlane(const ClipSlab& slab, const VolumeGeometry& geometry);

// `clipping` valid. Sides that do not cut the volume are left out, so that a box around everything costs nothing.
// InvalidArgument: the volume has no slice with the slab's index.
Result<ClipRegion> MakeClipRegion(const Clipping& clipping, const VolumeGeometry& geometry);

}  // namespace slabstream
