#include "client/request/picture_record.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "client/request/shell_word.h"
#include "common/base/version.h"
#include "common/volume/field_info.h"
#include "common/wire/request_json.h"
#include "data/volume_io/formats.h"
#include "data/volume_io/read_options.h"

namespace slabstream {
namespace {

constexpr std::string_view kProgram = "slabstream ";

Json FormatJson(const PictureFormat& format) {
  const StraightColor& b = format.background;
  Json json = {{"depth", format.png_bits}, {"background", {Decimal(b.r), Decimal(b.g), Decimal(b.b), Decimal(b.a)}}};
  if (!format.annotations.title.empty()) json["title"] = format.annotations.title;
  if (format.annotations.scale_bar) json["scale_bar"] = true;
  if (format.annotations.orientation_marker) json["orientation_marker"] = true;
  if (format.annotations.axes != VolumeAxes::kOff) json["axes"] = kVolumeAxesNames.at(std::size_t(format.annotations.axes));
  if (format.annotations.color_bar) json["color_bar"] = *format.annotations.color_bar;
  if (format.annotations.legend) json["legend"] = true;
  if (format.annotations.font_size) json["font_size"] = *format.annotations.font_size;
  if (format.quality != PictureFormat().quality) json["quality"] = format.quality;
  if (format.dots_per_inch) json["dpi"] = *format.dots_per_inch;
  return json;
}

void ReadFormat(const JsonValue& value, PictureFormat& format) {
  auto fields = FormatFields(format);
  fields.emplace_back("background", [&](const JsonValue& v) {
    std::vector<float> channels;
    v.Each([&](const JsonValue& channel) { channels.push_back(float(channel.Number({0, 1}))); }, 4);
    if (channels.size() != 4) return v.Complain(v.Shown() + " must be four numbers");
    format.background = {channels[0], channels[1], channels[2], channels[3]};
  });
  value.Fields(fields);
}

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
    if (value != usual) Add(option, fmt::format("{}", value));
  }
  void Flag(const std::string& option, bool value) {
    if (value) Add(option);
  }
  std::vector<std::string> Take() { return std::move(arguments_); }

 private:
  std::vector<std::string> arguments_;
};

// Those of all fields that are not standard. Without --transfer, isosurfaces stand alone.
void AddRequest(OptionList& out, const FrameRequest& request) {
  const bool has_surfaces = !request.transfer.isosurfaces.empty();
  for (const RequestOption& option : RequestOptions()) {
    if (option.name == "dataset") continue;  // the source says it
    std::vector<std::string> texts = TextsOf(option, request);
    if (has_surfaces && option.path == "transfer.preset") {
      if (texts.empty()) texts = {option.standard};
      if (texts.front() == kNoTransfer) continue;
    }
    for (const std::string& text : texts) {
      if (option.flag()) {
        out.Add((text == "true" ? "--" : "--no-") + option.name);
      } else {
        out.Add("--" + option.name, text);
      }
    }
  }
}

// The structured bindings name every field: if there is one more, they do not compile.
void AddFormat(OptionList& out, const PictureFormat& format) {
  const PictureFormat usual;
  const auto& [png_bits, quality, background, annotations, dots_per_inch] = format;
  const auto& [scale_bar, orientation_marker, sides_only, axes, title, color_bar, legend, font_size] =
      annotations;  // sides_only: of slices
  if (background != usual.background) {
    out.Add("--background", fmt::format("{},{},{},{}", background.r, background.g, background.b, background.a));
  }
  out.Number("--depth", png_bits, usual.png_bits);
  out.Name("--title", title, "");
  out.Flag("--scale-bar", scale_bar);
  out.Flag("--orientation-marker", orientation_marker);
  out.Name("--axes", kVolumeAxesNames.at(std::size_t(axes)), kVolumeAxesNames.front());
  if (color_bar) out.Add(color_bar->empty() ? "--color-bar" : "--color-bar=" + *color_bar);
  out.Flag("--legend", legend);
  if (font_size) out.Add("--font-size", fmt::format("{}", *font_size));
  out.Number("--quality", quality, usual.quality);
  if (dots_per_inch) out.Add("--dpi", fmt::format("{}", *dots_per_inch));
}

void ReadLayerFiles(const JsonValue& value, LayerFiles& files) {
  value.Fields({{"labels", [&](const JsonValue& v) { SetLabelFiles(v.Text(), files); }}, {"overlay", JsonValue::Into(files.overlay)}});
}

// Slabstream 0.1 has the looks of overlay and labels apart.
Json WithLayersAsFields(Json request) {
  for (const std::string_view layer : {kOverlayField, kLabelsField}) {
    const bool is_apart = request.is_object() && request.contains(layer) && request[layer].is_object();
    if (!is_apart || !(request["fields"].is_null() || request["fields"].is_array())) continue;
    Json look = layer == kLabelsField ? Json{{"labels", request[layer]}} : request[layer];
    look["field"] = layer;
    request["fields"].push_back(std::move(look));
    request.erase(layer);
  }
  return request;
}

// Names of catalogues have no slashes, and hardly ever the ending of a volume file.
bool IsFile(const std::string& source) {
  return source.find('/') != std::string::npos || LooksLikeVolumeFile(source.substr(0, source.find('?')));
}

bool IsPlain(std::string_view word) {
  constexpr std::string_view kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_=+,./:@%";
  return !word.empty() && word.find_first_not_of(kPlain) == std::string_view::npos;
}

}  // namespace

