// RendererKind: the planning half of a renderer. It answers what the planner, the coordinator, the wire, the command line and the
// laboratory ask about a renderer, without voxels, sockets, threads or clocks. The pixel half (worker/renderers/renderer.h) renders boxes.
// Both halves have one name; common/renderers/CMakeLists.txt has the only list of names.
//
// Every kind is a constant object (Renderers()) that any thread may use.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/status.h"
#include "common/classification/classification_table.h"
#include "common/frame/frame_setup.h"
#include "common/renderers/ability.h"
#include "common/stats/report.h"
#include "common/volume/occupancy_grid.h"
#include "common/volume/summary.h"

namespace slabstream {

struct LocalImage;

// Which point of a ray its pixel shows (coordinator/probe/pick.h).
enum class PickRule : std::uint8_t {
  kHalfOpacity,  // where half of the light is lost
  kSurface,      // where it meets the first opaque voxel
  kLargest,      // where the volume has its largest value, or its least one
  kLeast,
  kMean,  // no single one: the pixel shows the mean of the ray's values
  kNone,  // no single one: the pixel is opaque where its ray meets the volume
};

// A number or a choice that a request may set for a renderer, such as sampling-rate. The command line takes it as --NAME.
struct RendererParameter {
  std::string_view name;                  // lower case with hyphens
  std::string_view purpose;               // one line for --help
  double standard = 0;                    // if the request says nothing; for choices, an index
  double least = 0, most = 0;             // limits of a number
  std::vector<std::string_view> choices;  // by value; empty: a number

  double greatest() const { return choices.empty() ? most : double(choices.size() - 1); }  // valid value
};

// The direction and scale of a view whose cost is asked for.
struct CostView {
  Axis along = Axis::kY;        // data axis nearest to the view direction
  double pixels_per_voxel = 1;  // pixels of the frame that the smallest side of a voxel takes, > 0
};

// The view of a setup's frame.
CostView CostViewOf(const FrameSetup& setup);

// The time that boxes of one volume take under one transfer function: seconds of one thread; 0 if the box draws nothing. `box` lies inside
// the volume and is not empty.
using AnalyticCost = std::function<double(const Box& box, const CostView& view)>;

// What an AnalyticCost is made from; all of it must outlive it.
struct CostBasis {
  const OccupancyGrid* drawn = nullptr;  // voxels that the renderer draws (RendererKind::DrawnTable)
  const VolumeSummary* summary = nullptr;
  const TransferFunction* transfer = nullptr;
  std::span<const double> parameters;  // one value for each of the renderer's parameters(); empty: the defaults
};

class RendererKind {
 public:
  struct Facts {
    std::string_view name;     // the name in --renderer and in messages: "splat"
    std::string_view title;    // in reports: "splatting"
    std::string_view purpose;  // one line for --help
    // The format of local images with default parameters; says how they combine (common/kernels/combine.h).
    PixelFormat format = PixelFormat::kRgba;
    std::int32_t reach = kHalo;      // voxels round a box that it reads, [0, kHalo]
    double derived_from_stored = 1;  // bytes that it derives from a byte of voxels that are read in parts, at most, [0, 2]
    // The opacity of a place depends on the values next to it alone: it is Table's of a value between the least and the greatest of them.
    bool opacity_by_value = false;
    bool along_slices = false;                     // the frame is an image along the slices (SheetGrid), else the camera's
    std::vector<Ability> abilities;                // in order
    double footprint = 1;                          // pixels that a voxel fills, for each pixel of its cross-section
    std::vector<Stage> stages = {Stage::kSample};  // stages that the pixel half charges time to, in order
    std::vector<RendererParameter> parameters;
  };

  explicit RendererKind(Facts facts) : facts_(std::move(facts)) {}
  virtual ~RendererKind() = default;
  RendererKind(const RendererKind&) = delete;
  RendererKind& operator=(const RendererKind&) = delete;

  std::string_view name() const { return facts_.name; }
  std::string_view title() const { return facts_.title; }
  std::string_view purpose() const { return facts_.purpose; }
  PixelFormat format() const { return facts_.format; }
  std::int32_t reach() const { return facts_.reach; }
  double derived_from_stored() const { return facts_.derived_from_stored; }
  bool opacity_by_value() const { return facts_.opacity_by_value; }
  bool along_slices() const { return facts_.along_slices; }
  const std::vector<Ability>& abilities() const { return facts_.abilities; }
  std::vector<std::string_view> AbilityNames() const;
  bool Can(Ability ability) const { return std::ranges::find(facts_.abilities, ability) != facts_.abilities.end(); }
  // Those that it draws.
  std::span<const Projection> projections() const {
    static constexpr Projection kProjections[] = {Projection::kOrthographic, Projection::kPerspective};
    return std::span(kProjections).first(Can(Ability::kPerspective) ? 2 : 1);
  }
  double footprint() const { return facts_.footprint; }
  const std::vector<Stage>& stages() const { return facts_.stages; }
  const std::vector<RendererParameter>& parameters() const { return facts_.parameters; }

  // The pixel format of local images, which may depend on the values of parameters().
  virtual PixelFormat FormatOf(const std::vector<double>& /*parameters*/) const { return facts_.format; }

  virtual PickRule PickRuleOf(const std::vector<double>& /*parameters*/) const {
    return facts_.format == PixelFormat::kDepth ? PickRule::kSurface : PickRule::kHalfOpacity;
  }

  // Fills in the frame that workers render for a picture of `size` under `view`, both valid: camera, and sheets if the renderer works
  // along slices. `setup` has its description. InvalidArgument: the frame would be too large. The default is
  // the picture's own grid, supersampled where it is minified.
  virtual Status SetView(const ViewParameters& view, ImageSize size, FrameSetup& setup) const;

  // The table by which the pixel half looks up stored samples. The default is Classify.
  virtual ClassificationTable Table(const TransferFunction& transfer, const VolumeDescription& description, ValueRange range) const;

  // The classification table whose opacity is 0 in exactly the bins that the renderer does not draw. Boxes without a drawn voxel within
  // their reach are not rendered. Empty-space skipping uses it, too.
  // The default is Table.
  virtual ClassificationTable DrawnTable(const TransferFunction& transfer, const VolumeSummary& summary) const;

  virtual AnalyticCost MakeCost(const CostBasis& basis) const = 0;

  // Makes the picture from the accumulated frame or a share of it, which stores all its pixels. Bounds of the result are in pixels of the
  // picture.
  // Runs within the caller's task arena. The default resamples a frame along slices, and averages supersampled pixels.
  virtual LocalImage Finish(const LocalImage& frame, const FrameSetup& setup) const;
  // Whether the picture is the frame as it is: Finish would only copy it, and there are no shapes beside it.
  bool FrameIsPicture(const FrameSetup& setup) const { return setup.shapes.empty() && FinishCopies(setup); }
  // Whether the pictures that Finish makes of parts of a frame add up to that of the whole one.
  bool FinishesInShares(const FrameSetup& setup) const { return FrameIsPicture(setup) || setup.format == PixelFormat::kRgba; }

 protected:
  virtual bool FinishCopies(const FrameSetup& setup) const;

 private:
  const Facts facts_;
};

// Sets renderer, halo, default parameters and the format that they imply.
void SetRenderer(const RendererKind& kind, FrameSetup& setup);
// Sets one value for each of the renderer's parameters, and the format that they imply.
void SetParameters(std::vector<double> values, FrameSetup& setup);

}  // namespace slabstream
