#include "common/files/cache_folder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <system_error>

#include "common/files/file_descriptor.h"

namespace slabstream {
namespace {

namespace fs = std::filesystem;

constexpr mode_t kOthers = S_IRWXG | S_IRWXO;

// Of one that is there.
Status TakeForOneself(const std::string& folder) {
  const auto wrong = [&](const std::string& why) {
    return Status::Unavailable(fmt::format("the folder '{}' {}; $XDG_CACHE_HOME chooses another place", folder, why));
  };
  const FileDescriptor opened(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  struct stat found {};
  if (opened.number() < 0 || ::fstat(opened.number(), &found) != 0) return wrong(fmt::format("cannot be used: {}", std::strerror(errno)));
  if (found.st_uid != ::geteuid()) return wrong("belongs to another user");
  if ((found.st_mode & kOthers) == 0) return Status::Ok();
  if ((found.st_mode & S_IWOTH) != 0) return wrong("can be written by all users: remove it");
  ::fchmod(opened.number(), found.st_mode & ALLPERMS & ~kOthers);
  if (::fstat(opened.number(), &found) != 0 || (found.st_mode & kOthers) != 0) return wrong("is open to other users and stays so");
  TakeRightsOfOthers(folder);
  return Status::Ok();
}

}  // namespace

Result<std::string> CacheFolder() {
  const auto absolute = [](const char* path) { return path != nullptr && path[0] == '/'; };
  if (const char* const cache = std::getenv("XDG_CACHE_HOME"); absolute(cache)) return std::string(cache) + "/slabstream";
  if (const char* const home = std::getenv("HOME"); absolute(home)) return std::string(home) + "/.cache/slabstream";
  return Status::NotFound("there is no folder for what is kept: set XDG_CACHE_HOME to an absolute path");
}

Status MakeOwnFolder(const std::string& folder) {
  const std::string parent = fs::path(folder).parent_path().string();
  std::error_code error;
  if (const Result<std::string> cache = CacheFolder(); (cache.ok() && parent == *cache) || !fs::exists(parent, error)) {
    if (Status made = MakeOwnFolder(parent); !made.ok()) return made;
  }
  if (::mkdir(folder.c_str(), S_IRWXU) == 0) return Status::Ok();
  if (errno == EEXIST) return TakeForOneself(folder);
  return Status::Unavailable(
      fmt::format("cannot make the folder '{}': {}; $XDG_CACHE_HOME chooses another place", folder, std::strerror(errno)));
}

void TakeRightsOfOthers(const std::string& folder) {
  std::error_code error;
  for (fs::recursive_directory_iterator each(folder, error), end; !error && each != end; each.increment(error)) {
    std::error_code ignored;
    if (each->is_symlink(ignored)) continue;
    fs::permissions(each->path(), fs::perms::group_all | fs::perms::others_all, fs::perm_options::remove | fs::perm_options::nofollow,
                    ignored);
  }
}

}  // namespace slabstream