std::vector<std::pair<std::string, JsonValue::Read>> FormatFields(PictureFormat& format) {
  Annotations& annotations = format.annotations;
  const auto line = [](std::string& text) {
    return [&text](const JsonValue& v) {
      text = v.Text();
      if (const Status status = CheckTitle("the text", text); !status.ok()) v.Complain(status.message());
    };
  };
  const auto depth = [&format](const JsonValue& v) {
    format.png_bits = v.Integer(8, 16);
    if (format.png_bits != 8 && format.png_bits != 16) v.Complain(fmt::format("depth {} is neither 8 nor 16", format.png_bits));
  };
  return {{"depth", depth},
          {"quality", JsonValue::Into(format.quality, 1, 100)},
          {"dpi", JsonValue::Into(format.dots_per_inch, 1, kMaxDotsPerInch)},
          {"font_size", JsonValue::Into(annotations.font_size, {kMinFontSize, kMaxFontSize})},
          {"title", line(annotations.title)},
          {"color_bar", [&annotations, line](const JsonValue& v) { line(annotations.color_bar.emplace())(v); }},
          {"legend", JsonValue::Into(annotations.legend)},
          {"scale_bar", JsonValue::Into(annotations.scale_bar)},
          {"orientation_marker", JsonValue::Into(annotations.orientation_marker)},
          {"axes", [&annotations](const JsonValue& v) { annotations.axes = VolumeAxes(v.OneOf(kVolumeAxesNames)); }}};
}

Json GeometryJson(const PictureGeometry& geometry) {
  Json edges = Json::array();
  for (const Vec3& edge : geometry.box_edges) edges.push_back(VectorJson(edge));
  return {{"world", NameOf(geometry.world)},
          {"unit", NameOf(geometry.unit)},
          {"projection", NameOf(geometry.projection)},
          {"right", VectorJson(geometry.right)},
          {"up", VectorJson(geometry.up)},
          {"forward", VectorJson(geometry.forward)},
          {"target", VectorJson(geometry.target)},
          {"target_depth", geometry.target_depth},
          {"pixel_size", geometry.pixel_size},
          {"box_corner", VectorJson(geometry.box_corner)},
          {"box_edges", std::move(edges)}};
}

FrameRequest AsMade(FrameRequest request, const FrameStatistics& statistics) {
  if (!statistics.renderer.empty()) request.renderer = statistics.renderer;
  if (statistics.view) request.view = *statistics.view;
  return request;
}

std::string RecordText(const std::string& source, const FrameRequest& request, const PictureFormat& format, const PictureGeometry& geometry,
                       const LayerFiles& layers, const std::vector<LevelUse>& levels) {
  Json made = Json::Parse(RequestToJson(request)).value();
  // The source says the dataset. How a picture travels is not what it shows.
  for (const char* field : {"dataset", "straight8", "straight8_over", "key"}) made.erase(field);
  Json json = {{"program", fmt::format("{}{}", kProgram, Version())},
               {"source", ShownSource(source)},
               {"request", std::move(made)},
               {"picture", FormatJson(format)},
               {"geometry", GeometryJson(geometry)}};
  if (!layers.labels.empty()) json["layers"]["labels"] = LabelText(layers);
  if (!layers.overlay.empty()) json["layers"]["overlay"] = layers.overlay;
  if (std::ranges::any_of(levels, [](const LevelUse& use) { return use.level > 0; })) {
    for (const LevelUse& use : levels) json["levels"].push_back(use.level);
  }
  return json.dump(-1, true);
}

Result<PictureRecord> ParseRecord(std::string_view text) {
  Result<Json> json = ParseJson(text);
  if (!json.ok()) return json.status();
  PictureRecord record;
  std::string request;
  std::optional<std::string> mistake;
  const JsonValue value(*json, "record", mistake);
  value.Fields({{"program", JsonValue::Into(record.program)},
                {"source", JsonValue::Into(record.source)},
                {"layers", [&](const JsonValue& v) { ReadLayerFiles(v, record.layers); }},
                {"request", [&](const JsonValue&) { request = WithLayersAsFields((*json)["request"]).dump(); }},
                {"picture", [&](const JsonValue& v) { ReadFormat(v, record.format); }},
                {"geometry", [](const JsonValue& v) { (void)v.At("pixel_size"); }},
                {"levels", [](const JsonValue& v) { v.Each([](const JsonValue& level) { (void)level.Integer(0, kMaxLevels - 1); }); }}});
  for (const char* field : {"program", "source", "request", "picture", "geometry"}) (void)value.At(field);
  if (mistake) return Status::InvalidArgument(*mistake);
  Result<FrameRequest> parsed = RequestFromJson(request, "volume");
  if (!parsed.ok()) return parsed.status();
  record.request = *std::move(parsed);
  record.json = *std::move(json);
  return record;
}

std::vector<std::string> RenderArguments(const PictureRecord& record, const std::string& output) {
  OptionList out;
  out.Add("render");
  const bool like_an_option = record.source.starts_with('-');
  if (!like_an_option) out.Add(record.source);
  out.Flag("--local", IsFile(record.source));
  if (!record.layers.labels.empty()) out.Add("--labels", LabelText(record.layers));
  if (!record.layers.overlay.empty()) out.Add("--overlay", record.layers.overlay);
  AddRequest(out, record.request);
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
