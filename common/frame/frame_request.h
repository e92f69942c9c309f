// FrameRequest: one picture, as a client asks for it. Policy: how the service should make it; it never changes the picture.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "common/base/status.h"
#include "common/classification/transfer_function.h"
#include "common/frame/field_look.h"
#include "common/text/parse_number.h"
#include "common/view/camera.h"
#include "common/view/clip.h"
#include "common/view/shading.h"
#include "common/volume/field_info.h"
#include "common/volume/missing.h"

namespace slabstream {

inline constexpr int kMaxGroups = 1024, kMaxTeams = 1024;
inline constexpr double kDefaultTermination = 1.0 / 1024, kMaxTermination = 0.5;
inline constexpr double kMaxPixelError = 0.1;
inline constexpr int kMaxLevels = 64;  // levels of a dataset
inline constexpr std::size_t kMaxNameBytes = 256;
inline constexpr std::string_view kAutomatic = "auto";  // in place of a name: the service chooses
inline constexpr std::string_view kLastTime = "last";   // in place of a time: the newest one

// kAuto: z, or the longest axis of slabs (SlabAxis), so that turning the view never moves voxels. kView: the axis along which the slices of
// the frame are traversed, so that no slice is divided. Each of the three axes then has its own layout; workers fetch its voxels when a
// view first needs it.
enum class AxisChoice : std::uint8_t { kX = 0, kY = 1, kZ = 2, kAuto = 3, kView = 4 };
inline constexpr std::array<std::string_view, 5> kAxisChoiceNames = {"x", "y", "z", "auto", "view"};  // by AxisChoice
constexpr std::string_view NameOf(AxisChoice axis) { return kAxisChoiceNames.at(std::size_t(axis)); }

struct Policy {
  std::string decomposition = "kd-tree";  // a name of Decompositions()
  std::string balance_by = "auto";        // of BalanceByChoices(): what boxes have equal shares of
  AxisChoice axis = AxisChoice::kAuto;
  int groups = 0;                     // [1, kMaxGroups]; 0: the planner chooses
  std::string assignment = "cyclic";  // of Assignments(): who owns which box
  std::string balance = "static";     // of Balances(): whether boxes change between frames
  std::string combine;                // a scheme with its arguments (common/combining/schemes.h); empty: StandardCombining
  // How much a channel of the picture may change because workers send colours in fewer bits: [0, kMaxPixelError]; 0: not at all.
  double pixel_error = 0;
  int teams = 1;  // [1, kMaxTeams]: render frames in turn (common/planning/team.h); 1: all workers share every frame
  friend bool operator==(const Policy&, const Policy&) = default;
};

// A preset's name (resolved by the coordinator, which knows the volume) or the function itself. The other fields replace those of a preset
// or function.
struct TransferChoice {
  std::variant<std::string, TransferFunction> choice = std::string("auto");
  double opacity_distance = 1;  // voxel lengths
  // Data values onto which the curves are stretched, so that their first point is at `min` and their last one at `max`: in
  // [-kMaxScalar, kMaxScalar], min < max. None: they stay.
  std::optional<ScalarRange> scalar_range = {};
  std::vector<Isosurface> isosurfaces = {};                   // only renderers with Ability::kIsosurfaces draw them
  std::vector<GradientOpacityPoint> gradient_opacities = {};  // only renderers with Ability::kGradientOpacity use them
  friend bool operator==(const TransferChoice&, const TransferChoice&) = default;
};

// Values of a renderer's parameters (RendererKind::parameters), by name, as a user types them. Missing ones have their defaults.
using ParameterTexts = std::map<std::string, std::string, std::less<>>;
inline constexpr std::size_t kMaxParameters = 32;

// A shape (common/shapes/shape.h) that the picture shows beside its volume, and how.
struct ShapeChoice {
  std::string shape;                      // name of a dataset that is one, 1 ... kMaxNameBytes
  std::optional<Rgb> color = {};          // none: colours of vertices, or of values by `map`, or white, as the shape has them
  double opacity = 1;                     // (0, 1]
  double width = 0;                       // thickness of lines, diameter of points; 0: the shape's radii, or some pixels
  bool width_in_pixels = false;           // of the picture; else in the world's unit
  std::string map = {};                   // name of a colour map (NamedColorMaps) for the values of vertices; empty: "viridis"
  std::optional<ScalarRange> range = {};  // that the colour map spans; none: all values of its first time
  std::optional<int> time = {};           // the number of one of its times; none: that of the picture
  friend bool operator==(const ShapeChoice&, const ShapeChoice&) = default;
};
inline constexpr std::string_view kStandardShapeMap = "viridis";
inline constexpr int kMaxShapeTime = 1'000'000;

// A plane through the volume that shows the volume's values, unlit.
struct PlaneChoice {
  ClipSlab slab = {};                     // its middle; of thickness 0
  double opacity = 1;                     // (0, 1]
  std::string map = {};                   // name of a colour map (NamedColorMaps); empty: "grey"
  std::optional<ScalarRange> range = {};  // that the colour map spans; none: what the transfer function "window" spans
  friend bool operator==(const PlaneChoice&, const PlaneChoice&) = default;
};
inline constexpr std::string_view kStandardPlaneMap = "grey";
inline constexpr std::size_t kMaxPlanes = 16;

// The number of a level; none: the text is kAutomatic, or neither (IsLevel).
inline std::optional<int> LevelNumber(std::string_view text) {
  const std::optional<int> number = ParseNumber<int>(text);
  return number && *number >= 0 && *number < kMaxLevels ? number : std::nullopt;
}
inline bool IsLevel(std::string_view text) { return text == kAutomatic || LevelNumber(text); }

struct FrameRequest {
  std::string dataset;  // a name of the catalogue, 1 ... kMaxNameBytes
  std::string renderer{
      kAutomatic};            // a name of Renderers() (common/renderers/registry.h), or kAutomatic: one that can do it (RenderersFor)
  ParameterTexts parameters;  // the renderer's parameters
  ImageSize size;
  ViewParameters view;
  Clipping clipping;  // empty: the whole volume is drawn
  TransferChoice transfer;
  // Which channels of the dataset show, by name or number; empty: those that the dataset says. At most kMaxShownFields.
  std::vector<std::string> channels = {};
  std::vector<FieldChoice> fields = {};  // looks of fields, none named twice; at most kMaxFields
  Blend blend = Blend::kAuto;            // of all fields; kAuto: each has its own
  // A time of the dataset: its number, a number with a unit of time such as "3.5s", or kLastTime; empty: the one that the dataset's file
  // says, mostly the first.
  std::string time = {};
  std::vector<ShapeChoice> shapes = {};  // at most kMaxShownShapes
  std::vector<PlaneChoice> planes = {};  // at most kMaxPlanes
  Shading shading;
  double brightness = 1;                     // [0, 10]: factor of the colours of the transfer function and isosurfaces
  double termination = kDefaultTermination;  // [0, kMaxTermination]: transmittance below which what lies behind is skipped; 0: never
  // Which level of a dataset that has several is drawn (common/planning/levels.h).
  double detail = 1;  // [0, 1000]: the coarsest one whose voxels are at most so many pixels wide; 0: as 1, but coarser as memory needs it
  std::string level{kAutomatic};     // the number of a level, in [0, kMaxLevels); kAutomatic: as `detail` says
  Missing missing = Missing::kFail;  // of processes that hold voxels
  Policy policy;
  bool previews = false;  // a picture after each group
  // Pictures may come without depths, and in the codes that a PNG of 8 bits has (ColorCoding::kStraight8): a quarter of the bytes.
  bool straight8 = false;
  std::optional<Rgb> straight8_over = {};  // these codes are those of the picture over this colour; none: of the picture alone
  bool key = false;                        // pictures come with what their colours mean (PictureKey)
  friend bool operator==(const FrameRequest&, const FrameRequest&) = default;
};

inline bool ShowsShape(const FrameRequest& request, std::string_view dataset) {
  return std::ranges::find(request.shapes, dataset, &ShapeChoice::shape) != request.shapes.end();
}

// The look of a field of this name or number; it is made if there is none.
inline FieldChoice& ChoiceOf(std::string_view field, FrameRequest& request) {
  const auto found = std::ranges::find(request.fields, field, &FieldChoice::field);
  return found != request.fields.end() ? *found : request.fields.emplace_back(FieldChoice{.field = std::string(field)});
}

// How labels are shown; null: they are not, unless the dataset has nothing else.
inline const LabelChoice* LabelsOf(const FrameRequest& request) {
  const auto found = std::ranges::find_if(request.fields, [](const FieldChoice& choice) { return choice.labels.has_value(); });
  return found != request.fields.end() ? &*found->labels : nullptr;
}
// The same; labels that are not shown are, from now on.
inline LabelChoice& ShownLabels(FrameRequest& request) {
  std::optional<LabelChoice>& labels = ChoiceOf(kLabelsField, request).labels;
  return labels ? *labels : labels.emplace();
}

}  // namespace slabstream
