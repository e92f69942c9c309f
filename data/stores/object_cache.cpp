#include "data/stores/object_cache.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>
#include <xxhash.h>

#include <algorithm>
#include <atomic>
#include <cstring>
#include <filesystem>
#include <span>
#include <utility>
#include <vector>

#include "common/base/log.h"
#include "common/files/cache_folder.h"
#include "common/files/file_descriptor.h"
#include "common/files/files.h"
#include "data/stores/range_reader.h"

namespace slabstream {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kParts = 16;  // of the budget: one is the largest entry, and what is written between two looks at the folder
constexpr std::uint64_t kFormat = 0x316A626F62616C73;  // "slabobj1"
// A file takes whole blocks of the disk, and so many at least. It is filled up with zeros, so that its length is what it takes, and a
// budget holds for the disk, and for the number of files, however small objects are.
constexpr std::uint64_t kBlock = 4096;

// In front of bytes, name and version, in the machine's byte order: the folder is this machine's own. The bytes come first, so that those
// of a file that was read begin where numbers may.
struct Head {
  std::uint64_t format = kFormat;
  std::uint64_t checksum = 0;                      // of all that follows in the file
  std::uint64_t size = 0;                          // as in Entry
  std::uint64_t name = 0, version = 0, bytes = 0;  // lengths
};
constexpr std::size_t kUnchecked = 2 * sizeof(std::uint64_t);

std::uint64_t InBlocks(std::uint64_t bytes) { return (bytes + kBlock - 1) / kBlock * kBlock; }

std::span<const std::byte> BytesOf(const std::string& text) { return std::as_bytes(std::span(text)); }

std::uint64_t ChecksumOf(const Head& head, std::initializer_list<std::span<const std::byte>> parts) {
  const std::unique_ptr<XXH3_state_t, XXH_errorcode (*)(XXH3_state_t*)> state(XXH3_createState(), XXH3_freeState);
  XXH3_64bits_reset(state.get());
  XXH3_64bits_update(state.get(), reinterpret_cast<const std::byte*>(&head) + kUnchecked, sizeof head - kUnchecked);
  for (const std::span<const std::byte> part : parts) XXH3_64bits_update(state.get(), part.data(), part.size());
  return XXH3_64bits_digest(state.get());
}

// What a file holds of the entry; none: it is damaged, or of another name that has the same hash.
std::optional<ObjectCache::Entry> ReadEntry(int file, const std::string& name, std::uint64_t most) {
  const Result<Bytes> all = ReadRange(file, name, {}, most);
  Head head;
  if (!all.ok() || all->size() < sizeof head) return std::nullopt;
  std::memcpy(&head, all->span().data(), sizeof head);
  const std::uint64_t length = all->size();
  if (head.format != kFormat || head.name != name.size() || head.version > length || head.bytes > length) return std::nullopt;
  const std::uint64_t end = sizeof head + head.name + head.version + head.bytes;
  if (InBlocks(end) != length) return std::nullopt;
  const Bytes bytes = all->Part(sizeof head, head.bytes), of = all->Part(sizeof head + head.bytes, head.name),
              version = all->Part(end - head.version, head.version), rest = all->Part(end, length - end);
  if (std::ranges::any_of(rest.span(), [](std::byte each) { return each != std::byte{0}; }) ||
      !std::ranges::equal(of.span(), BytesOf(name)) || ChecksumOf(head, {bytes.span(), of.span(), version.span()}) != head.checksum) {
    return std::nullopt;
  }
  return ObjectCache::Entry{{reinterpret_cast<const char*>(version.span().data()), version.size()}, head.size, bytes};
}

}  // namespace

struct ObjectCache::State {
  const std::string folder;
  const std::uint64_t budget;
  std::atomic<std::uint64_t> unlooked;  // bytes written since the last look at the folder
  std::atomic<bool> complained = false;
  std::mutex looking;

  State(std::string f, std::uint64_t b) : folder(std::move(f)), budget(b), unlooked(b) {}

  std::string PathOf(const std::string& name) const {
    const XXH128_hash_t hash = XXH3_128bits(name.data(), name.size());
    return fmt::format("{}/{:02x}/{:014x}{:016x}", folder, hash.high64 >> 56, hash.high64 & 0xFFFFFFFFFFFFFF, hash.low64);
  }

