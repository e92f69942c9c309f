// Objects behind an HTTP server. What was read of an object stays what it was: a later read that finds another version of it is an error,
// so that no volume is a mixture of two.
#include <fmt/format.h>
#include <xxhash.h>

#include <algorithm>
#include <atomic>
#include <functional>
#include <future>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "common/base/printable.h"
#include "common/base/time.h"
#include "common/files/files.h"
#include "common/text/trimmed.h"
#include "common/text/url.h"
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
  HttpStoreImpl(std::string url, std::shared_ptr<const HttpAccess> access, HttpTransfers& transfers, const ObjectCache* cache)
      : url_(std::move(url)),
        access_(std::move(access)),
        transfers_(transfers),
        cache_(cache == nullptr ? std::nullopt : std::optional(*cache)) {}

  void Read(const std::string& key, const ByteRange& range, std::uint64_t most, Done done, StillWanted wanted) override {
    if (Status status = CheckObjectKey(url_, key); !status.ok()) return done(std::move(status));
    if (range.bytes == 0) return done(Bytes());
    if (seen_.IsMissing(key, MonotonicNow())) {
      return done(Printable(Status::NotFound(fmt::format("{}/{}: does not exist, as the server said less than a minute ago", url_, key))));
    }
    const bool whole = range.begin == 0 && range.bytes == ByteRange::kAll;
    HttpGet get{.url = UrlOf(key), .span = {}, .most = most, .access = access_, .wanted = wanted};
    // Where an object ends must be known to read what lies there: servers differ in what they make of "the last n bytes".
    if (!whole && (range.from_end || range.bytes == ByteRange::kAll)) {
      get.only_size = true;
      const auto sized = [self = shared_from_this(), key, range, most, done, wanted](const HttpObject& object) {
        const Result<ByteSpan> span = BytesOfRange(self->url_ + "/" + key, object.size, range, most);
        if (!span.ok()) return done(span.status());
        self->Read(key, {span->begin, span->bytes}, most, done, wanted);
      };
      return transfers_.Get(std::move(get), Checked(key, std::nullopt, false, sized, done));
    }
    if (!whole) {
      get.span = ByteSpan{range.begin, range.bytes};
      if (range.bytes > most) {  // unless the object ends before
        get.span->bytes = most;
        if (most == 0) return done(Printable(Status::ResourceExhausted(get.url + ": nothing may be read of it")));
      }
    }
    const std::optional<ByteSpan> span = get.span;
    const auto read = [self = shared_from_this(), key, range, most, done](const HttpObject& object) {
      const bool cut = range.bytes != ByteRange::kAll && range.bytes > most && object.size > range.begin + most;
      if (cut) return done(Printable(Status::ResourceExhausted(fmt::format("{}/{}: has more than {} bytes", self->url_, key, most))));
      done(object.bytes);
    };
    Get(key, std::move(get), Checked(key, span, true, read, done));
  }

  Result<std::vector<std::string>> List(const std::string& folder) override {
    return Printable(Status::InvalidArgument(fmt::format("{}{}{}: a web server does not say what lies there; name the array (?array=)",
                                                         url_, folder.empty() ? "" : "/", folder)));
  }

  std::future<Result<bool>> HasChanged(const std::string& key) override {
    HttpGet get{.url = UrlOf(key), .most = kMostMetadataBytes, .known = seen_.StrongVersionOf(key), .access = access_};
    const auto answer = std::make_shared<std::promise<Result<bool>>>();
    transfers_.Get(std::move(get), [self = shared_from_this(), key, answer](const Result<HttpObject>& object) {
      if (!object.ok()) return answer->set_value(object.status());
      const SeenObjects::News news{object->version, object->size, SeenObjects::Part{{}, object->bytes.size(), DigestOf(object->bytes)}};
      answer->set_value(!object->unchanged && object->instead.empty() &&
                        self->seen_.Judge(key, news, MonotonicNow()) != SeenObjects::Verdict::kSame);
    });
    return answer->get_future();
  }

  const std::string& name() const override { return url_; }

 private:
  using Take = std::function<void(const HttpObject&)>;

  std::string UrlOf(const std::string& key) const { return url_ + "/" + EncodedPath(key); }

  // Hands over what came of an object if it is that object as it was before; else tells `done` why not.
  HttpTransfers::Done Checked(const std::string& key, const std::optional<ByteSpan>& span, bool has_bytes, Take take, Done done) {
    return [self = shared_from_this(), key, span, has_bytes, take = std::move(take), done = std::move(done)](Result<HttpObject> object) {
      if (!object.ok()) {
        if (object.status().code() == StatusCode::kNotFound) self->seen_.NoteMissing(key, MonotonicNow());
        return done(object.status());
      }
      if (!object->instead.empty()) return self->Doubt({key, object->instead, done});
      if (has_bytes && !span) self->NoteWitness(key);
      SeenObjects::News news{object->version, object->size, {}};
      if (has_bytes) news.part = SeenObjects::Part{span, object->bytes.size(), DigestOf(object->bytes)};
      switch (self->seen_.Judge(key, news, MonotonicNow())) {
        case SeenObjects::Verdict::kSame: return take(*object);
        case SeenObjects::Verdict::kChanged: return done(self->Changed(key));
        case SeenObjects::Verdict::kMustBeCompared: break;
      }
      self->Compare(key, self->seen_.parts(key), [self, key, news, take, object = *std::move(object), done](const Status& same) {
        if (!same.ok()) return done(same);
        self->seen_.Accept(key, news, MonotonicNow());
        take(object);
      });
    };
  }

  static std::uint64_t DigestOf(const Bytes& bytes) { return XXH3_64bits(bytes.span().data(), bytes.size()); }

  // Reads parts of an object once more, one after the other, and tells whether they are what they were.
  void Compare(const std::string& key, std::vector<SeenObjects::Part> parts, std::function<void(const Status&)> done) {
    if (parts.empty()) return done(Status::Ok());
    const SeenObjects::Part part = parts.back();
    parts.pop_back();
    HttpGet get{.url = UrlOf(key), .span = part.span, .most = std::max<std::uint64_t>(part.bytes, 1), .access = access_};
    transfers_.Get(std::move(get), [self = shared_from_this(), key, part, parts = std::move(parts),
                                    done = std::move(done)](const Result<HttpObject>& object) mutable {
      const bool is_longer = object.status().code() == StatusCode::kResourceExhausted;
      if (!object.ok() && !is_longer) return done(object.status());
      if (is_longer || !object->instead.empty() || DigestOf(object->bytes) != part.digest) return done(self->Changed(key));
      self->Compare(key, std::move(parts), std::move(done));
    });
  }

  // An object for which the server sent something else, which may mean that there is none.
  struct Doubtful {
    std::string key, instead;
    Done done;
  };

  // An object that was read proves, if it can be read again, that the server lets us read what is there.
  void NoteWitness(const std::string& key) {
    const std::lock_guard lock(mutex_);
    if (witness_.empty()) witness_ = key;
  }

  // One question answers all doubts that came before it was asked.
  void Doubt(Doubtful doubtful) {
    std::unique_lock lock(mutex_);
    if (witness_.empty()) {
      lock.unlock();
      return Deny(doubtful);
    }
    doubts_.push_back(std::move(doubtful));
    const bool is_first = !std::exchange(asks_witness_, true);
    lock.unlock();
    if (is_first) AskWitness();
  }

  void AskWitness() {
    std::vector<Doubtful> doubts;
    std::string witness;
    {
      const std::lock_guard lock(mutex_);
      if (doubts_.empty()) {
        asks_witness_ = false;
        return;
      }
      doubts.swap(doubts_);
      witness = witness_;
    }
    HttpGet get{.url = UrlOf(witness), .most = kMostMetadataBytes, .access = access_};
    transfers_.Get(std::move(get), [self = shared_from_this(), doubts = std::move(doubts)](const Result<HttpObject>& object) {
      for (const Doubtful& doubtful : doubts) {
        if (!object.ok() || !object->instead.empty()) {
          self->Deny(doubtful);
          continue;
        }
        self->seen_.NoteMissing(doubtful.key, MonotonicNow());
        doubtful.done(Printable(Status::NotFound(
            fmt::format("{}/{}: does not exist ({}, but others can be read)", self->url_, doubtful.key, doubtful.instead))));
      }
      self->AskWitness();
    });
  }

  void Deny(const Doubtful& doubtful) const {
    doubtful.done(Printable(Status::Unavailable(
        fmt::format("{}/{}: {}: it is not public and needs other credentials, or it is not there", url_, doubtful.key, doubtful.instead))));
  }

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
    if (kept && seen_.IsFresh(key, kept->version, MonotonicNow())) {
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

  Status Changed(const std::string& key) const {
    return Printable(Status::Unavailable(fmt::format("{}/{}: has changed since it was opened", url_, key)));
  }

  const std::string url_;
  const std::shared_ptr<const HttpAccess> access_;
  HttpTransfers& transfers_;
  const std::optional<ObjectCache> cache_;
  std::atomic<std::uint64_t> unwritten_ = 0;  // bytes on their way to it
  SeenObjects seen_;
  std::mutex mutex_;              // guards what follows
  std::string witness_;           // the first object that was read; empty: none so far
  std::vector<Doubtful> doubts_;  // that wait for it to be read again
  bool asks_witness_ = false;
};

