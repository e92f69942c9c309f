#include <fcntl.h>

#include <cerrno>
#include <utility>

#include "common/base/printable.h"
#include "common/files/file_descriptor.h"
#include "data/stores/range_reader.h"
#include "data/stores/read_threads.h"
#include "data/stores/store.h"

namespace slabstream {
namespace {

constexpr const char* kOnlyKey = "file";

class FileStoreImpl : public Store {
 public:
  explicit FileStoreImpl(std::string path) : path_(std::move(path)) {}

  void Read(const std::string& key, const ByteRange& range, std::uint64_t most, Done done, StillWanted /*wanted*/) override {
    if (key != kOnlyKey) {
      return done(Printable(Status::InvalidArgument(path_ + ": '" + key + "' names no object: a file has only '" + kOnlyKey + "'")));
    }
    const auto read = [path = path_, range, most]() -> Result<Bytes> {
      const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));  // which a pipe would wait for
      if (file.number() < 0) return OpenFailure(path, errno);
      return ReadRange(file.number(), path, range, most);
    };
    ReadOnThread(path_, read, std::move(done));
  }

  Result<std::vector<std::string>> List(const std::string& folder) override {
    if (!folder.empty()) return Status::NotFound(path_ + ": a file has no folders");
    return std::vector<std::string>{kOnlyKey};
  }

  const std::string& name() const override { return path_; }

 private:
  const std::string path_;
};

}  // namespace

std::shared_ptr<Store> FileStore(const std::string& path) { return std::make_shared<FileStoreImpl>(path); }

}  // namespace slabstream
