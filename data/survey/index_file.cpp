#include "data/survey/index_file.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <xxhash.h>

#include <algorithm>
#include <filesystem>
#include <span>
#include <system_error>
#include <utility>
#include <vector>

#include "common/files/cache_folder.h"
#include "common/files/file_lock.h"
#include "common/files/files.h"
#include "common/text/url.h"

namespace slabstream {
namespace {

namespace fs = std::filesystem;

// Of sizes and times of the files below a folder; 0: it is none.
Result<std::uint64_t> VersionOfFolder(const std::string& folder) {
  std::error_code error;
  if (folder.empty() || !fs::is_directory(folder, error)) return std::uint64_t{0};
  std::vector<std::string> files;
  for (fs::recursive_directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    struct stat info {};
    const std::string& path = entry->path().native();
    if (::lstat(path.c_str(), &info) != 0 || S_ISDIR(info.st_mode)) continue;  // it has gone, or its files say more
    files.push_back(fmt::format("{} {} {}.{}\n", path.substr(folder.size()), info.st_size, info.st_mtim.tv_sec, info.st_mtim.tv_nsec));
  }
  if (error) return Status::Unavailable(folder + ": " + error.message());
  std::ranges::sort(files);
  std::uint64_t version = 0;
  for (const std::string& file : files) version = XXH3_64bits_withSeed(file.data(), file.size(), version);
  return version;
}

// Of the samples of a level as they are packed, with all that is beside them.
std::uint64_t MostBytes(const SourceInfo& source, const std::string& name) {
  constexpr std::uint64_t kBeside = 256;
  std::uint64_t bytes = kBeside + name.size();
  for (const SourceLevel& level : source.levels) {
    const Index3 bricks = CubesOver(level.description.geometry.size, kBrick);
    bytes += kBeside + 2 * std::uint64_t(CountIn(bricks)) * BytesPerSample(level.description.type);
  }
  return bytes;
}

}  // namespace

Result<IndexFile> IndexFile::Of(const std::string& path, std::string_view options) {
  const Result<std::string> cache = CacheFolder();
  if (!cache.ok()) return cache.status();
  fs::path place = path;
  if (!IsUrl(path)) {
    std::error_code error;
    place = fs::weakly_canonical(path, error);
    if (error) place = fs::absolute(path, error);
  }
  std::string text = place.string() + std::string(options);
  std::string file = fmt::format("{}/index/{:016x}.index", *cache, XXH3_64bits(text.data(), text.size()));
  return IndexFile(std::move(file), std::move(text));
}

Result<std::string> IndexFile::NameNow(std::uint64_t files_version, const SourceInfo& source) const {
  const Result<std::uint64_t> folder_version = VersionOfFolder(source.folder);
  if (!folder_version.ok()) return folder_version.status();
  std::string name = fmt::format("{}\nfiles {:x} {:x}\n", place_, files_version, *folder_version);
  for (const SourceLevel& level : source.levels) {
    const Index3& size = level.description.geometry.size;
    name += fmt::format("level {} {} {} {}\n", size.x, size.y, size.z, NameOf(level.description.type));
  }
  return name;
}

std::optional<IndexFile::Facts> IndexFile::facts() const {
  struct stat info {};
  if (::stat(path_.c_str(), &info) != 0) return std::nullopt;
  const auto written = std::chrono::seconds(info.st_mtim.tv_sec) + std::chrono::nanoseconds(info.st_mtim.tv_nsec);
  return Facts{std::uint64_t(info.st_size),
               std::chrono::system_clock::time_point(std::chrono::duration_cast<std::chrono::system_clock::duration>(written))};
}

Result<std::optional<BrickIndex>> IndexFile::Read(const std::string& name, const SourceInfo& source) const {
  if (std::error_code error; !fs::exists(path_, error)) return std::optional<BrickIndex>();
  if (Status own = MakeOwnFolder(fs::path(path_).parent_path().string()); !own.ok()) return own;
  const Result<std::string> text = ReadTextFile(path_, MostBytes(source, name));
  if (text.status().code() == StatusCode::kNotFound) return std::optional<BrickIndex>();
  if (text.status().code() == StatusCode::kResourceExhausted)
    return Status::NotFound(path_ + ": it is too long for the index of these files");
  if (!text.ok()) return text.status();
  Result<BrickIndex> index = DecodeIndex(std::as_bytes(std::span(*text)), source, name);
  if (!index.ok()) return Status(index.status().code(), path_ + ": " + index.status().message());
  return std::optional(*std::move(index));
}

Status IndexFile::Write(const std::string& name, const BrickIndex& index, const SourceInfo& source) const {
  const Result<std::vector<std::byte>> bytes = EncodeIndex(index, source, name);
  if (!bytes.ok()) return bytes.status();
  if (Status made = MakeOwnFolder(fs::path(path_).parent_path().string()); !made.ok()) return made;
  constexpr unsigned kMode = 0600;
  Result<OutputFile> file = OutputFile::Create(path_, kMode);
  if (!file.ok()) return file.status();
  file->Append(*bytes);
  return file->Finish();
}

Status IndexFile::Merge(const std::string& name, BrickIndex index, const SourceInfo& source) const {
  const std::string folder = fs::path(path_).parent_path().string();
  if (Status made = MakeOwnFolder(folder); !made.ok()) return made;
  // A file beside it is locked: a lock of the file itself would be that of one that is replaced.
  const Result<FileDescriptor> lock = LockFile(folder + "/lock", LockMode::kAlone);
  if (!lock.ok()) return lock.status();
  if (const Result<std::optional<BrickIndex>> kept = Read(name, source); kept.ok() && *kept) {
    for (std::size_t level = 0; level < index.levels.size(); ++level) {
      std::ranges::transform(index.levels[level], (**kept).levels[level], index.levels[level].begin(),
                             [](const ValueRange& ours, const ValueRange& theirs) { return ours == kNotRead ? theirs : ours; });
    }
  }
  return Write(name, index, source);
}

}  // namespace slabstream
