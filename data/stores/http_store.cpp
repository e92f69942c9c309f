// Objects behind an HTTP server. What was read of an object stays what it was: a later read that finds another version of it is an error,
// so that no volume is a mixture of two.
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <optional>
#include <utility>

#include "common/base/printable.h"
#include "common/base/time.h"
#include "common/base/url.h"
#include "data/stores/http_transfers.h"
#include "data/stores/object_cache.h"
#include "data/stores/object_key.h"
#include "data/stores/read_threads.h"
#include "data/stores/seen_objects.h"
#include "data/stores/store.h"

namespace slabstream {
namespace {

class HttpStoreImpl : public Store, public std::enable_shared_from_this<HttpStoreImpl> {
 public:
  HttpStoreImpl(std::string url, std::shared_ptr<const S3Access> access, HttpTransfers& transfers, const ObjectCache* cache,
                KeptObjects kept)
      : url_(std::move(url)),
        access_(std::move(access)),
        transfers_(transfers),
        cache_(cache == nullptr ? std::nullopt : std::optional(*cache)),
        kept_(kept) {}

  void Read(const std::string& key, const ByteRange& range, std::uint64_t most, Done done) override {
    if (Status status = CheckObjectKey(url_, key); !status.ok()) return done(std::move(status));
    if (range.bytes == 0) return done(Bytes());
    if (seen_.IsMissing(key, MonotonicNow())) {
      return done(Printable(Status::NotFound(fmt::format("{}/{}: does not exist, as the server said less than a minute ago", url_, key))));
    }
    const bool whole = range.begin == 0 && range.bytes == ByteRange::kAll;
    HttpGet get{.url = url_ + "/" + EncodedPath(key), .span = {}, .most = most, .access = access_};
    // Where an object ends must be known to read what lies there: servers differ in what they make of "the last n bytes".
    if (!whole && (range.from_end || range.bytes == ByteRange::kAll)) {
      get.only_size = true;
      const auto sized = [self = shared_from_this(), key, range, most, done = std::move(done)](const Result<HttpObject>& object) mutable {
        if (!object.ok()) return self->Fail(key, object.status(), done);
        const Result<ByteSpan> span = BytesOfRange(self->url_ + "/" + key, object->size, range, most);
        if (!span.ok()) return done(span.status());
        if (!self->seen_.Agrees(key, object->version)) return done(self->Changed(key));
        self->Read(key, {span->begin, span->bytes}, most, std::move(done));
      };
      return transfers_.Get(std::move(get), sized);
    }
    if (!whole) {
      get.span = ByteSpan{range.begin, range.bytes};
      if (range.bytes > most) {  // unless the object ends before
        get.span->bytes = most;
        if (most == 0) return done(Printable(Status::ResourceExhausted(get.url + ": nothing may be read of it")));
      }
    }
    Get(key, std::move(get), [self = shared_from_this(), key, range, most, done = std::move(done)](Result<HttpObject> object) {
      if (!object.ok()) return self->Fail(key, object.status(), done);
      if (!self->seen_.Agrees(key, object->version)) return done(self->Changed(key));
      const bool cut = range.bytes != ByteRange::kAll && range.bytes > most && object->size > range.begin + most;
      if (cut) return done(Printable(Status::ResourceExhausted(fmt::format("{}/{}: has more than {} bytes", self->url_, key, most))));
      done(std::move(object->bytes));
    });
  }

  Result<std::vector<std::string>> List(const std::string& folder) override {
    return Printable(Status::InvalidArgument(fmt::format("{}{}{}: a web server does not say what lies there; name the array (?array=)",
                                                         url_, folder.empty() ? "" : "/", folder)));
  }

  const std::string& name() const override { return url_; }

 private:
  // Bytes that the disk has come from there, if the server has said a short while ago that they are still right, or says so now. The disk
  // is asked, and gets what the server sends, on threads that read files.
  void Get(const std::string& key, HttpGet get, HttpTransfers::Done done) {
    if (!cache_) return transfers_.Get(std::move(get), std::move(done));
    PostRead([self = shared_from_this(), key, get = std::move(get), done = std::move(done)]() mutable {
      self->GetOrFind(key, std::move(get), done);
    });
  }

