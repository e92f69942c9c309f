// The cases of `slabstream bench`: volumes, looks and views with fixed names, so that figures of different days and machines compare.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/frame/frame_request.h"
#include "common/renderers/registry.h"
#include "common/volume/clusters.h"
#include "common/volume/sphere.h"
#include "common/volume/volume.h"
#include "laboratory/bench/ball_grid.h"

namespace slabstream {

struct BenchCase {
  std::string name;     // in the table; fit for a file's name
  std::string purpose;  // one line for --list
  std::string dataset;  // the volume's name: cases of one volume share it, and at a service it is the dataset's
  std::variant<SphereRequest, ClusterRequest, GridRequest, std::string> volume;  // made here, or a file's path (unused at a service)
  const RendererKind* renderer = &DefaultRenderer();
  TransferChoice transfer;
  std::optional<double> opacity;  // the opacity of an occupied voxel, where all have the same
  // The renderer's parameters; standard cases: one sample a voxel length, as other programs take by default.
  ParameterTexts parameters;
};

std::optional<int> SideOf(const BenchCase& bench_case);  // voxels, of a volume that is made here

const std::vector<BenchCase>& StandardBenchCases();

// A sphere whose occupied voxels have this opacity.
BenchCase SphereCase(const SphereRequest& sphere, double opacity, const RendererKind* renderer = &DefaultRenderer());
// With the occupancy of its class, 5 or 40 %. A renderer that shows surfaces gets an opaque one.
BenchCase StandardSphere(SphereClass sphere_class, int size, const RendererKind* renderer = &DefaultRenderer());
inline constexpr double kTranslucentSphere = 0.05, kOpaqueSphere = 0.9;
// Sparse balls whose occupied voxels have this opacity.
BenchCase ClusterCase(const ClusterRequest& clusters, double opacity, const RendererKind* renderer = &DefaultRenderer());
// Surfaces for a renderer that shows them, else translucent.
BenchCase StandardClusters(int size, const RendererKind* renderer = &DefaultRenderer());
// A transfer function for spheres and clusters. It shows only those values that occupied voxels have in the half of the
// volume where x is large.
TransferFunction HalfShown(double opacity);
// A ball in an unstructured grid, by slicing.
BenchCase GridCase(const GridRequest& grid);
// The MRI brain of Debian's package mricron-data.
BenchCase BrainCase(const RendererKind* renderer = &DefaultRenderer());

// A standard case's name; class1-SIZE, class2-SIZE or clusters-SIZE, with -OCCUPANCY behind it or without; or FILE[:TRANSFER] of a volume
// file
// (`at_service`: NAME[:TRANSFER] of a dataset), with TRANSFER as in --transfer. NotFound, InvalidArgument: naming the text.
Result<BenchCase> ParseBenchCase(const std::string& text, bool at_service);

// Makes or reads its volume. Never gets it from a service.
Result<std::shared_ptr<const Volume>> LoadBenchVolume(const BenchCase& bench_case);

// The turntable of every case: frame `index` of `frames` of one turn. Orthographic: the side of a cube fills the picture's side.
// Perspective, if the renderer draws it: the eye is where the bounding sphere fits a cone of 30 degrees.
inline constexpr double kBenchElevationDegrees = 20, kBenchZoom = 1.732, kBenchFovDegrees = 30;
ViewParameters BenchView(Projection projection, int index, int frames);

// One of the views, with Phong shading by a headlight, cells of grids without light; everything else has the default of FrameRequest.
FrameRequest BenchRequest(const BenchCase& bench_case, const ViewParameters& view, ImageSize size);

}  // namespace slabstream
