#include "client/request/picture_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include "client/request/camera_file.h"
#include "client/request/layer_options.h"
#include "client/request/value_window.h"
#include "client/request/values.h"
#include "common/cli/add_option.h"
#include "common/renderers/registry.h"
#include "common/view/default_view.h"
#include "common/view/named_view.h"
#include "common/view/world_limits.h"
#include "common/wire/validate_request.h"

namespace slabstream {
namespace {

using Wanted = std::function<bool(const RequestOption&)>;

// Options for those of the table that are wanted, and what they exclude and need.
void AddRequestOptions(CLI::App& app, FrameRequest& request, ColorMaps maps, const Wanted& wanted) {
  for (const RequestOption& option : RequestOptions()) {
    if (wanted(option)) AddRequestOption(app, option, request, maps);
  }
  for (const RequestOption& option : RequestOptions()) {
    if (!wanted(option)) continue;
    for (const std::string& other : option.excludes) app.get_option("--" + option.name)->excludes(app.get_option("--" + other));
    for (const std::string& other : option.needs) app.get_option("--" + option.name)->needs(app.get_option("--" + other));
  }
}

// Options that stand for several fields.
void AddWholeViews(CLI::App& app, ViewParameters& view, bool files) {
  app.option_defaults()->group(app.get_option("--zoom")->get_group());
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
  CLI::Option* const named =
      app.add_option("--view", CLI::callback_t(store), "Look at a side, instead of --azimuth and --elevation" + Explained(kNamedViews))
          ->type_name("NAME");
  NoteChoices(named, names);
  for (const char* option : {"--azimuth", "--elevation", "--of-patient", "--eye"}) named->excludes(app.get_option(option));
  if (!files) return;
  CLI::Option* const camera = AddParsed(app, "--camera", view, ParseCameraFile, "Take the view from a file that --save-camera wrote");
  camera->type_name("FILE");
  ExcludeViewOptions(app, camera);
}

void AddPictureFormat(CLI::App& app, PictureFormat& format) {
  app.option_defaults()->group(app.get_option("--transfer")->get_group());
  AddParsed(
      app, "--background", format.background, [](const std::string& option, const std::string& text) { return ParseColor(option, text); },
      "Colour behind the picture: R,G,B or R,G,B,A from 0 to 1, #rrggbb, #rrggbbaa, or a name such as white (default: transparent, which "
      "is black in a movie)")
      ->type_name("COLOUR");
  AddChoice<int, 2>(app, "--depth", format.png_bits, {"8", "16"}, {8, 16}, "Bits of each channel of a PNG or TIFF: 8 or 16")
      ->default_str("8");
  AddInteger(app, "--quality", format.quality, 1, 100, "Quality of a JPEG or WebP");
  const auto dots = [](const std::string& option, const std::string& text) { return ParseInteger(option, text, 1, kMaxDotsPerInch); };
  CLI::Option* const dpi =
      AddParsed(app, "--dpi", format.dots_per_inch, dots,
                "Pixels an inch, as the file states them: the size of a figure in print, and of the page of a PDF or SVG")
          ->type_name("N")
          ->default_str(
              fmt::format("{} for pages and --font-size; other files of patients state the size of pixels there", kUsualDotsPerInch));
  NoteRange(dpi, {1, kMaxDotsPerInch});
}

void AddAnnotationOptions(CLI::App& app, Annotations& annotations) {
  app.option_defaults()->group("Annotations (drawn onto the picture)");
  app.add_flag("--scale-bar", annotations.scale_bar,
               "A scale bar: mm for patients, else the unit of the file or voxels; under perspective it holds at the depth of the target");
  app.add_flag("--orientation-marker", annotations.orientation_marker,
               "The axes of the world; of patients also the sides (R, L, A, P, S, I) at the edges of the picture");
  AddParsed(
      app, "--title", annotations.title,
      [](const std::string& option, const std::string& text) { return TextIf(CheckTitle(option, text), text); },
      fmt::format("A line of at most {} characters at the top", kMaxTitleCharacters))
      ->type_name("TITLE");
  AddOptionalValue(
      app, "--color-bar", annotations.color_bar, "",
      [](const std::string& option, const std::string& text) -> Result<std::optional<std::string>> {
        if (Status status = CheckTitle(option, text); !status.ok()) return status;
        return std::optional(text);
      },
      "The colours of the transfer function with their data values; CAPTION stands above them, such as a unit")
      ->type_name("[=CAPTION]");
  app.add_flag("--legend", annotations.legend, "Names and colours of the labels that are shown, and of isosurfaces");
  const NumberRange sizes{kMinFontSize, kMaxFontSize};
  const auto points = [sizes](const std::string& option, const std::string& text) { return ParseNumber(option, text, sizes); };
  CLI::Option* const font =
      AddParsed(app, "--font-size", annotations.font_size, points, "Size of the letters in points, of which 72 make an inch")
          ->type_name("NUMBER")
          ->default_str("1/31 of the picture's shorter side, at least 11 pixels");
  NoteRange(font, sizes);
}

}  // namespace

CLI::Option* AddRequestOption(CLI::App& app, const RequestOption& option, FrameRequest& request, ColorMaps maps) {
  const std::string name = "--" + option.name;
  const auto set = [&option, &request, name, maps](const std::vector<std::string>& texts) {
    if (const Status status = SetOption(option, name, texts, maps, request); !status.ok()) throw CLI::ValidationError(status.message());
    return true;
  };
  app.option_defaults()->group(option.group);
  if (option.flag()) {
    const std::string names = option.negatable ? fmt::format("{},!--no-{}", name, option.name) : name;
    return app.add_flag_function(
        names, [set](std::int64_t count) { set({count > 0 ? "true" : "false"}); }, option.help);
  }
  CLI::Option* const added = app.add_option(name, CLI::callback_t(set), option.help)->type_name(option.value)->default_str(option.standard);
  if (option.range) NoteRange(added, *option.range);
  if (!option.choices.empty()) NoteChoices(added, {option.choices.begin(), option.choices.end()});
  if (option.repeatable) added->expected(1)->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  return added;
}

void ExcludeViewOptions(CLI::App& app, CLI::Option* option) {
  option->excludes(app.get_option("--view"));
  for (const RequestOption& field : RequestOptions()) {
    if (field.path.starts_with("view.")) option->excludes(app.get_option("--" + field.name));
  }
}

void LetSurfacesStandAlone(const CLI::App& app, TransferChoice& transfer) {
  if (!transfer.isosurfaces.empty() && app.get_option("--transfer")->count() == 0) transfer.choice = std::string(kNoTransfer);
}

void AddRenderPictureOptions(CLI::App& app, FrameRequest& request, PictureFormat& format, LayerFiles* files) {
  const ColorMaps maps = files != nullptr ? ColorMaps::kFilesToo : ColorMaps::kTexts;
  request.view = kUnstatedView;
  AddRequestOptions(app, request, maps, [](const RequestOption& option) { return option.name != "dataset" && option.name != "previews"; });
  AddWholeViews(app, request.view, files != nullptr);
  if (files != nullptr) AddLayerFiles(app, *files, &request);
  AddPictureFormat(app, format);
  AddAnnotationOptions(app, format.annotations);
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
  const auto parse_point = [](const std::string& option, const std::string& text) { return ParsePoint(option, text); };
  CLI::Option* const at =
      AddParsed(app, "--at", slice.at, parse_point, "Point of the world that the planes go through (default: the volume's centre)")
          ->type_name("X,Y,Z");
  AddParsed(
      app, "--index", slice.index,
      [](const std::string& option, const std::string& text) { return ParseInteger(option, text, 0, kMaxVolumeSide - 1); },
      "Number of the slice, counted from 0, instead of a point")
      ->type_name("K")
      ->excludes(at);
  AddNumber(app, "--thickness", slice.thickness, {0, kMaxCoordinate},
            "Show the largest values of a slab of this thickness, in the unit of the world (mm of a patient); 0: the values in the plane");

  app.option_defaults()->group("Look");
  const auto value = [](const std::string& option, const std::string& text) { return ParseNumber(option, text, {-1e30, 1e30}); };
  CLI::Option* const window =
      AddParsed(app, "--window", slice.window, ParseValueWindow,
                "Width of the range of values from black to white, or width and level by name, for CT in Hounsfield units" +
                    Explained(kNamedWindows))
          ->type_name("VALUE|NAME");
  AddParsed(app, "--level", slice.level, value, "Middle of the range of values from black to white")
      ->type_name("VALUE")
      ->default_str("half of --window, or that of its name")
      ->needs(window);
  const auto& parameters = RequireRenderer(slice.frame.renderer).value()->parameters();
  const auto wanted = [&](const RequestOption& option) {
    if (option.path.starts_with("labels.")) return option.name != "label-opacity";
    return option.name == "size" || option.name == "transfer" || option.name == "scalar-range" || option.name == "opacity-distance" ||
           option.path.starts_with("overlay.") || std::ranges::find(parameters, option.name, &RendererParameter::name) != parameters.end();
  };
  AddRequestOptions(app, slice.frame, files != nullptr ? ColorMaps::kFilesToo : ColorMaps::kTexts, wanted);
  if (files != nullptr) AddLayerFiles(app, *files, &slice.frame);
  app.get_option("--transfer")->excludes(window)->default_str("window");
  app.get_option("--size")->group("Plane");
  AddPictureFormat(app, slice.format);
  AddAnnotationOptions(app, slice.format.annotations);
}

}  // namespace slabstream
