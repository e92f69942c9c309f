#include "data/open/unchanged_source.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <xxhash.h>

#include <cerrno>
#include <chrono>
#include <system_error>
#include <utility>

#include "common/base/printable.h"
#include "common/files/file_stamp.h"
#include "common/threads/guarded.h"

namespace slabstream {
namespace {

struct Watched {
  std::string path;
  FileStamp stamp;

  // How a read has ended that ended so as far as the source knows. A file that is replaced may also look damaged.
  Status EndOf(Status read) const {
    if (read.code() == StatusCode::kCancelled) return read;
    const Result<bool> changed = Guarded(path.c_str(), [&] { return HaveChanged(stamp); });
    if (changed.ok() && !*changed) return read;
    if (changed.status().code() == StatusCode::kResourceExhausted) return changed.status();
    return Printable(Status::Unavailable(path + ": has changed since it was opened"));
  }
};

class UnchangedSource : public DescribedSource {
 public:
  UnchangedSource(std::shared_ptr<VolumeSource> source, SourceInfo info, std::shared_ptr<const Watched> watched)
      : DescribedSource(std::move(source), std::move(info)), watched_(std::move(watched)) {}

  using VolumeSource::Read;
  void Read(int level, const Box& box, const BoxRoom& out, std::stop_token stop, ReadDone done) override {
    source_->Read(level, box, out, std::move(stop),
                  [watched = watched_, done = std::move(done)](Status read) { done(watched->EndOf(std::move(read))); });
  }

 private:
  Result<LevelInMemory> DoReadLevel(int level, ReadProgress* progress, const LevelWanted& wanted) override {
    if (!info().whole) return VolumeSource::DoReadLevel(level, progress, wanted);
    Result<LevelInMemory> read = source_->ReadLevel(level, progress, wanted);
    if (Status end = watched_->EndOf(read.status()); !end.ok()) return end;
    return read;
  }

  std::shared_ptr<VolumeSource> Around(std::shared_ptr<VolumeSource> source, SourceInfo info) const override {
    return std::make_shared<UnchangedSource>(std::move(source), std::move(info), watched_);
  }

  const std::shared_ptr<const Watched> watched_;
};

}  // namespace

Result<std::shared_ptr<VolumeSource>> OpenUnchanged(const std::string& path, const OpenFunction& open) {
  constexpr int kAttempts = 3;
  constexpr std::chrono::seconds kRecent(2);  // clocks of file systems may be ahead of ours or behind
  std::vector<std::string> files;             // which only the opened source tells
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    const auto begin = std::chrono::system_clock::now();
    Result<FileStamp> stamp = StampFiles(files);
    Result<std::shared_ptr<VolumeSource>> source = open();
    if (!source.ok()) return source;
    if (const std::vector<std::string>& found = (*source)->info().files; found != files || !stamp.ok()) {
      files = found;
      stamp = StampFiles(files);
      if (!stamp.ok()) return stamp.status();
      if (!files.empty() && stamp->newest + kRecent > begin) continue;  // may have changed after it was opened: once more
    }
    const Result<std::uint64_t> version = VersionOf(files);
    if (!version.ok()) return version.status();
    SourceInfo info = (*source)->info();
    info.version = *version;
    return std::shared_ptr<VolumeSource>(std::make_shared<UnchangedSource>(
        *std::move(source), std::move(info), std::make_shared<const Watched>(Watched{path, *std::move(stamp)})));
  }
  return Printable(Status::Unavailable(path + ": changes while it is opened"));
}

Result<std::uint64_t> VersionOf(const std::vector<std::string>& files) {
  std::string text;
  for (const std::string& file : files) {
    struct stat found {};
    if (::stat(file.c_str(), &found) != 0) {
      const int error = errno;
      return Status(error == ENOENT ? StatusCode::kNotFound : StatusCode::kUnavailable,
                    file + ": " + std::generic_category().message(error));
    }
    text += fmt::format("{} {}.{} ", found.st_size, found.st_mtim.tv_sec, found.st_mtim.tv_nsec);
  }
  return XXH3_64bits(text.data(), text.size());
}

}  // namespace slabstream