  void GetOrFind(const std::string& key, HttpGet get, const HttpTransfers::Done& done) {
    const std::string name = get.span ? fmt::format("{} {}+{}", get.url, get.span->begin, get.span->bytes) : get.url;
    std::optional<ObjectCache::Entry> kept = cache_->Find(name);
    if (kept && kept->bytes.size() > get.most) kept.reset();
    if (kept && (kept_ == KeptObjects::kAreTaken || seen_.IsFresh(key, kept->version, MonotonicNow()))) {
      return done(HttpObject{.bytes = std::move(kept->bytes), .size = kept->size, .version = std::move(kept->version)});
    }
    if (kept) get.known = kept->version;
    transfers_.Get(std::move(get), [self = shared_from_this(), key, name, done, kept = std::move(kept)](Result<HttpObject> object) {
      if (object.ok() && object->unchanged) {
        object->bytes = kept->bytes;
        object->size = kept->size;
      } else if (object.ok() && object->version.starts_with('"')) {
        // Strong ETags alone: two versions may have the same time, or the same weak ETag.
        self->Keep(name, {object->version, object->size, object->bytes});
      }
      if (object.ok()) self->seen_.NoteVersion(key, object->version, MonotonicNow());
      done(std::move(object));
    });
  }

  // What comes faster than the disk takes it is not kept, so that it does not pile up in memory.
  void Keep(const std::string& name, ObjectCache::Entry entry) {
    constexpr std::uint64_t kMostUnwritten = 32 << 20;
    const std::uint64_t bytes = entry.bytes.size();
    if (unwritten_.fetch_add(bytes) + bytes > kMostUnwritten) {
      unwritten_ -= bytes;
      return;
    }
    PostRead([self = shared_from_this(), name, entry = std::move(entry), bytes] {
      self->cache_->Keep(name, entry);
      self->unwritten_ -= bytes;
    });
  }

  void Fail(const std::string& key, const Status& status, const Done& done) {
    if (status.code() == StatusCode::kNotFound) seen_.NoteMissing(key, MonotonicNow());
    done(status);
  }

  Status Changed(const std::string& key) const {
    return Printable(Status::Unavailable(fmt::format("{}/{}: has changed since it was opened", url_, key)));
  }

  const std::string url_;
  const std::shared_ptr<const S3Access> access_;
  HttpTransfers& transfers_;
  const std::optional<ObjectCache> cache_;
  const KeptObjects kept_;
  std::atomic<std::uint64_t> unwritten_ = 0;  // bytes on their way to it
  SeenObjects seen_;
};

}  // namespace

Result<std::shared_ptr<Store>> HttpStore(const std::string& address, HttpTransfers& transfers, const ObjectCache* cache, KeptObjects kept) {
  std::string url = address;
  std::shared_ptr<const S3Access> access;
  if (address.starts_with(kBucketScheme)) {
    Result<S3Place> place = FindS3Place(address);
    if (!place.ok()) return place.status();
    url = std::move(place->url);
    if (place->access) access = std::make_shared<const S3Access>(*std::move(place->access));
  }
  const auto wrong = [&](std::string_view why) { return Printable(Status::InvalidArgument(fmt::format("{}: {}", url, why))); };
  const std::size_t host = url.find("//") + 2, path = std::min(url.find('/', host), url.size());
  if (!IsUrl(url) || path == host) return wrong("must be http://HOST/PATH, https://HOST/PATH or s3://BUCKET/PATH");
  if (const std::size_t at = url.find('@', host); at < path) {
    return Status::InvalidArgument(
        fmt::format("{}...{}: an address must not hold a name or password", url.substr(0, host), url.substr(at)));
  }
  if (url.find_first_of("?#") != std::string::npos) return wrong("must have no '?' or '#'");
  while (url.ends_with('/') && url.size() > path) url.pop_back();
  return std::shared_ptr<Store>(std::make_shared<HttpStoreImpl>(std::move(url), std::move(access), transfers, cache, kept));
}

}  // namespace slabstream
