#include "client/request/picture_record.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "client/request/camera_json.h"
#include "client/request/layer_options.h"
#include "client/request/shell_word.h"
#include "client/request/values.h"
#include "common/base/version.h"
#include "common/view/named_view.h"
#include "common/wire/request_json.h"
#include "data/volume_io/volume_reader.h"

namespace slabstream {
namespace {

constexpr std::string_view kProgram = "slabstream ";

Json FormatJson(const PictureFormat& format) {
  const StraightColor& b = format.background;
  Json json = {{"depth", format.png_bits}, {"background", {Decimal(b.r), Decimal(b.g), Decimal(b.b), Decimal(b.a)}}};
  if (!format.annotations.title.empty()) json["title"] = format.annotations.title;
  if (format.annotations.scale_bar) json["scale_bar"] = true;
  if (format.annotations.orientation_marker) json["orientation_marker"] = true;
  return json;
}

void ReadFormat(const JsonValue& value, PictureFormat& format) {
  const auto color = [&](const JsonValue& v) {
    std::vector<float> channels;
    v.Each([&](const JsonValue& channel) { channels.push_back(float(channel.Number({0, 1}))); }, 4);
    if (channels.size() != 4) return v.Complain(v.Shown() + " must be four numbers");
    format.background = {channels[0], channels[1], channels[2], channels[3]};
  };
  const auto title = [&](const JsonValue& v) {
    format.annotations.title = v.Text();
    if (const Status status = CheckTitle("the title", format.annotations.title); !status.ok()) v.Complain(status.message());
  };
  value.Fields({{"depth", [&](const JsonValue& v) { format.png_bits = v.Integer(8, 16); }},
                {"background", color},
                {"title", title},
                {"scale_bar", [&](const JsonValue& v) { format.annotations.scale_bar = v.Boolean(); }},
                {"orientation_marker", [&](const JsonValue& v) { format.annotations.orientation_marker = v.Boolean(); }}});
  if (format.png_bits != 8 && format.png_bits != 16) value.Complain(fmt::format("depth {} is neither 8 nor 16", format.png_bits));
}

std::string NumberText(double number) { return fmt::format("{}", number); }
std::string PointText(const Vec3& point) { return fmt::format("{},{},{}", point.x, point.y, point.z); }

// Options of a command line, in their order.
class OptionList {
 public:
  void Add(const std::string& option) { arguments_.push_back(option); }
  void Add(const std::string& option, const std::string& value) {
    if (value.starts_with('-')) return Add(option + "=" + value);
    Add(option);
    Add(value);
  }
  // Only if the value is not the usual one.
  void Name(const std::string& option, std::string_view value, std::string_view usual) {
    if (value != usual) Add(option, std::string(value));
  }
  void Number(const std::string& option, double value, double usual) {
    if (value != usual) Add(option, NumberText(value));
  }
  void Point(const std::string& option, const std::optional<Vec3>& point) {
    if (point) Add(option, PointText(*point));
  }
  void Flag(const std::string& option, bool value) {
    if (value) Add(option);
  }
  std::vector<std::string> Take() { return std::move(arguments_); }

