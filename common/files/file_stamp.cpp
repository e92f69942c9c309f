#include "common/files/file_stamp.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <functional>
#include <system_error>
#include <utility>

namespace slabstream {
namespace {

namespace fs = std::filesystem;

Status CannotLookAt(const std::string& path, int error) {
  const bool missing = error == ENOENT || error == ENOTDIR;
  return Status(missing ? StatusCode::kNotFound : StatusCode::kUnavailable, path + ": " + std::strerror(error));
}

using std::chrono::system_clock;

// What is known of files: a line each.
struct Description {
  std::string text;
  system_clock::time_point newest = system_clock::time_point::min();

  void Add(const std::string& path, const struct stat& info) {
    text += fmt::format("{} {} {} {} {}.{} {}.{}\n", path, info.st_dev, info.st_ino, info.st_size, info.st_mtim.tv_sec,
                        info.st_mtim.tv_nsec, info.st_ctim.tv_sec, info.st_ctim.tv_nsec);
    const auto changed = std::chrono::seconds(info.st_ctim.tv_sec) + std::chrono::nanoseconds(info.st_ctim.tv_nsec);
    newest = std::max(newest, system_clock::time_point(std::chrono::duration_cast<system_clock::duration>(changed)));
  }
};

// Those below the folder. One that cannot be looked at, such as a link to nowhere, is no reason to give up the others.
Status AddFolder(const std::string& folder, Description& files) {
  std::vector<std::string> paths;
  std::error_code error;
  for (fs::recursive_directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    paths.push_back(entry->path().string());
  }
  if (error) return CannotLookAt(folder, error.value());
  std::ranges::sort(paths);
  for (const std::string& path : paths) {
    struct stat info {};
    // The times of a folder change with files that come and go while others are written; what it holds says more.
    const bool is_file = ::stat(path.c_str(), &info) == 0 && !S_ISDIR(info.st_mode);
    if (is_file) {
      files.Add(path, info);
    } else {
      files.text += path + '\n';
    }
  }
  return Status::Ok();
}

}  // namespace

Result<FileStamp> StampFiles(std::vector<std::string> paths) {
  Description files;
  for (const std::string& path : paths) {
    struct stat info {};
    if (::stat(path.c_str(), &info) != 0) return CannotLookAt(path, errno);
    if (!S_ISDIR(info.st_mode)) {
      files.Add(path, info);
    } else if (Status status = AddFolder(path, files); !status.ok()) {
      return status;
    }
  }
  return FileStamp{std::move(paths), std::hash<std::string>{}(files.text), files.newest};
}

Result<bool> HaveChanged(const FileStamp& stamp, Time now) {
  if (stamp.ask) return stamp.ask(now);
  const Result<FileStamp> found = StampFiles(stamp.paths);
  if (!found.ok()) return found.status();
  return found->digest != stamp.digest;
}

}  // namespace slabstream
