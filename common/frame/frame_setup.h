// FrameSetup: what every worker needs to render its part of a frame. It is made once a frame (MakeFrameSetup, common/planning) and never
// changes: a new plan after the loss of a worker changes only who does what.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/classification/transfer_function.h"
#include "common/frame/dataset_id.h"
#include "common/frame/field_look.h"
#include "common/frame/frame_request.h"
#include "common/frame/label_look.h"
#include "common/frame/opaque_front.h"
#include "common/frame/shape_look.h"
#include "common/frame/smooth_label.h"
#include "common/image/pixel_bounds.h"
#include "common/image/pixel_format.h"
#include "common/view/picture_geometry.h"
#include "common/view/sheet_grid.h"
#include "common/volume/affine_map.h"
#include "common/volume/grid_map.h"
#include "common/volume/sample_types.h"
#include "common/volume/stored_at.h"
#include "common/volume/summary.h"

namespace slabstream {

class RendererKind;  // common/renderers/renderer_kind.h

// The light volume of a dataset whose voxels the coordinator holds (common/volume/light_volume.h).
constexpr DatasetId LightVolumeOf(DatasetId dataset) {
  constexpr DatasetId kMask = 0x6C69676874766F6C;
  return dataset == kMask ? 1 : dataset ^ kMask;
}

// A coarser level of a frame's volume, from which some of the boxes are drawn.
struct CoarserLevel {
  DatasetId dataset = 0;
  VolumeDescription description;        // the same part of the world, type and mapping as the frame's volume
  std::optional<StoredAt> stored = {};  // FrameSetup::stored, for this level
  friend bool operator==(const CoarserLevel&, const CoarserLevel&) = default;
};

// A field of the dataset that the picture shows beside its volume.
struct FieldSetup {
  std::vector<CoarserLevel> levels;        // those that are drawn, finest first; not empty. Of one grid, type and mapping
  std::vector<std::uint32_t> of_volume;    // which of them belongs to each level of the volume (LevelBox::level)
  FieldLook look = {};                     // of values
  std::optional<CoarserLevel> light = {};  // of values: its light volume, as FrameSetup::light
  std::optional<LabelLook> labels = {};    // there if it has labels
  friend bool operator==(const FieldSetup&, const FieldSetup&) = default;
};

// A shape that the picture shows. Its bytes (PackShape) are fetched, and kept, as if they were a volume.
struct ShapeSetup {
  CoarserLevel bytes;
  AffineMap to_data = {};  // from the shape's world to data space
  Vec3 low, high;          // of data space: all of the shape lies between
  ShapeLook look = {};
  friend bool operator==(const ShapeSetup&, const ShapeSetup&) = default;
};

// Lengths are counted in `unit`: those of all geometries, of camera and clip region, and those in slopes of the transfer function.
struct FrameSetup {
  DatasetId dataset = 0;
  double unit = 1;  // in that of the volume's world; a power of two (common/frame/frame_unit.h)
  VolumeDescription description;
  bool cells = false;                      // the dataset is an unstructured grid
  ValueRange range;                        // data values that the classification table is made for
  std::optional<StoredAt> stored = {};     // none: the coordinator holds the voxels
  std::vector<CoarserLevel> coarser = {};  // finest first
  std::optional<CoarserLevel> light = {};  // the light volume, if shading.needs_light_volume()
  const RendererKind* renderer = nullptr;  // one of Renderers(); lives as long as the program
  std::vector<double> parameters;          // one value for each of renderer->parameters()
  // The format of local images: renderer->FormatOf(parameters), so that combining need not know renderers.
  PixelFormat format = PixelFormat::kRgba;
  Camera camera;     // the picture's camera, perhaps supersampled
  SheetGrid sheets;  // the frame grid of renderers that work along slices; empty: the camera's grid
  ClipRegion clip;   // empty: all is drawn
  TransferFunction transfer;
  double weight = 1;  // [0, 1]: a factor of the volume's density
  // The other fields that the picture shows: at most kMaxShownFields - 1, in the order in which they are blended; then its labels.
  std::vector<FieldSetup> fields = {};
  bool flat = false;  // the picture is a slice: colours of fields that add are added, not averaged (docs/rendering.md)
  Shading shading;
  double termination = kDefaultTermination;
  std::int32_t halo = kHalo;            // voxels that a worker keeps round a box
  OpaqueFront front = {};               // empty: nothing is known
  std::vector<ShapeSetup> shapes = {};  // of the request's shapes, then of its planes: at most kMaxShownShapes + kMaxPlanes
  friend bool operator==(const FrameSetup&, const FrameSetup&) = default;
};

// The light volumes that a frame needs: the volume's, then that of each field. Empty: it has neither shadows nor ambient occlusion.
inline std::vector<const CoarserLevel*> LightVolumesOf(const FrameSetup& setup) {
  if (!setup.light) return {};
  std::vector<const CoarserLevel*> all = {&*setup.light};
  for (const FieldSetup& field : setup.fields) {
    if (!field.labels) all.push_back(&*field.light);
  }
  return all;
}

// The volume's geometry in its world.
VolumeGeometry WorldGeometryOf(const FrameSetup& setup);
PictureGeometry PictureGeometryOf(const FrameSetup& setup);

// What workers hold of each voxel.
inline SampleTypes TypesOf(const FrameSetup& setup) { return {setup.description.type, setup.cells}; }

// The field of labels; null: none is shown.
inline const FieldSetup* LabelsOf(const FrameSetup& setup) {
  return setup.fields.empty() || !setup.fields.back().labels ? nullptr : &setup.fields.back();
}

// All pixels that workers render and combine, and that the final picture is made from. Local images, runs and pixel ranges lie in it.
PixelBounds FrameBounds(const FrameSetup& setup);
inline PixelRange WholeFrame(const FrameSetup& setup) { return {0, std::uint64_t(FrameBounds(setup).pixel_count())}; }
// Memory of an image of the whole frame.
std::int64_t FrameBytes(const FrameSetup& setup);

// A rectangle of the frame, in pixels; empty until something is added.
struct FrameArea {
  double x_begin = 1e9, y_begin = 1e9, x_end = -1e9, y_end = -1e9;

