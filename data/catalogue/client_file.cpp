#include "data/catalogue/client_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>

#include "common/files/files.h"

namespace slabstream {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kFolderBegin = "slabstream-file-";

FileDescriptor OpenFolder(const std::string& folder) {
  return FileDescriptor(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
}

// Folders of this user whose process has ended. A new folder is locked a moment after it is made, so young ones are left alone.
void RemoveForsaken(const fs::path& parent) {
  constexpr auto kYoung = std::chrono::minutes(1);
  std::error_code error;
  for (fs::directory_iterator each(parent, error), end; !error && each != end; each.increment(error)) {
    const std::string folder = each->path().string();
    if (!each->path().filename().string().starts_with(kFolderBegin)) continue;
    const FileDescriptor lock = OpenFolder(folder);
    struct stat status {};
    if (lock.number() < 0 || ::fstat(lock.number(), &status) != 0 || status.st_uid != ::geteuid()) continue;
    const auto age = std::chrono::system_clock::now() - std::chrono::system_clock::from_time_t(status.st_mtime);
    std::error_code ignored;
    if (age > kYoung && ::flock(lock.number(), LOCK_EX | LOCK_NB) == 0) fs::remove_all(folder, ignored);
  }
}

}  // namespace

Result<std::shared_ptr<const ClientFile>> ClientFile::Write(const std::string& name, std::span<const std::byte> bytes) {
  const auto refused = [&](const char* why) {
    return Status::Unavailable(fmt::format("the coordinator cannot keep the file '{}': {}", name, why));
  };
  std::error_code error;
  const fs::path parent = fs::temp_directory_path(error);
  if (error) return refused("its folder for temporary files does not exist");
  RemoveForsaken(parent);
  std::string folder = (parent / (std::string(kFolderBegin) + "XXXXXX")).string();
  if (::mkdtemp(folder.data()) == nullptr) return refused(std::strerror(errno));
  FileDescriptor lock = OpenFolder(folder);
  const bool locked = lock.number() >= 0 && ::flock(lock.number(), LOCK_EX | LOCK_NB) == 0;
  const int lock_error = errno;
  const std::shared_ptr<const ClientFile> file(new ClientFile(name, folder, std::move(lock)));  // from here on it cleans up
  if (!locked) return refused(std::strerror(lock_error));
  Result<OutputFile> output = OutputFile::Create(file->path(), 0600);
  if (!output.ok()) return file->ForClient(output.status());
  output->Append(bytes);
  if (Status written = output->Finish(); !written.ok()) return file->ForClient(written);
  return file;
}

ClientFile::~ClientFile() {
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
}

Status ClientFile::CheckAlone(const std::vector<std::string>& files) const {
  const auto is_other = [&](const std::string& file) {
    const std::string whole = fs::path(file).lexically_normal().string();
    return whole != folder_ && !whole.starts_with(folder_ + '/');
  };
  const auto other = std::ranges::find_if(files, is_other);
  if (other == files.end()) return Status::Ok();
  return Status::InvalidArgument(fmt::format("{}: its data is in another file, '{}', and a file that is sent must hold all of it", name_,
                                             fs::path(*other).filename().string()));
}

Status ClientFile::ForClient(const Status& status) const {
  std::string text = status.message();
  for (const std::string& part : {folder_ + '/', folder_}) {
    for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at)) text.erase(at, part.size());
  }
  return Status(status.code(), std::move(text));
}

}  // namespace slabstream