  // Removes what was used longest ago, if the folder takes more than it may.
  void MakeRoom() {
    const std::unique_lock lock(looking, std::try_to_lock);
    if (!lock) return;  // another thread looks
    unlooked = 0;
    struct File {
      std::pair<std::int64_t, std::int64_t> used;  // seconds, nanoseconds
      std::uint64_t bytes = 0;
      fs::path path;
    };
    std::vector<File> files;
    std::uint64_t all = 0;
    std::error_code error;
    for (fs::recursive_directory_iterator each(folder, error), end; !error && each != end; each.increment(error)) {
      struct stat found {};
      if (::lstat(each->path().c_str(), &found) != 0 || !S_ISREG(found.st_mode)) continue;  // other processes remove files, too
      constexpr std::uint64_t kUnit = 512;  // of st_blocks; a disk may have larger blocks than kBlock, or may count them later
      const std::uint64_t bytes = std::max(InBlocks(std::uint64_t(found.st_size)), kUnit * std::uint64_t(found.st_blocks));
      files.push_back({{found.st_mtim.tv_sec, found.st_mtim.tv_nsec}, bytes, each->path()});
      all += bytes;
    }
    const std::uint64_t most = budget / 8 * 7;
    std::ranges::sort(files, {}, &File::used);
    for (const File& file : files) {
      if (all <= most) break;
      std::error_code gone;
      fs::remove(file.path, gone);
      all -= file.bytes;
    }
  }
};

Result<ObjectCache> ObjectCache::Open(std::string folder, std::uint64_t budget) {
  if (const Status made = MakeOwnFolder(folder); !made.ok()) return Status::Unavailable("--cache: " + made.message());
  if (const Status status = CheckCanWrite("--cache", folder + "/entry"); !status.ok()) return Status::Unavailable(status.message());
  auto state = std::make_shared<State>(std::move(folder), budget);
  state->MakeRoom();
  return ObjectCache(std::move(state));
}

ObjectCache::ObjectCache(std::shared_ptr<State> state) : state_(std::move(state)) {}

std::optional<ObjectCache::Entry> ObjectCache::Find(const std::string& name) const {
  const std::string path = state_->PathOf(name);
  const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (file.number() < 0) return std::nullopt;
  std::optional<Entry> entry = ReadEntry(file.number(), name, state_->budget);
  if (entry) {
    ::futimens(file.number(), nullptr);  // it was used now
  } else {
    ::unlink(path.c_str());
  }
  return entry;
}

void ObjectCache::Keep(const std::string& name, const Entry& entry) const {
  const std::uint64_t length = sizeof(Head) + name.size() + entry.version.size() + entry.bytes.size(), bytes = InBlocks(length);
  if (bytes > state_->budget / kParts) return;
  if (state_->unlooked.fetch_add(bytes) + bytes > state_->budget / kParts) {
    state_->MakeRoom();
    state_->unlooked.fetch_add(bytes);
  }
  Head head{.size = entry.size, .name = name.size(), .version = entry.version.size(), .bytes = entry.bytes.size()};
  head.checksum = ChecksumOf(head, {entry.bytes.span(), BytesOf(name), BytesOf(entry.version)});
  const std::string path = state_->PathOf(name);
  ::mkdir(fs::path(path).parent_path().c_str(), S_IRWXU);
  Result<OutputFile> file = OutputFile::Create(path, 0600);
  Status written = file.status();
  if (file.ok()) {
    file->Append(std::as_bytes(std::span(&head, 1)));
    file->Append(entry.bytes.span());
    file->Append(name);
    file->Append(entry.version);
    file->Append(std::string(bytes - length, '\0'));
    written = file->Finish();
  }
  if (!written.ok() && !state_->complained.exchange(true)) LogWarning("what servers send is not kept: " + written.message());
}

namespace {
std::unique_ptr<ObjectCache>& OfProcess() {
  static std::unique_ptr<ObjectCache>& cache = *new std::unique_ptr<ObjectCache>;  // stores may read until the process ends
  return cache;
}
}  // namespace

ObjectCache* ProcessObjectCache() { return OfProcess().get(); }

Status KeepObjects(std::uint64_t budget) {
  if (budget == 0) return Status::Ok();
  const Result<std::string> cache = CacheFolder();
  if (!cache.ok()) return cache.status();
  Result<ObjectCache> opened = ObjectCache::Open(*cache + "/objects", budget);
  if (!opened.ok()) return opened.status();
  OfProcess() = std::make_unique<ObjectCache>(*std::move(opened));
  return Status::Ok();
}

}  // namespace slabstream
