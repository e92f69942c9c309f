// `info` of pictures: what the file states, and how the picture was made.
#include <fmt/format.h>

#include <algorithm>
#include <iostream>
#include <optional>
#include <string>

#include "client/cli/commands.h"
#include "client/pictures/picture_header.h"
#include "client/request/picture_record.h"

namespace slabstream {
namespace {

constexpr std::string_view kAgain = "again";  // name of the file that the command line makes

// The text without control characters, which a terminal would obey: files may hold anything.
std::string Harmless(std::string text) {
  std::ranges::replace_if(
      text, [](unsigned char c) { return (c < 0x20 && c != '\n') || c == 0x7F; }, '?');
  return text;
}

// A line for each value: the fields on the way to it with points between them, and the value. Empty values are left out; points of curves
// are counted.
void AddLines(const std::string& name, const Json& value, std::string& text) {
  if (value.is_object()) {
    for (const auto& [field, inner] : value.items()) AddLines(name.empty() ? field : fmt::format("{}.{}", name, field), inner, text);
    return;
  }
  std::string shown = value.is_string() ? value.get<std::string>() : value.dump();
  if (value.is_array()) {
    shown.clear();
    if (name == "fields" || name == "shapes" || name == "planes") {
      for (std::size_t i = 0; i < value.size(); ++i) AddLines(fmt::format("{}[{}]", name, i), value[i], text);
      return;
    }
    const bool points = std::ranges::any_of(value, [](const Json& item) { return item.is_object(); });
    if (points) shown = fmt::format("{} points", value.size());
    for (std::size_t i = 0; !points && i < value.size(); ++i) {
      if (i > 0) shown += ' ';
      shown += value[i].is_string() ? value[i].get<std::string>() : value[i].dump();
    }
  }
  if (!shown.empty()) text += fmt::format("  {:<28} {}\n", name, shown);
}

std::string HeaderText(const PictureHeader& header) {
  std::string text = fmt::format("format       {}\n", header.format);
  text += fmt::format("size         {} x {} pixels\n", header.width, header.height);
  text += fmt::format("samples      {}: {}\n", header.sample_type, fmt::join(header.channels, ", "));
  if (header.pixel_mm) text += fmt::format("pixel size   {:.6g} mm\n", *header.pixel_mm);
  return text;
}

std::string RecordLines(const PictureRecord& record, const std::string& output) {
  std::string text = fmt::format("made by      {}\nsource       {}\nrequest\n", record.program, record.source);
  AddLines("", record.json["request"], text);
  if (record.layers.any()) {
    text += "layers\n";
    AddLines("", record.json["layers"], text);
  }
  text += "picture\n";
  AddLines("", record.json["picture"], text);
  text += "geometry\n";
  AddLines("", record.json["geometry"], text);
  if (record.json.contains("levels")) text += "drawn from\n";
  AddLines("levels", record.json.value("levels", Json::array()), text);
  text += "command\n  " + CommandText(record, output) + "\n";
  for (const auto& [name, unused] : MapFilesOf(record.request)) text += fmt::format("  {} is what --json prints in files\n", name);
  return text;
}

Json PictureJson(const PictureHeader& header, const std::optional<PictureRecord>& record, const std::string& output) {
  Json json = {{"format", header.format},
               {"size", {header.width, header.height}},
               {"sample_type", header.sample_type},
               {"channels", header.channels}};
  if (header.pixel_mm) json["pixel_mm"] = *header.pixel_mm;
  if (!record) return json;
  for (const auto& [field, value] : record->json.items()) json[field] = value;
  json["command"] = RenderArguments(*record, output);
  for (const auto& [name, map] : MapFilesOf(record->request)) json["files"][name] = Json::Parse(map).value();
  return json;
}

}  // namespace

Status RunPictureInfo(const InfoOptions& options) {
  if (options.request.transfer != TransferChoice{}) {
    return Status::InvalidArgument(fmt::format("SOURCE '{}' is a picture; transfer functions are for volumes", options.path));
  }
  if (options.layers.any()) return Status::InvalidArgument(fmt::format("SOURCE '{}' is a picture, which has no layers", options.path));
  const Result<PictureHeader> header = ReadPictureHeader(options.path);
  if (!header.ok()) return Status(header.status().code(), "SOURCE " + header.status().message());
  std::optional<PictureRecord> record;
  if (!header->record.empty()) {
    Result<PictureRecord> parsed = ParseRecord(header->record);
    if (!parsed.ok()) {
      return Status::InvalidArgument(
          fmt::format("SOURCE '{}' has a record that this version cannot read: {}", options.path, parsed.status().message()));
    }
    record = *std::move(parsed);
  }
  const std::string output = fmt::format("{}.{}", kAgain, header->format == "PNG" ? "png" : "exr");
  if (options.json) {
    std::cout << PictureJson(*header, record, output).dump(2) << "\n";
    return Status::Ok();
  }
  const std::string how = record ? RecordLines(*record, output) : "made by      not known: the file holds no record of Slabstream\n";
  std::cout << Harmless(HeaderText(*header) + how);
  return Status::Ok();
}

}  // namespace slabstream