 private:
  std::vector<std::string> arguments_;
};

// The structured bindings below name every field: if there is one more, they do not compile.

void AddView(OptionList& out, const ViewParameters& view) {
  const ViewParameters usual;
  const auto& [projection, azimuth, elevation, roll, zoom, fov, look_at, eye, up, distance, fit, of_patient] = view;
  const bool by_name = of_patient && !eye;
  out.Name("--projection", NameOf(projection), NameOf(usual.projection));
  const auto named = std::ranges::find_if(kNamedViews, [&](const NamedView& v) {
    return v.of_patient && v.azimuth_degrees == view.azimuth_degrees && v.elevation_degrees == view.elevation_degrees;
  });
  if (by_name && named != kNamedViews.end()) {
    out.Add("--view", std::string(named->name));
  } else {
    out.Number("--azimuth", azimuth, usual.azimuth_degrees);
    out.Number("--elevation", elevation, usual.elevation_degrees);
  }
  out.Point("--look-at", look_at);
  out.Flag("--fit", fit);
  out.Point("--eye", eye);
  out.Point("--up", up);
  out.Number("--distance", distance, usual.distance);
  out.Number("--roll", roll, usual.roll_degrees);
  out.Number("--zoom", zoom, usual.zoom);
  out.Number("--fov", fov, usual.fov_degrees);
}

// No option sets the coefficients of a shading: they are the usual ones.
void AddShading(OptionList& out, const Shading& shading) {
  out.Name("--shading", NameOf(shading.model), NameOf(Shading().model));
  for (const Vec3& light : shading.lights) out.Add("--light", PointText(light));
}

void AddTransfer(OptionList& out, const TransferChoice& transfer) {
  const TransferChoice usual;
  const auto& [choice, opacity_distance, scalar_range, isosurfaces, gradient_opacities] = transfer;
  const auto* preset = std::get_if<std::string>(&choice);
  out.Name("--transfer", preset != nullptr ? *preset : kColorMapFile,
           isosurfaces.empty() ? std::get<std::string>(usual.choice) : std::string(kNoTransfer));
  if (scalar_range) out.Add("--scalar-range", ScalarRangeText(*scalar_range));
  out.Number("--opacity-distance", opacity_distance, usual.opacity_distance);
  std::string list;
  for (const auto& [value, color, opacity] : isosurfaces) {
    const auto& [r, g, b] = color;
    list += fmt::format("{}{}:{},{},{}:{}", list.empty() ? "" : ",", value, r, g, b, opacity);
  }
  if (!list.empty()) out.Add("--isovalue", list);
  list.clear();
  for (const auto& [slope, opacity] : gradient_opacities) list += fmt::format("{}{}:{}", list.empty() ? "" : ",", slope, opacity);
  if (!list.empty()) out.Add("--gradient-opacity", list);
}

// `render` has no option for a slab: that is for slices.
void AddClipping(OptionList& out, const Clipping& clipping) {
  const auto& [box, slab, planes, mode] = clipping;
  if (box) {
    std::string text;
    for (const Axis axis : kAxes) {
      const auto bound = [&](double value, double none) { return value == none ? "" : NumberText(value); };
      text += fmt::format("{}{}:{}", text.empty() ? "" : ",", bound(box->low[axis], -kMaxWorldCoordinate),
                          bound(box->high[axis], kMaxWorldCoordinate));
    }
    out.Add("--clip-box", text + (box->unit == ClipUnit::kVoxels ? "v" : box->unit == ClipUnit::kPercent ? "%" : ""));
  }
  for (const auto& [normal, offset] : planes) out.Add("--clip-plane", PointText(normal) + "," + NumberText(offset));
  if (mode == ClipMode::kCutAway) out.Add("--clip-mode", "cut-away");
}

void AddPolicy(OptionList& out, const Policy& policy) {
  const Policy usual;
  const auto& [decomposition, load_metric, axis, groups, assignment, balance, combine, pixel_error, teams] = policy;
  out.Name("--decomposition", decomposition, usual.decomposition);
  out.Name("--axis", NameOf(axis), NameOf(usual.axis));
  out.Name("--balance-by", load_metric, usual.load_metric);
  out.Name("--assignment", assignment, usual.assignment);
  out.Name("--balance", balance, usual.balance);
  out.Number("--groups", groups, usual.groups);
  out.Number("--frame-parallel", teams, usual.teams);
  out.Name("--combine", combine, usual.combine);
  out.Number("--pixel-error", pixel_error, usual.pixel_error);
}

void AddFormat(OptionList& out, const PictureFormat& format) {
  const PictureFormat usual;
  const auto& [png_bits, background, annotations] = format;
  const auto& [scale_bar, orientation_marker, title] = annotations;
  if (background != usual.background) {
    out.Add("--background", fmt::format("{},{},{},{}", background.r, background.g, background.b, background.a));
  }
  out.Number("--depth", png_bits, usual.png_bits);
  out.Name("--title", title, "");
  out.Flag("--scale-bar", scale_bar);
  out.Flag("--orientation-marker", orientation_marker);
}

void ReadLayerFiles(const JsonValue& value, LayerFiles& files) {
  value.Fields({{"labels", [&](const JsonValue& v) { SetLabelFiles(v.Text(), files); }},
                {"overlay", [&](const JsonValue& v) { files.overlay = v.Text(); }}});
}

// Names of catalogues have no slashes, and hardly ever the ending of a volume file.
bool IsFile(const std::string& source) {
  return source.find('/') != std::string::npos || LooksLikeVolume(source.substr(0, source.find('?')));
}

bool IsPlain(std::string_view word) {
  constexpr std::string_view kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_=+,./:@%";
  return !word.empty() && word.find_first_not_of(kPlain) == std::string_view::npos;
}

}  // namespace

Json GeometryJson(const PictureGeometry& geometry) {
  static constexpr std::array<const char*, 3> kUnits = {"voxel", "unknown", "mm"};
  return {{"world", NameOf(geometry.world)},
          {"unit", kUnits.at(std::size_t(geometry.unit) - 1)},
          {"projection", NameOf(geometry.projection)},
          {"right", VectorJson(geometry.right)},
          {"up", VectorJson(geometry.up)},
          {"forward", VectorJson(geometry.forward)},
          {"target", VectorJson(geometry.target)},
          {"target_depth", geometry.target_depth},
          {"pixel_size", geometry.pixel_size}};
}

std::string RecordText(const std::string& source, const FrameRequest& request, const PictureFormat& format, const PictureGeometry& geometry,
                       const LayerFiles& layers) {
  Json made = Json::parse(RequestToJson(request));
  made.erase("dataset");  // the source says it
  Json json = {{"program", fmt::format("{}{}", kProgram, Version())},
               {"source", source},
               {"request", std::move(made)},
               {"picture", FormatJson(format)},
               {"geometry", GeometryJson(geometry)}};
  if (!layers.labels.empty()) json["layers"]["labels"] = LabelText(layers);
  if (!layers.overlay.empty()) json["layers"]["overlay"] = layers.overlay;
  return json.dump(-1, ' ', true, Json::error_handler_t::replace);
}

Result<PictureRecord> ParseRecord(std::string_view text) {
  Result<Json> json = ParseJson(text);
  if (!json.ok()) return json.status();
  PictureRecord record;
  std::string request;
  std::optional<std::string> mistake;
  const JsonValue value(*json, "record", mistake);
  value.Fields({{"program", [&](const JsonValue& v) { record.program = v.Text(); }},
                {"source", [&](const JsonValue& v) { record.source = v.Text(); }},
                {"layers", [&](const JsonValue& v) { ReadLayerFiles(v, record.layers); }},
                {"request", [&](const JsonValue&) { request = (*json)["request"].dump(); }},
                {"picture", [&](const JsonValue& v) { ReadFormat(v, record.format); }},
                {"geometry", [](const JsonValue& v) { (void)v.At("pixel_size"); }}});
  for (const char* field : {"program", "source", "request", "picture", "geometry"}) (void)value.At(field);
  if (mistake) return Status::InvalidArgument(*mistake);
  Result<FrameRequest> parsed = RequestFromJson(request, "volume");
  if (!parsed.ok()) return parsed.status();
  record.request = *std::move(parsed);
  record.json = *std::move(json);
  return record;
}

std::vector<std::string> RenderArguments(const PictureRecord& record, const std::string& output) {
  const FrameRequest usual;
  const auto& [dataset, renderer, parameters, size, view, clipping, transfer, labels, overlay, shading, termination, policy, previews] =
      record.request;
  OptionList out;
  out.Add("render");
  const bool like_an_option = record.source.starts_with('-');
  if (!like_an_option) out.Add(record.source);
  out.Flag("--local", IsFile(record.source));
  out.Name("--size", fmt::format("{}x{}", size.width, size.height), fmt::format("{}x{}", usual.size.width, usual.size.height));
  AddView(out, view);
  AddClipping(out, clipping);
  out.Name("--renderer", renderer, usual.renderer);
  for (const auto& [name, text] : parameters) out.Add("--" + name, text);
  AddTransfer(out, transfer);
  for (const std::string& argument : LayerArguments(record.request, record.layers)) out.Add(argument);
  AddShading(out, shading);
  out.Number("--termination", termination, usual.termination);
  AddPolicy(out, policy);
  out.Flag("--previews", previews);
  AddFormat(out, record.format);
  std::vector<std::string> arguments = out.Take();
  arguments.insert(arguments.end(), {"-o", output});
  if (like_an_option) arguments.insert(arguments.end(), {"--", record.source});
  return arguments;
}

std::string CommandText(const PictureRecord& record, const std::string& output) {
  std::string text = "slabstream";
  for (const std::string& word : RenderArguments(record, output)) text += " " + (IsPlain(word) ? word : ShellWord(word));
  return text;
}

}  // namespace slabstream
