#include "client/request/picture_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstddef>
#include <functional>
#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "client/request/camera_file.h"
#include "client/request/value_window.h"
#include "client/request/values.h"
#include "common/cli/add_option.h"
#include "common/files/files.h"
#include "common/renderers/registry.h"
#include "common/view/default_view.h"
#include "common/view/named_view.h"
#include "common/view/world_limits.h"
#include "common/volume/field_info.h"

namespace slabstream {
namespace {

using Wanted = std::function<bool(const RequestOption&)>;

// Options for those of the table that are wanted, and what they exclude and need. The command may have some in a form of its own.
void AddRequestOptions(const Command& app, FrameRequest& request, ColorMaps maps, const Wanted& wanted) {
  std::vector<std::pair<Option, const RequestOption*>> added;
  for (const RequestOption& option : RequestOptions()) {
    if (!wanted(option) || app.FindOption("--" + option.name)) continue;
    added.emplace_back(AddRequestOption(app, option, request, maps), &option);
  }
  for (const auto& [option, field] : added) {
    for (const std::string& other : field->excludes) option.Excludes(app.FindOption("--" + other));
    for (const std::string& other : field->needs) option.Needs(app.FindOption("--" + other));
  }
}

// Options that stand for several fields.
void AddWholeViews(const Command& app, ViewParameters& view, bool files) {
  app.GroupOptions(app.FindOption("--zoom").group());
  std::vector<std::string_view> names;
  for (const NamedView& named : kNamedViews) names.push_back(named.name);
  const auto store = [&view, is_name = OneOf(names)](const std::string& option, const std::vector<std::string>& texts) {
    const Result<std::string> name = is_name(option, texts.back());
    if (!name.ok()) return name.status();
    const NamedView& named = *std::ranges::find(kNamedViews, *name, &NamedView::name);
    view.azimuth_degrees = named.azimuth_degrees;
    view.elevation_degrees = named.elevation_degrees;
    view.of_patient = named.of_patient;
    return Status::Ok();
  };
  const Option named = app.AddOption("--view", store, "Look at a side, instead of --azimuth and --elevation" + Explained(kNamedViews))
                           .TypeName("NAME")
                           .Choices(names);
  for (const char* option : {"--azimuth", "--elevation", "--of-patient", "--eye"}) named.Excludes(app.FindOption(option));
  if (!files) return;
  const Option camera = AddParsed(app, "--camera", view, ParseCameraFile, "Take the view from a file that --save-camera wrote");
  camera.TypeName("FILE");
  ExcludeViewOptions(app, camera);
}

void AddPictureFormat(const Command& app, PictureFormat& format) {
  app.GroupOptions(app.FindOption("--transfer").group());
  AddParsed(
      app, "--background", format.background, [](const std::string& option, const std::string& text) { return ParseColor(option, text); },
      "Colour behind the picture: R,G,B or R,G,B,A from 0 to 1, #rgb, #rrggbb, #rrggbbaa, or a name such as white (default: transparent, "
      "which "
      "is black in a movie)")
      .TypeName("COLOUR");
  AddChoice<int, 2>(app, "--depth", format.png_bits, {"8", "16"}, {8, 16}, "Bits of each channel of a PNG or TIFF: 8 or 16").Default("8");
  AddInteger(app, "--quality", format.quality, 1, 100, "Quality of a JPEG or WebP");
  const auto dots = [](const std::string& option, const std::string& text) { return ParseInteger(option, text, 1, kMaxDotsPerInch); };
  const Option dpi =
      AddParsed(app, "--dpi", format.dots_per_inch, dots,
                "Pixels an inch, as the file states them: the size of a figure in print, and of the page of a PDF or SVG")
          .TypeName("N")
          .Default(fmt::format("{} for pages and --font-size; other files of patients state the size of pixels there", kUsualDotsPerInch));
  dpi.Range({1, kMaxDotsPerInch});
}

void AddAnnotationOptions(const Command& app, Annotations& annotations) {
  app.GroupOptions("Annotations (drawn onto the picture)");
  app.AddFlag("--scale-bar", annotations.scale_bar,
              "A scale bar: mm for patients, else the unit of the file or voxels; under perspective it holds at the depth of the target");
  app.AddFlag("--orientation-marker", annotations.orientation_marker,
              "The axes of the world; of patients also the sides (R, L, A, P, S, I) at the edges of the picture");
  AddParsed(
      app, "--title", annotations.title,
      [](const std::string& option, const std::string& text) { return TextIf(CheckTitle(option, text), text); },
      fmt::format("A line of at most {} characters at the top", kMaxTitleCharacters))
      .TypeName("TITLE");
  AddOptionalValue(
      app, "--color-bar", annotations.color_bar, "",
      [](const std::string& option, const std::string& text) -> Result<std::optional<std::string>> {
        if (Status status = CheckTitle(option, text); !status.ok()) return status;
        return std::optional(text);
      },
      "The colours of the transfer function, or of each field, with their data values; CAPTION stands above them, such as a unit")
      .TypeName("[=CAPTION]");
  app.AddFlag("--legend", annotations.legend,
              "Names and colours of fields with their ranges, if several are shown, of labels and of isosurfaces");
  const NumberRange sizes{kMinFontSize, kMaxFontSize};
  const auto points = [sizes](const std::string& option, const std::string& text) { return ParseNumber(option, text, sizes); };
  const Option font =
      AddParsed(app, "--font-size", annotations.font_size, points, "Size of the letters in points, of which 72 make an inch")
          .TypeName("NUMBER")
          .Default("1/31 of the picture's shorter side, at least 11 pixels");
  font.Range(sizes);
}

// The words of a file, with a comma between each two: thousands of labels are too many for a command line.
Result<std::string> ListIn(const std::string& path) {
  constexpr std::size_t kMostBytes = std::size_t{8} << 20;
  const Result<std::string> file = ReadTextFile(path, kMostBytes);
  if (!file.ok()) return file.status();
  std::string list;
  for (const char c : *file) {
    const bool between = c == ',' || std::isspace(static_cast<unsigned char>(c)) != 0;
    if (!between) {
      list += c;
    } else if (!list.empty() && list.back() != ',') {
      list += ',';
    }
  }
  if (list.ends_with(',')) list.pop_back();
  if (list.empty()) return Status::InvalidArgument(path + ": no label is in it");
  return list;
}

}  // namespace

Option AddRequestOption(const Command& app, const RequestOption& option, FrameRequest& request, ColorMaps maps) {
  const std::string name = "--" + option.name;
  const auto set = [&option, &request, maps](const std::string& shown, std::vector<std::string> texts) {
    if (option.name == "labels-shown" && texts.back().starts_with('@')) {
      Result<std::string> list = ListIn(texts.back().substr(1));
      if (!list.ok()) return Status(list.status().code(), shown + " " + list.status().message());
      texts.back() = *std::move(list);
    }
    return SetOption(option, shown, texts, maps, request);
  };
  app.GroupOptions(option.group);
  if (option.flag()) {
    const std::string names = option.negatable ? fmt::format("{},!--no-{}", name, option.name) : name;
    return app.AddSwitch(
        names, [set, name](bool on) { return set(name, {on ? "true" : "false"}); }, option.help);
  }
  const Option added = app.AddOption(option.name == "shape" ? name + ",--mesh,--lines,--points" : name, set, option.help)
                           .TypeName(option.value)
                           .Default(option.standard);
  if (option.range) added.Range(*option.range);
  if (!option.choices.empty()) added.Choices({option.choices.begin(), option.choices.end()});
  if (option.repeatable) added.Repeatable();
  return added;
}

void ExcludeViewOptions(const Command& app, Option option) {
  option.Excludes(app.FindOption("--view"));
  for (const RequestOption& field : RequestOptions()) {
    if (field.path.starts_with("view.")) option.Excludes(app.FindOption("--" + field.name));
  }
}

void LetSurfacesStandAlone(const Command& app, TransferChoice& transfer) {
  if (!transfer.isosurfaces.empty() && !app.FindOption("--transfer").given()) transfer.choice = std::string(kNoTransfer);
}

namespace {

// Short forms: --overlay-range 3:8 says --channel-range overlay=3:8.
void AddOverlayOptions(const Command& app, ColorMaps maps, FrameRequest& request) {
  app.GroupOptions(FindRequestOption("label-mode")->group);
  const std::initializer_list<std::array<const char*, 3>> forms = {{"--overlay-transfer", "channel-transfer", "TRANSFER"},
                                                                   {"--overlay-range", "channel-range", "LOW:HIGH"},
                                                                   {"--overlay-weight", "channel-opacity", "NUMBER"}};
  for (const auto& [name, of, value] : forms) {
    const auto set = [&request, maps, whole = FindRequestOption(of)](const std::string& option, const std::vector<std::string>& texts) {
      return SetOption(*whole, option, std::vector{fmt::format("{}={}", kOverlayField, texts.back())}, maps, request);
    };
    app.AddOption(name, set, fmt::format("Shows the overlay, as --{} {}={}", of, kOverlayField, value)).TypeName(value);
  }
}

}  // namespace

void AddLayerFiles(const Command& app, LayerFiles& files, FrameRequest* shown) {
  app.GroupOptions(FindRequestOption("label-mode")->group);
  const auto set_labels = [&files, shown](const std::string& option, const std::vector<std::string>& texts) {
    if (texts.back().empty()) return Status::InvalidArgument(option + " needs a file");
    SetLabelFiles(texts.back(), files);
    if (shown != nullptr) (void)ShownLabels(*shown);
    return Status::Ok();
  };
  app.AddOption("--labels", set_labels,
                "A volume of labels, the numbers of structures, on any grid, and a table of their colours: .lut, FreeSurfer, ITK-SNAP, "
                "ParaView (default: X.nii.lut beside X.nii.gz, else colours of our own); with --local")
      .TypeName("FILE[:COLOURS]");
  const auto set_overlay = [&files, shown](const std::string& option, const std::vector<std::string>& texts) {
    if (texts.back().empty()) return Status::InvalidArgument(option + " needs a file");
    files.overlay = texts.back();
    if (shown != nullptr) (void)ChoiceOf(kOverlayField, *shown);
    return Status::Ok();
  };
  app.AddOption("--overlay", set_overlay, "A second volume of values, on any grid, such as a statistical map; with --local")
      .TypeName("FILE");
}

void AddRenderPictureOptions(const Command& app, FrameRequest& request, PictureFormat& format, LayerFiles* files) {
  const ColorMaps maps = files != nullptr ? ColorMaps::kFilesToo : ColorMaps::kTexts;
  request.view = kUnstatedView;
  AddRequestOptions(app, request, maps, [](const RequestOption& option) { return option.name != "dataset" && option.name != "previews"; });
  AddOverlayOptions(app, maps, request);
  AddWholeViews(app, request.view, files != nullptr);
  if (files != nullptr) AddLayerFiles(app, *files, &request);
  AddPictureFormat(app, format);
  AddAnnotationOptions(app, format.annotations);
  AddChoice<VolumeAxes, 4>(
      app, "--axes", format.annotations.axes, kVolumeAxesNames, {VolumeAxes::kOff, VolumeAxes::kBox, VolumeAxes::kTicks, VolumeAxes::kGrid},
      "Round the volume: the edges of its box (box), ticks with the world's coordinates along three of them (axes), and "
      "lines at the ticks on the faces behind it (grid)")
      .Default("off");
}

void AddSlicePictureOptions(const Command& app, SliceRequest& slice, LayerFiles* files) {
  app.GroupOptions("Plane");
  std::vector<std::string_view> names;
  for (const SliceChoice& choice : kSliceChoices) names.push_back(choice.name);
  const auto parse = [is_name = OneOf(names)](const std::string& option, const std::string& text) -> Result<std::span<const SlicePlane>> {
    const Result<std::string> name = is_name(option, text);
    if (!name.ok()) return name.status();
    return std::ranges::find(kSliceChoices, *name, &SliceChoice::name)->planes;
  };
  AddParsed(app, "--plane", slice.planes, parse, "Which plane" + Explained(kSliceChoices))
      .Choices(names)
      .TypeName("NAME")
      .Default(std::string(kSliceChoices.back().name));
  const auto parse_point = [](const std::string& option, const std::string& text) { return ParsePoint(option, text); };
  const Option at =
      AddParsed(app, "--at", slice.at, parse_point, "Point of the world that the planes go through (default: the volume's centre)")
          .TypeName("X,Y,Z");
  AddParsed(
      app, "--index", slice.index,
      [](const std::string& option, const std::string& text) { return ParseInteger(option, text, 0, kMaxVolumeSide - 1); },
      "Number of the slice, counted from 0, instead of a point")
      .TypeName("K")
      .Excludes(at);
  AddNumber(app, "--thickness", slice.thickness, {0, kMaxCoordinate},
            "Show the largest values of a slab of this thickness, in the unit of the world (mm of a patient); 0: the values in the plane");

  app.GroupOptions("Look");
  const auto value = [](const std::string& option, const std::string& text) { return ParseNumber(option, text, {-1e30, 1e30}); };
  const Option window =
      AddParsed(app, "--window", slice.window, ParseValueWindow,
                "Width of the range of values from black to white, or width and level by name, for CT in Hounsfield units" +
                    Explained(kNamedWindows))
          .TypeName("VALUE|NAME");
  AddParsed(app, "--level", slice.level, value, "Middle of the range of values from black to white")
      .TypeName("VALUE")
      .Default("half of --window, or that of its name")
      .Needs(window);
  const auto& parameters = RequireRenderer(slice.frame.renderer).value()->parameters();
  const auto wanted = [&](const RequestOption& option) {
    if (option.name == "label-opacity") return false;
    if (option.path == "channels" || option.path.starts_with("fields.") || option.path == "blend" || option.path == "time" ||
        option.path == "missing") {
      return true;
    }
    return option.name == "size" || option.name == "transfer" || option.name == "scalar-range" || option.name == "opacity-distance" ||
           std::ranges::find(parameters, option.name, &RendererParameter::name) != parameters.end();
  };
  const ColorMaps maps = files != nullptr ? ColorMaps::kFilesToo : ColorMaps::kTexts;
  AddRequestOptions(app, slice.frame, maps, wanted);
  AddOverlayOptions(app, maps, slice.frame);
  if (files != nullptr) AddLayerFiles(app, *files, &slice.frame);
  app.FindOption("--transfer").Excludes(window).Default("window");
  app.FindOption("--size").Group("Plane");
  AddPictureFormat(app, slice.format);
  AddAnnotationOptions(app, slice.format.annotations);
}

}  // namespace slabstream
