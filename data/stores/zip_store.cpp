// A handle of libzip is for one thread, and one that reads the archive's directory again for each thread would hold it as often. So reads
// of one archive take turns. Chunks in archives are stored, not deflated, so a turn is short.
//
// What the directory says of sizes is only believed as a limit: no more bytes than asked for are taken, and a member that ends before or
// behind its size is damaged.
#include <fmt/format.h>
#include <zip.h>

#include <algorithm>
#include <array>
#include <mutex>
#include <set>
#include <utility>

#include "common/memory/pooled_vector.h"
#include "data/stores/object_key.h"
#include "data/stores/range_reader.h"
#include "data/stores/read_threads.h"
#include "data/stores/store.h"

namespace slabstream {
namespace {

// What lies before a range of a deflated member has to be inflated too.
constexpr std::uint64_t kMostInflated = std::uint64_t{1} << 30;

struct DiscardArchive {
  void operator()(zip_t* archive) const { zip_discard(archive); }
};
struct CloseMember {
  void operator()(zip_file_t* file) const { zip_fclose(file); }
};
using Member = std::unique_ptr<zip_file_t, CloseMember>;

class Archive {
 public:
  Archive(std::string path, zip_t* archive) : path_(std::move(path)), archive_(archive) {}

  Result<Bytes> Read(const std::string& key, const ByteRange& range, std::uint64_t most) {
    const std::lock_guard lock(mutex_);
    const std::string what = path_ + "/" + key;
    const zip_int64_t number = zip_name_locate(archive_.get(), key.c_str(), 0);
    if (number < 0) return Status::NotFound(what + ": does not exist");
    zip_stat_t about{};
    constexpr zip_uint64_t kNeeded = ZIP_STAT_SIZE | ZIP_STAT_COMP_METHOD;
    if (zip_stat_index(archive_.get(), zip_uint64_t(number), 0, &about) != 0 || (about.valid & kNeeded) != kNeeded) {
      return Damaged(what, zip_get_error(archive_.get()));
    }
    if ((about.valid & ZIP_STAT_ENCRYPTION_METHOD) != 0 && about.encryption_method != ZIP_EM_NONE) {
      return Status::Unavailable(what + ": is encrypted");
    }
    const bool stored = about.comp_method == ZIP_CM_STORE;
    if (!stored && about.comp_method != ZIP_CM_DEFLATE) {
      return Status::Unavailable(fmt::format("{}: is packed by method {}, must be stored or deflated", what, about.comp_method));
    }
    const Result<ByteSpan> span = BytesOfRange(what, about.size, range, most);
    if (!span.ok()) return span.status();
    if (!stored && span->begin + span->bytes > std::max(most, kMostInflated)) {
      return Status::ResourceExhausted(
          fmt::format("{}: is deflated and has {} bytes, at most {} of them are inflated", what, about.size, kMostInflated));
    }
    const Member member(zip_fopen_index(archive_.get(), zip_uint64_t(number), 0));
    if (member == nullptr) return Damaged(what, zip_get_error(archive_.get()));
    if (!SkipTo(member.get(), span->begin, stored)) return Damaged(what, zip_file_get_error(member.get()));
    UnwrittenVector<std::byte> bytes(span->bytes);
    if (Take(member.get(), bytes) != bytes.size()) return Damaged(what, zip_file_get_error(member.get()));
    // At its end a member's checksum is compared.
    std::array<std::byte, 1> more{};
    if (span->begin + span->bytes == about.size && zip_fread(member.get(), more.data(), more.size()) != 0) {
      return Damaged(what, zip_file_get_error(member.get()));
    }
    return Bytes(std::move(bytes));
  }

