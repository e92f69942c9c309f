#include "data/open/file_times.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <utility>

#include "common/files/file_stamp.h"
#include "common/text/natural_order.h"
#include "common/text/wildcard.h"
#include "data/volume_io/stated_field.h"

namespace slabstream {
namespace {

namespace fs = std::filesystem;

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
    Result<std::vector<TimeFile>> files = ReadSeriesFile(path, kMaxFileTimes);
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
