#include "data/open/series_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

#include "common/files/files.h"
#include "common/json/json.h"
#include "common/text/parse_number.h"
#include "data/volume_io/text_header.h"
#include "data/volume_io/xml_events.h"

namespace slabstream {
namespace {

constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();

Result<std::vector<TimeFile>> ReadCollection(const std::string& path) {
  bool is_collection = false;
  std::vector<TimeFile> files;
  const auto on_start = [&](const XmlTag& tag) {
    is_collection |= tag.name == "VTKFile" && tag.Attribute("type") == "Collection";
    if (tag.name == "DataSet") {
      // Writers of a single time leave it out.
      const std::string time = tag.Attribute("timestep");
      files.push_back({tag.Attribute("file"), time.empty() ? 0 : ParseNumber<double>(time).value_or(kNoNumber)});
    }
    return true;
  };
  if (Status status = ReadXmlFile(path, "", {on_start, [](const XmlTag&) {}}); !status.ok()) return status;
  return is_collection ? Result(std::move(files)) : Status::InvalidArgument(path + ": not a VTK file of type Collection");
}

Result<std::vector<TimeFile>> ReadSeries(const std::string& path) {
  constexpr std::size_t kMostBytes = std::size_t{64} << 20;
  const Result<std::string> text = ReadTextFile(path, kMostBytes);
  if (!text.ok()) return text.status();
  const Result<Json> json = Json::Parse(*text);
  if (!json.ok()) return Status::InvalidArgument(path + ": " + json.status().message());
  const Json* const list = json->find("files");
  if (list == nullptr || !list->is_array()) return Status::InvalidArgument(path + ": names no files: it has no list \"files\"");
  std::vector<TimeFile> files;
  for (const Json& entry : *list) {
    const Json *const name = entry.find("name"), *const time = entry.find("time");
    files.push_back(
        {name != nullptr && name->is_string() ? name->text() : "", time != nullptr && time->is_number() ? time->get<double>() : kNoNumber});
  }
  return files;
}

bool IsCollection(const std::string& path) { return ToLower(path).ends_with(".pvd"); }

}  // namespace

bool IsSeriesFile(const std::string& path) { return IsCollection(path) || ToLower(path).ends_with(".series"); }

Result<std::vector<TimeFile>> ReadSeriesFile(const std::string& path, std::size_t most) {
  Result<std::vector<TimeFile>> files = IsCollection(path) ? ReadCollection(path) : ReadSeries(path);
  if (!files.ok()) return files;
  if (files->empty() || files->size() > most) {
    return Status::InvalidArgument(fmt::format("{}: names {} files, must name 1 to {}", path, files->size(), most));
  }
  for (TimeFile& each : *files) {
    if (each.file.empty()) return Status::InvalidArgument(path + ": has an entry that names no file");
    if (!std::isfinite(each.time)) return Status::InvalidArgument(fmt::format("{}: the time of {} is no number", path, each.file));
    each.file = (std::filesystem::path(path).parent_path() / each.file).string();
  }
  std::ranges::stable_sort(*files, {}, &TimeFile::time);
  const auto same = std::ranges::adjacent_find(*files, {}, &TimeFile::time);
  if (same == files->end()) return files;
  return Status::InvalidArgument(
      fmt::format("{}: names several files of the time {}, must name one, such as a .pvti or .pvtu of its pieces", path, same->time));
}

}  // namespace slabstream
