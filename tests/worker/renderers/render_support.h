// What the rendering tests share: small volumes from closed forms, frame set-ups, rendering by one box or by many, and comparison of
// images.
#pragma once

#include <functional>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "common/decomposition/partition.h"
#include "tests/support/random_volume.h"
#include "tests/support/renderers.h"
#include "worker/renderers/renderer.h"

namespace slabstream::testing {

inline constexpr Projection kProjections[] = {Projection::kOrthographic, Projection::kPerspective};

// Blobs, holes and slopes with values 0 ... 200, different for each seed; about half of the voxels are 0.
Volume MakeBlobs(const VolumeGeometry& geometry, ScalarType type, unsigned seed);

// Every voxel stores 100.
Volume MakeBlock(const VolumeGeometry& geometry);

// Opacity 0 at value 0, then rising linearly to `opacity` at 200; colours that change with the value.
TransferFunction Ramp(double opacity);
// Opacity `opacity` of every value from 1 on, in one colour.
TransferFunction Uniform(double opacity, Rgb color);

struct SetupOptions {
  const RendererKind* renderer = Splatting();
  ViewParameters view;
  Clipping clipping;
  ImageSize size{64, 64};
  TransferFunction transfer = Ramp(0.2);
  Shading shading;
  double termination = 0;
};
FrameSetup MakeSetup(const Volume& volume, const SetupOptions& options);
// Null: the setup needs none.
// `fields`: those of the setup.
std::shared_ptr<const FrameLight> LightOf(const Volume& volume, const FrameSetup& setup, const std::vector<Volume>& fields = {});
CoarserLevel NewLightVolume(const VolumeDescription& description);  // with a dataset of its own
FrameSetup RaycastSetup(const Volume& volume, SetupOptions options, double samples_per_voxel = 1, double jitter = 0, bool smooth = false);
// For a setup of splatting.
FrameSetup SplatSetup(const Volume& volume, const SetupOptions& options, double footprint);

// Physical length of the ray of a pixel inside the volume.
double LengthInside(const FrameSetup& setup, int x, int y);

ViewParameters RandomView(Projection projection, std::mt19937& random);

std::vector<ViewParameters> RandomViews(Projection projection, int count, std::mt19937& random);

struct OpacityOfLength {
  std::function<FrameSetup(const SetupOptions& options, int view)> setup;
  std::function<double(const FrameSetup& setup, int x, int y)> length = LengthInside;  // 0: the pixel is not looked at
  double least_length = 0;                                                             // voxel lengths: nor are shorter rays
};
// A homogeneous volume looks the same from every side: the opacity of a pixel follows from the length of its ray in it, to a hundredth.
void ExpectOpacityOfLength(const Volume& volume, const std::vector<ViewParameters>& views, const OpacityOfLength& of);
// Planes through the volume, and a box in one in two; the mode is left to the caller.
Clipping RandomClipping(const VolumeGeometry& geometry, std::mt19937& random);

// The voxels of `box`, which lies in the volume.
std::unique_ptr<BoxData> CutBox(const Volume& volume, const Box& box);

// The volume, or a grid that stands for it (AsGrid) if `kind` draws cells.
Volume VolumeFor(const RendererKind& kind, Volume volume);
// What `kind` renders `box` from: voxels, and the volume's cells if it draws cells.
std::unique_ptr<BoxData> BoxFor(const RendererKind& kind, const Volume& volume, const Box& box, std::int32_t halo = kHalo);
// The frame, of the whole volume as one box.
LocalImage RenderWhole(const Volume& volume, const FrameSetup& setup);
// Hides each tile of the frame with probability `part`: every other pixel keeps its bits, and if all tiles are hidden
// nothing is drawn.
void ExpectHiddenTilesChangeNothingElse(const Volume& volume, const FrameSetup& setup, double part, std::mt19937& random);
// The images of the boxes, combined in visibility order. `render`: that of a box.
LocalImage CombinedBoxes(const FrameSetup& setup, const Partition& partition, const std::function<LocalImage(const Box&)>& render);
// Each box of the partition from its own padded box, combined in visibility order.
LocalImage RenderByBoxes(const Volume& volume, const FrameSetup& setup, const Partition& partition, std::uint64_t* drawn = nullptr);
// The picture, of the whole volume as one box.
LocalImage RenderPicture(const Volume& volume, const FrameSetup& setup);

// A frame of several fields: its volume, and the fields of FrameSetup::fields, each of one level.
struct Scene {
  Volume volume;
  std::vector<Volume> fields;
  FrameSetup setup;

  void Show(Volume field, FieldLook look);
  void Show(Volume labels, LabelLook look);  // after the other fields
  void Hide();                               // all but the volume

 private:
  FieldSetup& Add(Volume field);
};
// The voxels that a box of a scene is rendered from.
struct SceneBoxes {
  SceneBoxes(const Scene& scene, const Box& box);
  std::unique_ptr<BoxData> volume;
  std::vector<std::unique_ptr<BoxData>> fields;  // null: the field does not reach there
};
LocalImage Rendered(const Scene& scene, const Box& box);
LocalImage Rendered(const Scene& scene);
// Turned in any way, with its middle somewhere in the volume.
VolumeGeometry RandomGridIn(const VolumeGeometry& volume, std::mt19937& random);

// `boxes` slabs along an axis (fewer where there are not as many slices).
Partition CutIntoSlabs(const Volume& volume, int boxes, Axis axis);
// A kd-tree with `boxes` leaves cut at random places.
Partition CutAtRandom(const Box& bounds, int boxes, std::mt19937& random);

// Four channels of a pixel; zeros outside the image's bounds.
std::array<float, 4> PixelOf(const LocalImage& image, int x, int y);
// Largest difference of any channel of any pixel of either image.
float LargestDifference(const LocalImage& a, const LocalImage& b);

}  // namespace slabstream::testing
