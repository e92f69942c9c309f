#include "data/open/file_times.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <system_error>
#include <utility>

#include "common/files/file_stamp.h"
#include "common/files/files.h"
#include "common/json/json.h"
#include "common/text/natural_order.h"
#include "common/text/parse_number.h"
#include "common/text/wildcard.h"
#include "data/volume_io/stated_field.h"
#include "data/volume_io/text_header.h"
#include "data/volume_io/xml_events.h"

namespace slabstream {
namespace {

namespace fs = std::filesystem;

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
bool IsSeriesFile(const std::string& path) { return IsCollection(path) || ToLower(path).ends_with(".series"); }

// By ascending times.
Result<std::vector<TimeFile>> ReadSeriesFile(const std::string& path) {
  Result<std::vector<TimeFile>> files = IsCollection(path) ? ReadCollection(path) : ReadSeries(path);
  if (!files.ok()) return files;
  if (files->empty() || files->size() > kMaxFileTimes) {
    return Status::InvalidArgument(fmt::format("{}: names {} files, must name 1 to {}", path, files->size(), kMaxFileTimes));
  }
  for (TimeFile& each : *files) {
    if (each.file.empty()) return Status::InvalidArgument(path + ": has an entry that names no file");
    if (!std::isfinite(each.time)) return Status::InvalidArgument(fmt::format("{}: the time of {} is no number", path, each.file));
    each.file = (fs::path(path).parent_path() / each.file).string();
  }
  std::ranges::stable_sort(*files, {}, &TimeFile::time);
  const auto same = std::ranges::adjacent_find(*files, {}, &TimeFile::time);
  if (same == files->end()) return files;
  return Status::InvalidArgument(
      fmt::format("{}: names several files of the time {}, must name one, such as a .pvti or .pvtu of its pieces", path, same->time));
}

std::string FolderOf(const std::string& pattern) {
  const fs::path folder = fs::path(pattern).parent_path();
  return folder.empty() ? "." : folder.string();
}

Result<std::vector<std::string>> MatchingFiles(const std::string& pattern) {
  const std::string folder = FolderOf(pattern), names = fs::path(pattern).filename().string();
  std::vector<std::string> files;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    if (name.starts_with('.') || !MatchesPattern(name, names)) continue;
    if (files.size() == kMaxFileTimes) return Status::ResourceExhausted(fmt::format("{}: more than {} files", pattern, kMaxFileTimes));
    files.push_back((fs::path(folder) / name).string());
  }
  if (error) return Status::NotFound(fmt::format("{}: {}", folder, error.message()));
  if (files.empty()) return Status::NotFound(pattern + ": no file has such a name");
  std::ranges::sort(files, {}, [](const std::string& file) { return InNaturalOrder(file); });
  return files;
}

class FileAtTime : public DescribedSource {
 public:
  using DescribedSource::DescribedSource;

 private:
  Result<LevelInMemory> DoReadLevel(int level, ReadProgress* progress, const LevelWanted& wanted) override {
    return source_->ReadLevel(level, progress, wanted);
  }
};

}  // namespace

Result<std::vector<TimeFile>> FilesOfTimes(const std::string& path) {
  if (IsSeriesFile(path)) {
    Result<std::vector<TimeFile>> files = ReadSeriesFile(path);
    // It may name itself.
    const auto series = files.ok() ? std::ranges::find_if(*files, NamesFileTimes, &TimeFile::file) : std::vector<TimeFile>::iterator();
    if (!files.ok() || series == files->end()) return files;
    return Status::InvalidArgument(fmt::format("{}: names {}, which has several times itself", path, series->file));
  }
  const Result<std::vector<std::string>> names = MatchingFiles(path);
  if (!names.ok()) return names.status();
  std::vector<TimeFile> files;
  for (const std::string& name : *names) files.push_back({name, double(files.size())});
  return files;
}

TimeAxis TimesOf(const std::vector<TimeFile>& files) {
  std::vector<double> times;
  for (const TimeFile& file : files) times.push_back(file.time);
  return StatedTimes(std::int64_t(files.size()), times, "");
}

bool NamesFileTimes(const std::string& path) {
  std::error_code error;
  return IsSeriesFile(path) || (fs::path(path).filename().string().find('*') != std::string::npos && !fs::exists(path, error));
}

Result<std::string> FirstFileOf(const std::string& path) {
  const Result<std::vector<TimeFile>> files = FilesOfTimes(path);
  return files.ok() ? Result(files->front().file) : files.status();
}

std::string ListOfFileTimes(const std::string& path) { return IsSeriesFile(path) ? path : FolderOf(path); }

Status NoSuchFileTime(const std::string& path, int time, std::size_t count) {
  return Status::InvalidArgument(fmt::format("{}: time is {}, must be in [0, {}]: a file each", path, time, count - 1));
}

Result<std::shared_ptr<VolumeSource>> OpenFileTimes(const std::string& path, const ReadOptions& options, const OpenFileFunction& open) {
  // It looks at each file of a folder, so only where it is needed.
  std::shared_ptr<const FileStamp> growth;
  if (!options.time) {
    Result<FileStamp> stamp = StampFiles({ListOfFileTimes(path)});
    if (!stamp.ok()) return stamp.status();
    growth = std::make_shared<const FileStamp>(*std::move(stamp));
  }
  Result<std::vector<TimeFile>> files = FilesOfTimes(path);
  if (!files.ok()) return files.status();
  ReadOptions of_file = options;
  of_file.time.reset();
  if (!options.time && files->size() > 1) {
    ReadOptions of_newest = of_file;
    of_newest.headers_only = true;
    if (!open(files->back().file, of_newest).ok()) files->pop_back();
  }
  const int count = int(files->size()), time = options.time ? options.time->first : 0;
  if (time >= count) return NoSuchFileTime(path, time, files->size());
  if (!options.time && !options.describe && count > 1) {
    return Status::InvalidArgument(
        fmt::format("{}: holds {} volumes, a file each, of which --time takes one: 0 to {}", path, count, count - 1));
  }
  Result<std::shared_ptr<VolumeSource>> source = open((*files)[std::size_t(time)].file, of_file);
  if (!source.ok()) return source;
  SourceInfo info = (*source)->info();
  if (info.times.count > 1) {
    return Status::InvalidArgument(fmt::format("{}: holds {} times itself, but is one of {} files with a time each",
                                               (*files)[std::size_t(time)].file, info.times.count, count));
  }
  info.times = TimesOf(*files);
  info.time = time;
  info.growth = std::move(growth);
  return std::shared_ptr<VolumeSource>(std::make_shared<FileAtTime>(*std::move(source), std::move(info)));
}

}  // namespace slabstream
