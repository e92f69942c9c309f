// What lies in a folder may be anybody's, so no link leads out of it unless the user says so: the kernel checks each step of a path
// (openat2, RESOLVE_BENEATH).
// Kernels before 5.6, and sandboxes that do not let it through, get each step checked here, where no link is followed at all.
#include <dirent.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <linux/openat2.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <utility>

#include "common/files/file_descriptor.h"
#include "data/stores/object_key.h"
#include "data/stores/range_reader.h"
#include "data/stores/read_threads.h"
#include "data/stores/store.h"

namespace slabstream {
namespace {

constexpr int kOpen = O_RDONLY | O_CLOEXEC | O_NONBLOCK;  // a pipe would wait for its writer

int OpenStepByStep(const FileDescriptor& root, const std::string& key, int flags) {
  int folder = ::fcntl(root.number(), F_DUPFD_CLOEXEC, 0);
  for (std::size_t begin = 0; folder >= 0;) {
    const FileDescriptor above(folder);
    const std::size_t end = std::min(key.find('/', begin), key.size());
    const bool last = end == key.size();
    const std::string part = key.substr(begin, end - begin);
    folder = ::openat(above.number(), part.c_str(), (last ? flags : O_PATH | O_CLOEXEC | O_DIRECTORY) | O_NOFOLLOW);
    if (last) return folder;
    if (folder < 0 && errno == ENOTDIR) {  // what O_DIRECTORY says of a link
      struct stat about {};
      if (::fstatat(above.number(), part.c_str(), &about, AT_SYMLINK_NOFOLLOW) == 0 && S_ISLNK(about.st_mode)) errno = ELOOP;
    }
    begin = end + 1;
  }
  return -1;
}

// A descriptor, or -1 with errno. "": the folder itself.
int OpenBeneath(const std::string& path, const std::string& key, int flags, Links links) {
  if (key.empty()) return ::open(path.c_str(), flags);
  if (links == Links::kMayLeadOut) return ::open((path + "/" + key).c_str(), flags);
  const FileDescriptor root(::open(path.c_str(), O_PATH | O_CLOEXEC | O_DIRECTORY));
  if (root.number() < 0) return -1;
  open_how how{};
  how.flags = std::uint64_t(flags);
  how.resolve = RESOLVE_BENEATH | RESOLVE_NO_MAGICLINKS;
  constexpr int kAttempts = 16;  // a folder that is being renamed
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    const long opened = ::syscall(SYS_openat2, root.number(), key.c_str(), &how, sizeof how);
    if (opened >= 0 || errno != EAGAIN) {
      if (opened < 0 && (errno == ENOSYS || errno == EPERM)) return OpenStepByStep(root, key, flags);
      return int(opened);
    }
  }
  return -1;
}

class FolderStoreImpl : public Store {
 public:
  FolderStoreImpl(std::string path, Links links) : path_(std::move(path)), links_(links) {}

  void Read(const std::string& key, const ByteRange& range, std::uint64_t most, Done done, StillWanted /*wanted*/) override {
    if (Status status = CheckObjectKey(path_, key); !status.ok()) return done(std::move(status));
    std::string object = path_ + "/" + key;
    auto read = [path = path_, links = links_, key, object, range, most]() -> Result<Bytes> {
      const FileDescriptor file(OpenBeneath(path, key, kOpen, links));
      if (file.number() < 0) {
        const int error = errno;
        if (error == ENOENT && IsLink(object)) return Status::Unavailable(object + ": is a link to a file that is not there");
        return OpenFailure(object, error);
      }
      struct stat about {};
      if (::fstat(file.number(), &about) == 0 && S_ISDIR(about.st_mode)) return Status::NotFound(object + ": is a folder");
      return ReadRange(file.number(), object, range, most);
    };
    ReadOnThread(object, std::move(read), std::move(done));
  }

  Result<std::vector<std::string>> List(const std::string& folder) override {
    if (Status status = CheckFolderKey(path_, folder); !status.ok()) return status;
    const std::string name = folder.empty() ? path_ : path_ + "/" + folder;
    const int opened = OpenBeneath(path_, folder, kOpen | O_DIRECTORY, links_);
    if (opened < 0) return OpenFailure(name, errno);
    const std::unique_ptr<DIR, int (*)(DIR*)> entries(::fdopendir(opened), ::closedir);
    if (entries == nullptr) {
      ::close(opened);
      return Status::ResourceExhausted(name + ": not enough memory to list it");
    }
    std::vector<std::string> names;
    while (const dirent* const entry = ::readdir(entries.get())) {
      const std::string_view entry_name = entry->d_name;
      if (entry_name == "." || entry_name == "..") continue;
      constexpr std::size_t kMostNames = std::size_t{1} << 20;
      if (names.size() == kMostNames) return Status::ResourceExhausted(fmt::format("{}: holds more than {} files", name, kMostNames));
      names.emplace_back(entry_name);
      if (IsFolder(opened, *entry)) names.back() += '/';
    }
    std::ranges::sort(names);
    return names;
  }

  const std::string& name() const override { return path_; }

 private:
  // A link that leads to a folder is one; whether it may be followed is seen when somebody does.
  static bool IsFolder(int folder, const dirent& entry) {
    if (entry.d_type != DT_LNK && entry.d_type != DT_UNKNOWN) return entry.d_type == DT_DIR;
    struct stat about {};
    return ::fstatat(folder, entry.d_name, &about, 0) == 0 && S_ISDIR(about.st_mode);
  }

  // As git-annex has it for what was not fetched: that is no missing object.
  static bool IsLink(const std::string& object) {
    struct stat about {};
    return ::lstat(object.c_str(), &about) == 0 && S_ISLNK(about.st_mode);
  }

  const std::string path_;
  const Links links_;
};

}  // namespace

std::shared_ptr<Store> FolderStore(const std::string& path, Links links) { return std::make_shared<FolderStoreImpl>(path, links); }

}  // namespace slabstream