thread_local std::stop_token stop_of_stores;

// "NAME: VALUE" of "NAME:VALUE" or "NAME:@FILE". What they hold is in no message.
Result<std::string> HeaderLine(const std::string& text) {
  constexpr std::size_t kMostBytes = 16 << 10;
  const std::size_t colon = std::min(text.find(':'), text.size());
  const std::string name = text.substr(0, colon);
  std::string value(Trimmed(std::string_view(text).substr(std::min(colon + 1, text.size()))));
  if (value.starts_with('@')) {
    const std::string file = value.substr(1);
    const Result<std::string> read = ReadTextFile(file, kMostBytes);
    if (!read.ok()) return Status::InvalidArgument(fmt::format("header {}: {}", name, read.status().message()));
    value = Trimmed(*read);
    const bool is_line = !value.empty() && std::ranges::none_of(value, [](unsigned char c) { return c < ' ' || c == 0x7F; });
    if (!is_line) return Status::InvalidArgument(fmt::format("header {}: {}: must hold one line of text", name, file));
  }
  return fmt::format("{}: {}", name, value);
}

}  // namespace

StoresStop::StoresStop(std::stop_token stop) { stop_of_stores = std::move(stop); }
StoresStop::~StoresStop() { stop_of_stores = {}; }

Result<std::shared_ptr<Store>> HttpStore(const std::string& address, HttpTransfers& transfers, const ObjectCache* cache,
                                         const WebOptions& options) {
  std::string url = address;
  auto access = std::make_shared<HttpAccess>(HttpAccess{.query = options.query, .headers = {}, .s3 = {}, .stop = stop_of_stores});
  for (const std::string& header : options.headers) {
    Result<std::string> line = HeaderLine(header);
    if (!line.ok()) return line.status();
    access->headers.push_back(*std::move(line));
  }
  if (address.starts_with(kBucketScheme)) {
    Result<S3Place> place = FindS3Place(address);
    if (!place.ok()) return place.status();
    url = std::move(place->url);
    access->s3 = std::move(place->access);
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
  return std::shared_ptr<Store>(std::make_shared<HttpStoreImpl>(std::move(url), std::move(access), transfers, cache));
}

}  // namespace slabstream