  bool empty() const { return x_begin >= x_end || y_begin >= y_end; }
  double area() const { return empty() ? 0 : (x_end - x_begin) * (y_end - y_begin); }
  // Grows to hold `other`.
  void Add(const FrameArea& other) {
    x_begin = std::min(x_begin, other.x_begin);
    y_begin = std::min(y_begin, other.y_begin);
    x_end = std::max(x_end, other.x_end);
    y_end = std::max(y_end, other.y_end);
  }
};
inline FrameArea Intersection(const FrameArea& a, const FrameArea& b) {
  return {std::max(a.x_begin, b.x_begin), std::max(a.y_begin, b.y_begin), std::min(a.x_end, b.x_end), std::min(a.y_end, b.y_end)};
}

// Where `box` (not empty) lies in the frame, and perhaps beyond it. In a frame along slices, footprints reach so many voxels before and
// behind the box along the slices' two axes.
FrameArea ProjectBox(const Box& box, const FrameSetup& setup, std::int32_t before, std::int32_t behind);

// Pixels of the frame that samples of `box` can lie in, for any voxels.
PixelBounds ReachOf(const Box& box, const FrameSetup& setup);

// A box of the frame, in voxels of the setup's volume, and the level that it is drawn from. 0: that volume; n: setup.coarser[n - 1].
struct LevelBox {
  LevelBox(const Box& b, std::uint8_t l = 0) : box(b), level(l) {}  // NOLINT(google-explicit-constructor): most boxes are of level 0
  Box box;
  std::uint8_t level = 0;
};

inline const VolumeGeometry& GeometryOf(const FrameSetup& setup, std::uint8_t level) {
  return level == 0 ? setup.description.geometry : setup.coarser[level - std::size_t{1}].description.geometry;
}
inline DatasetId DatasetOf(const FrameSetup& setup, std::uint8_t level) {
  return level == 0 ? setup.dataset : setup.coarser[level - std::size_t{1}].dataset;
}
inline const std::optional<StoredAt>& StoredOf(const FrameSetup& setup, std::uint8_t level) {
  return level == 0 ? setup.stored : setup.coarser[level - std::size_t{1}].stored;
}
// Whether voxels of any level are read in parts.
inline bool ReadsInParts(const FrameSetup& setup) {
  return setup.stored || std::ranges::any_of(setup.coarser, [](const CoarserLevel& level) { return level.stored.has_value(); });
}

// From the frame's voxels to those of a level.
inline GridMap MapTo(const FrameSetup& setup, std::uint8_t level) {
  return MapBetween(setup.description.geometry, GeometryOf(setup, level));
}

// The voxels of its level that cover `at`.
inline Box VoxelsOf(const LevelBox& at, const FrameSetup& setup) {
  return CoveringVoxels(at.box, setup.description.geometry, GeometryOf(setup, at.level));
}
// Voxels of its level that a worker must hold to render `at`: with their halo, cut to the volume.
inline Box PaddedBox(const LevelBox& at, const FrameSetup& setup) {
  return Grown(VoxelsOf(at, setup), setup.halo, GeometryOf(setup, at.level).bounds());
}

// The level of a field that belongs to a level of the volume.
inline const CoarserLevel& LevelOf(const FieldSetup& field, std::uint8_t level) { return field.levels[field.of_volume[level]]; }
// From the frame's voxels to those of the field there.
inline AffineMap MapTo(const FrameSetup& setup, const FieldSetup& field, std::uint8_t level) {
  return AffineMapBetween(setup.description.geometry, LevelOf(field, level).description.geometry);
}
// Voxels of the field that a worker must hold to render `at`; empty: the field does not reach there.
inline Box PaddedBox(const LevelBox& at, const FrameSetup& setup, const FieldSetup& field) {
  const AffineMap map = MapTo(setup, field, at.level);
  const Index3& size = LevelOf(field, at.level).description.geometry.size;
  const Box voxels = CoveringVoxels(at.box, map, size, std::max(setup.halo, field.labels && field.labels->smooth ? kSmoothReach : 0));
  // Voxels of the volume's halo have labels, too.
  if (!field.labels) return voxels;
  return Hull(voxels, CoveringVoxels(Grown(at.box, setup.halo, setup.description.geometry.bounds()), map, size, 0));
}

}  // namespace slabstream
