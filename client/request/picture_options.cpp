#include "client/request/picture_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "client/request/camera_json.h"
#include "client/request/layer_options.h"
#include "client/request/values.h"
#include "client/request/volume_argument.h"
#include "common/base/files.h"
#include "common/cli/add_option.h"
#include "common/combining/schemes.h"
#include "common/decomposition/decomposition.h"
#include "common/planning/assignment.h"
#include "common/planning/policy_names.h"
#include "common/renderers/registry.h"
#include "common/view/named_view.h"

namespace slabstream {
namespace {

constexpr char kLeftToThePlanner[] = "what should be fastest for this volume, view and service";

// An option that takes a name from a list such as Decompositions(), whose entries have a name and a purpose. `automatic`: the purpose of
// kAutomatic, if the option also takes that.
template <class Entries>
CLI::Option* AddNamed(CLI::App& app, const std::string& name, std::string& target, const Entries& entries, const std::string& help,
                      std::string_view automatic = {}) {
  std::string text = help;
  std::vector<std::string_view> names;
  if (!automatic.empty()) {
    names.push_back(kAutomatic);
    text += fmt::format("\n  {}: {}", kAutomatic, automatic);
  }
  for (const auto& entry : entries) names.push_back(entry.name);
  return AddName(app, name, target, names, text + Explained(entries))->default_str(target);
}

// An option for a renderer's parameter.
void AddParameter(CLI::App& app, const RendererParameter& parameter, const std::string& help, FrameRequest& request) {
  const bool choice = !parameter.choices.empty();
  CLI::Option* const option = app.add_option_function<std::string>(
      "--" + std::string(parameter.name),
      [&request, key = std::string(parameter.name)](const std::string& text) { request.parameters[key] = text; }, help);
  (choice ? NoteChoices(option, parameter.choices) : NoteRange(option, {parameter.least, parameter.most}))
      ->type_name(choice ? "NAME" : "NUMBER")
      ->default_str(choice ? std::string(parameter.choices[std::size_t(parameter.standard)]) : fmt::format("{:g}", parameter.standard));
}

// --renderer, and an option for each parameter of any renderer. Whether the chosen renderer has it is checked with the request.
void AddRendererOptions(CLI::App& app, FrameRequest& request) {
  std::string help = "How voxels become a picture";
  std::map<std::string_view, std::pair<const RendererParameter*, std::string>> parameters;  // and the renderers with this parameter
  for (const RendererKind* kind : Renderers()) {
    help += fmt::format("\n  {}: {}", kind->name(), kind->purpose());
    for (const RendererParameter& parameter : kind->parameters()) {
      auto& [entry, renderers] = parameters[parameter.name];
      entry = &parameter;
      renderers += (renderers.empty() ? "" : " and ") + std::string(kind->name());
    }
  }
  AddName(app, "--renderer", request.renderer, RendererNames(), help)->default_str(std::string(kDefaultRenderer));
  for (const auto& [name, entry] : parameters) {
    const auto& [parameter, renderers] = entry;
    AddParameter(app, *parameter, fmt::format("{}; for --renderer {}", parameter->purpose, renderers), request);
  }
}

void AddCombining(CLI::App& app, std::string& target) {
  std::string text = fmt::format("How workers combine their partial images\n  {}: {}", kAutomatic, kLeftToThePlanner);
  for (const CombiningEntry& entry : CombiningSchemes()) {
    text += fmt::format("\n  {}{}{}: {}", entry.name, entry.arguments.empty() ? "" : ":", entry.arguments, entry.purpose);
  }
  const auto parse = [](const std::string& option, const std::string& value) -> Result<std::string> {
    if (value == kAutomatic) return value;
    const Result<CombiningChoice> choice = ParseCombining(value);
    if (!choice.ok()) return Status::InvalidArgument(fmt::format("{} {}", option, choice.status().message()));
    return value;
  };
  AddParsed(app, "--combine", target, parse, text)->type_name("NAME[:ARGUMENTS]")->default_str(target);
}

Result<ViewParameters> ParseCameraFile(const std::string& option, const std::string& path) {
  constexpr std::size_t kMostBytes = std::size_t{1} << 16;
  const Result<std::string> text = ReadTextFile(path, kMostBytes);
  if (!text.ok()) return Status(text.status().code(), fmt::format("{} {}", option, text.status().message()));
  Result<ViewParameters> view = ParseCamera(*text);
  if (!view.ok()) return Status::InvalidArgument(fmt::format("{} {}: {}", option, path, view.status().message()));
  return view;
}

CLI::Option* AddPoint(CLI::App& app, const std::string& name, std::optional<Vec3>& point, const std::string& help) {
  return AddParsed(
             app, name, point, [](const std::string& option, const std::string& text) { return ParsePoint(option, text); }, help)
      ->type_name("X,Y,Z");
}

void AddSize(CLI::App& app, ImageSize& size, const std::string& help) {
  AddParsed(
      app, "--size", size, [](const std::string& option, const std::string& text) { return ParseImageSize(option, text); }, help)
      ->type_name("SIZE")
      ->default_str("512");
}

CLI::Option* AddNamedView(CLI::App& app, ViewParameters& view) {
  std::vector<std::string_view> names;
  for (const NamedView& named : kNamedViews) names.push_back(named.name);
  const auto store = [&view, is_name = OneOf(names)](const CLI::results_t& texts) {
    const Result<std::string> name = is_name("--view", texts.back());
    if (!name.ok()) throw CLI::ValidationError(name.status().message());
    const NamedView& named = *std::ranges::find(kNamedViews, *name, &NamedView::name);
    view.azimuth_degrees = named.azimuth_degrees;
    view.elevation_degrees = named.elevation_degrees;
    view.of_patient = named.of_patient;
    return true;
  };
  return NoteChoices(
      app.add_option("--view", CLI::callback_t(store), "Look at a side, instead of --azimuth and --elevation" + Explained(kNamedViews))
          ->type_name("NAME"),
      names);
}

void AddViewOptions(CLI::App& app, ViewParameters& view, ImageSize& size, bool files) {
  app.option_defaults()->group("View");
  const NumberRange angle{-kMaxAngleDegrees, kMaxAngleDegrees};
  AddSize(app, size, "Pixels: WIDTHxHEIGHT, or one number for a square");
  AddChoice<Projection, 2>(app, "--projection", view.projection, {NameOf(Projection::kOrthographic), NameOf(Projection::kPerspective)},
                           {Projection::kOrthographic, Projection::kPerspective}, "Orthographic or perspective projection")
      ->default_str(std::string(NameOf(view.projection)));
  CLI::Option* const named = AddNamedView(app, view);
  AddNumber(app, "--azimuth", view.azimuth_degrees, angle,
            "Degrees that the eye turns about +z; at 0 it looks along +y, at 90 it is on the +x side")
      ->excludes(named);
  AddNumber(app, "--elevation", view.elevation_degrees, angle, "Degrees that the eye is lifted towards +z")->excludes(named);
  AddPoint(app, "--look-at", view.look_at, "Point of the world that the picture's centre shows (default: the volume's centre)");
  app.add_flag("--fit", view.fit, "Frame what the transfer function shows, instead of the whole volume")
      ->excludes(app.get_option("--look-at"));
  CLI::Option* const eye = AddPoint(app, "--eye", view.eye, "Point of the world that one looks from, instead of a direction by angles");
  for (const char* angles : {"--view", "--azimuth", "--elevation"}) eye->excludes(app.get_option(angles));
  AddPoint(app, "--up", view.up, "Direction that is upwards in the picture, with --eye (default: 0,0,1)")->needs(eye);
  AddNumber(app, "--distance", view.distance, {0, kMaxWorldCoordinate},
            "Distance of the eye from the point that it looks at, for --projection perspective; 0: as far as needed to see all")
      ->excludes(eye);
  AddNumber(app, "--roll", view.roll_degrees, angle, "Degrees that the picture is turned clockwise");
  AddNumber(app, "--zoom", view.zoom, {kMinZoom, kMaxZoom}, "Magnification; at 1 the volume's bounding sphere fills the shorter side");
  AddNumber(app, "--fov", view.fov_degrees, {kMinFovDegrees, kMaxFovDegrees},
            "Field of view in degrees, for --projection perspective; the eye's distance follows");
  if (!files) return;
  CLI::Option* const camera = AddParsed(app, "--camera", view, ParseCameraFile, "Take the view from a file that --save-camera wrote");
  camera->type_name("FILE");
  for (const char* option : {"--projection", "--view", "--azimuth", "--elevation", "--look-at", "--fit", "--eye", "--up", "--distance",
                             "--roll", "--zoom", "--fov"}) {
    camera->excludes(app.get_option(option));
  }
}

void AddClipOptions(CLI::App& app, Clipping& clipping) {
  app.option_defaults()->group("Clipping");
  AddParsed(
      app, "--clip-box", clipping.box, [](const std::string& option, const std::string& text) { return ParseClipBox(option, text); },
      "Draw only what lies in this box of the world; a v at the end makes the bounds voxel numbers, a % shares of the sides; a bound that "
      "is "
      "left out does not clip, as in :,:,:50%")
      ->type_name("X0:X1,Y0:Y1,Z0:Z1");
  app.add_option(
         "--clip-plane", CLI::callback_t([&clipping](const CLI::results_t& texts) {
           clipping.planes.clear();
           for (const std::string& text : texts) {
             const Result<ClipPlane> plane = ParseClipPlane("--clip-plane", text);
             if (!plane.ok()) throw CLI::ValidationError(plane.status().message());
             clipping.planes.push_back(*plane);
           }
           if (texts.size() <= kMaxClipPlanes) return true;
           throw CLI::ValidationError(fmt::format("--clip-plane is given {} times, at most {} are possible", texts.size(), kMaxClipPlanes));
         }),
         "Draw only the points X,Y,Z of the world with NX*X + NY*Y + NZ*Z + D >= 0; may be repeated")
      ->type_name("NX,NY,NZ,D")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  AddChoice<ClipMode, 2>(app, "--clip-mode", clipping.mode, {"keep", "cut-away"}, {ClipMode::kKeep, ClipMode::kCutAway},
                         "keep: draw what the box and all planes leave; cut-away: draw everything else")
      ->default_str("keep");
}

void AddPictureFormat(CLI::App& app, PictureFormat& format) {
  AddParsed(
      app, "--background", format.background, [](const std::string& option, const std::string& text) { return ParseColor(option, text); },
      "Colour behind the picture: R,G,B or R,G,B,A from 0 to 1, #rrggbb, #rrggbbaa, or a name such as white (default: transparent, which "
      "is black in a movie)")
      ->type_name("COLOUR");
  AddChoice<int, 2>(app, "--depth", format.png_bits, {"8", "16"}, {8, 16}, "Bits of each channel of a PNG: 8 or 16")->default_str("8");
}

void AddSurfaceOptions(CLI::App& app, TransferChoice& transfer) {
  AddParsed(
      app, "--isovalue", transfer.isosurfaces,
      [](const std::string& option, const std::string& text) { return ParseIsosurfaces(option, text); },
      "Draw the surfaces at these data values, as in 120:red:0.3,300; COLOUR is as for --background, OPACITY is 1 if left out. Without "
      "--transfer they stand alone, else both are drawn. zbuffer: voxels of at least V are opaque, in the colour of the greatest V that "
      "they reach; for --renderer raycast and zbuffer")
      ->type_name("V[:COLOUR[:OPACITY]],...");
  AddParsed(
      app, "--gradient-opacity", transfer.gradient_opacities,
      [](const std::string& option, const std::string& text) { return ParseGradientOpacities(option, text); },
      "Multiply opacities by a factor O that depends on the gradient's magnitude G, in data values per unit of the world (mm of a "
      "patient); linear between the points, which ascend; for --renderer raycast and shear")
      ->type_name("G:O,...");
}

void AddLookOptions(CLI::App& app, FrameRequest& request, PictureFormat& format, bool files) {
  app.option_defaults()->group("Look");
  AddRendererOptions(app, request);
  AddTransferOptions(app, request.transfer, files);
  AddSurfaceOptions(app, request.transfer);
  AddChoice<ShadingModel, 3>(
      app, "--shading", request.shading.model, kShadingModelNames,
      {ShadingModel::kPhong, ShadingModel::kNone, ShadingModel::kDepthGradient},
      "Lighting; phong: lit surfaces; none: the material's own colours; depth-gradient: lit surfaces, with normals from "
      "the depths of the picture; zbuffer only")
      ->default_str("phong");
  app.add_option("--light", CLI::callback_t([&request](const CLI::results_t& texts) {
                   request.shading.lights.clear();
                   for (const std::string& text : texts) {
                     const Result<Vec3> light = ParseDirection("--light", text);
                     if (!light.ok()) throw CLI::ValidationError(light.status().message());
                     request.shading.lights.push_back(*light);
                   }
                   if (int(texts.size()) <= kMaxLights) return true;
                   throw CLI::ValidationError(fmt::format("--light is given {} times, at most {} are possible", texts.size(), kMaxLights));
                 }),
                 "Direction towards a light, along the world's axes; may be repeated (default: a light at the eye)")
      ->type_name("X,Y,Z")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  AddNumber(app, "--termination", request.termination, {0, kMaxTermination},
            "Skip what lies behind material whose remaining transmittance is below this; 0: skip nothing");
  AddPictureFormat(app, format);
}

void AddAnnotationOptions(CLI::App& app, Annotations& annotations) {
  app.option_defaults()->group("Annotations (drawn onto the picture)");
  app.add_flag("--scale-bar", annotations.scale_bar,
               "A scale bar: mm for patients, else voxels or the unit of the file; under perspective it holds at the depth of the target");
  app.add_flag("--orientation-marker", annotations.orientation_marker,
               "The axes of the world; of patients also the sides (R, L, A, P, S, I) at the edges of the picture");
  AddParsed(
      app, "--title", annotations.title,
      [](const std::string& option, const std::string& text) { return TextIf(CheckTitle(option, text), text); },
      fmt::format("A line of at most {} characters at the top", kMaxTitleCharacters))
      ->type_name("TITLE");
}

void AddPolicyOptions(CLI::App& app, Policy& policy) {
  app.option_defaults()->group("Distribution (never changes the picture)");
  AddNamed(app, "--decomposition", policy.decomposition, Decompositions(), "How the volume is divided into boxes", kLeftToThePlanner);
  AddChoice<AxisChoice, 5>(
      app, "--axis", policy.axis, kAxisChoiceNames, {AxisChoice::kX, AxisChoice::kY, AxisChoice::kZ, AxisChoice::kAuto, AxisChoice::kView},
      "Axis along which slabs are cut, and other boxes first: x, y, z, auto, or view, the axis nearest to the view direction")
      ->default_str("auto");
  AddNamed(app, "--balance-by", policy.load_metric, LoadMetrics(), "The load metric: what boxes have equal shares of");
  AddNamed(app, "--split", policy.load_metric, LoadMetrics(), "")->group(kHidden);
  AddNamed(app, "--assignment", policy.assignment, Assignments(), "Which worker owns which box", kLeftToThePlanner);
  AddNamed(app, "--balance", policy.balance, BalanceModes(), "Whether boxes change from frame to frame");
  AddParsed(
      app, "--groups", policy.groups,
      [](const std::string& option, const std::string& text) -> Result<int> {
        if (text == kAutomatic) return 0;
        return ParseInteger(option, text, 0, kMaxGroups);
      },
      "Groups of boxes, nearest first, that are rendered one after the other; auto, or 0: the service chooses, by memory and, across "
      "hosts, by time")
      ->type_name("N|auto")
      ->default_str(std::string(kAutomatic));
  AddInteger(app, "--frame-parallel", policy.teams, 1, kMaxTeams,
             "Frames rendered at the same time, each by its own part of the workers, which needs all voxels in every part");
  AddInteger(app, "--teams", policy.teams, 1, kMaxTeams, "")->group(kHidden);
  AddCombining(app, policy.combine);
  AddNumber(app, "--pixel-error", policy.pixel_error, {0, kMaxPixelError},
            "How far a colour from 0 to 1 may be off so that workers can send each other 16 bits a channel instead of 32");
}

}  // namespace

void AddScalarRange(CLI::App& app, TransferChoice& transfer) {
  AddParsed(
      app, "--scalar-range", transfer.scalar_range,
      [](const std::string& option, const std::string& text) { return ParseScalarRange(option, text); },
      "Stretch the transfer function over these data values, or with % over these percentiles of the values above the background, as in "
      "2%:98% (default: those of the function itself)")
      ->type_name("LOW:HIGH");
}

void AddTransferOptions(CLI::App& app, TransferChoice& transfer, bool files) {
  AddParsed(
      app, "--transfer", transfer.choice,
      [files](const std::string& option, const std::string& text) {
        return files ? ParseTransfer(option, text) : ParseTransferText(option, text);
      },
      fmt::format("Transfer function: a ParaView colour map ({}) or one of these presets", files ? "a .json file" : "its JSON") +
          Explained(TransferPresets()))
      ->type_name("TRANSFER")
      ->default_str("auto");
  AddScalarRange(app, transfer);
  AddNumber(app, "--opacity-distance", transfer.opacity_distance, {0, kMaxOpacityDistance, true},
            "Length of material, in voxels, that has the opacity which the transfer function says");
}

void LetSurfacesStandAlone(const CLI::App& app, TransferChoice& transfer) {
  if (!transfer.isosurfaces.empty() && app.get_option("--transfer")->count() == 0) transfer.choice = std::string(kNoTransfer);
}

void AddRenderPictureOptions(CLI::App& app, FrameRequest& request, PictureFormat& format, LayerFiles* files) {
  AddViewOptions(app, request.view, request.size, files != nullptr);
  AddClipOptions(app, request.clipping);
  AddLookOptions(app, request, format, files != nullptr);
  AddLayerOptions(app, request, files);
  AddAnnotationOptions(app, format.annotations);
  AddPolicyOptions(app, request.policy);
}

void AddSlicePictureOptions(CLI::App& app, SliceRequest& slice, LayerFiles* files) {
  app.option_defaults()->group("Plane");
  std::vector<std::string_view> names;
  for (const SliceChoice& choice : kSliceChoices) names.push_back(choice.name);
  const auto parse = [is_name = OneOf(names)](const std::string& option, const std::string& text) -> Result<std::span<const SlicePlane>> {
    const Result<std::string> name = is_name(option, text);
    if (!name.ok()) return name.status();
    return std::ranges::find(kSliceChoices, *name, &SliceChoice::name)->planes;
  };
  NoteChoices(AddParsed(app, "--plane", slice.planes, parse, "Which plane" + Explained(kSliceChoices)), names)
      ->type_name("NAME")
      ->default_str(std::string(kSliceChoices.back().name));
  CLI::Option* const at = AddPoint(app, "--at", slice.at, "Point of the world that the planes go through (default: the volume's centre)");
  AddParsed(
      app, "--index", slice.index,
      [](const std::string& option, const std::string& text) { return ParseInteger(option, text, 0, kMaxVolumeSide - 1); },
      "Number of the slice, counted from 0, instead of a point")
      ->type_name("K")
      ->excludes(at);
  AddNumber(app, "--thickness", slice.thickness, {0, kMaxWorldCoordinate},
            "Show the largest values of a slab of this thickness, in the unit of the world (mm of a patient); 0: the values in the plane");
  AddSize(app, slice.frame.size, "Pixels of each plane: WIDTHxHEIGHT, or one number for a square");

  app.option_defaults()->group("Look");
  const auto value = [](const std::string& option, const std::string& text) { return ParseNumber(option, text, {-1e30, 1e30}); };
  CLI::Option* const window = AddParsed(
                                  app, "--window", slice.window,
                                  [](const std::string& option, const std::string& text) {
                                    return ParseNumber(option, text, {0, 1e30, true});
                                  },
                                  "Width of the range of values from black to white")
                                  ->type_name("VALUE");
  AddParsed(app, "--level", slice.level, value, "Middle of the range of values from black to white")
      ->type_name("VALUE")
      ->default_str("half of --window")
      ->needs(window);
  AddTransferOptions(app, slice.frame.transfer, files != nullptr);
  app.get_option("--transfer")->excludes(window)->default_str("window");
  for (const RendererParameter& parameter : RequireRenderer(slice.frame.renderer).value()->parameters()) {
    AddParameter(app, parameter, std::string(parameter.purpose), slice.frame);
  }
  AddPictureFormat(app, slice.format);
  AddLayerOptions(app, slice.frame, files, false);
}

}  // namespace slabstream