  Result<std::vector<std::string>> List(const std::string& folder) {
    const std::lock_guard lock(mutex_);
    const std::string prefix = folder.empty() ? "" : folder + "/";
    std::set<std::string> names;
    const zip_int64_t count = zip_get_num_entries(archive_.get(), 0);
    for (zip_int64_t i = 0; i < count; ++i) {
      const char* const entry = zip_get_name(archive_.get(), zip_uint64_t(i), 0);
      const std::string_view name = entry == nullptr ? "" : entry;
      if (!name.starts_with(prefix) || name.size() == prefix.size()) continue;
      const std::string_view below = name.substr(prefix.size());
      names.emplace(below.substr(0, std::min(below.find('/'), below.size() - 1) + 1));
    }
    if (names.empty() && !folder.empty()) return Status::NotFound(path_ + "/" + folder + ": does not exist");
    return std::vector<std::string>(names.begin(), names.end());
  }

  const std::string& path() const { return path_; }

 private:
  static Status Damaged(const std::string& what, zip_error_t* error) {
    const bool known = error != nullptr && zip_error_code_zip(error) != ZIP_ER_OK;
    return Status::DataLoss(fmt::format("{}: damaged{}{}", what, known ? ": " : "", known ? zip_error_strerror(error) : ""));
  }

  static std::size_t Take(zip_file_t* member, std::span<std::byte> out) {
    std::size_t taken = 0;
    while (taken < out.size()) {
      const zip_int64_t count = zip_fread(member, out.data() + taken, out.size() - taken);
      if (count <= 0) break;
      taken += std::size_t(count);
    }
    return taken;
  }

  static bool SkipTo(zip_file_t* member, std::uint64_t begin, bool stored) {
    if (begin == 0) return true;
    if (stored) return zip_fseek(member, zip_int64_t(begin), SEEK_SET) == 0;
    std::vector<std::byte> skipped(std::min<std::uint64_t>(begin, 1 << 16));
    for (std::uint64_t rest = begin; rest > 0;) {
      const std::span<std::byte> next = std::span(skipped).first(std::min<std::uint64_t>(rest, skipped.size()));
      if (Take(member, next) != next.size()) return false;
      rest -= next.size();
    }
    return true;
  }

  const std::string path_;
  std::mutex mutex_;  // guards the handle
  const std::unique_ptr<zip_t, DiscardArchive> archive_;
};

class ZipStoreImpl : public Store {
 public:
  explicit ZipStoreImpl(std::shared_ptr<Archive> archive) : archive_(std::move(archive)) {}

  void Read(const std::string& key, const ByteRange& range, std::uint64_t most, Done done, StillWanted /*wanted*/) override {
    if (Status status = CheckObjectKey(name(), key); !status.ok()) return done(std::move(status));
    ReadOnThread(
        name(), [archive = archive_, key, range, most] { return archive->Read(key, range, most); }, std::move(done));
  }

  Result<std::vector<std::string>> List(const std::string& folder) override {
    if (Status status = CheckFolderKey(name(), folder); !status.ok()) return status;
    return archive_->List(folder);
  }

  const std::string& name() const override { return archive_->path(); }

 private:
  const std::shared_ptr<Archive> archive_;  // which reads that are under way keep
};

}  // namespace

Result<std::shared_ptr<Store>> ZipStore(const std::string& path) {
  int code = ZIP_ER_OK;
  zip_t* const archive = zip_open(path.c_str(), ZIP_RDONLY, &code);
  if (archive != nullptr) return std::shared_ptr<Store>(std::make_shared<ZipStoreImpl>(std::make_shared<Archive>(path, archive)));
  zip_error_t error;
  zip_error_init_with_code(&error, code);
  const std::string why = zip_error_strerror(&error);
  zip_error_fini(&error);
  switch (code) {
    case ZIP_ER_NOENT: return Status::NotFound(path + ": does not exist");
    case ZIP_ER_MEMORY: return Status::ResourceExhausted(path + ": not enough memory for its directory");
    case ZIP_ER_NOZIP: return Status::InvalidArgument(path + ": not a zip archive");
    case ZIP_ER_OPEN: return Status::Unavailable(path + ": cannot be opened: " + why);
    default: return Status::DataLoss(path + ": a damaged zip archive: " + why);
  }
}

}  // namespace slabstream
