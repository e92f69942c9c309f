#include "data/open/remote_source.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <xxhash.h>

#include <future>
#include <optional>
#include <utility>
#include <vector>

#include "common/base/printable.h"
#include "data/stores/store.h"

namespace slabstream {
namespace {

class RemoteSource : public VolumeSource {
 public:
  RemoteSource(std::shared_ptr<VolumeSource> source, std::uint64_t version) : source_(std::move(source)), info_(source_->info()) {
    info_.files.clear();
    info_.version = version;
  }

  const SourceInfo& info() const override { return info_; }
  Counts counts() const override { return source_->counts(); }
  void Read(int level, const Box& box, const BoxRoom& out, std::stop_token stop, ReadDone done) override {
    source_->Read(level, box, out, std::move(stop), std::move(done));
  }

 private:
  const std::shared_ptr<VolumeSource> source_;
  SourceInfo info_;
};

// The markers of all formats are asked for at a time.
struct Marker {
  const SourceFormat* format = nullptr;
  std::string key;
  std::future<Result<Bytes>> answer;
};

}  // namespace

Result<RemoteFormat> FindRemoteFormat(const std::string& url, std::span<const SourceFormat> formats) {
  const Result<std::shared_ptr<Store>> store = OpenStore(url);
  if (!store.ok()) return store.status();
  std::vector<Marker> markers;
  for (const SourceFormat& format : formats) {
    for (const std::string_view key : format.markers) markers.push_back({&format, std::string(key), BeginRead(**store, std::string(key))});
  }
  RemoteFormat found;
  std::optional<Status> failure;
  for (Marker& marker : markers) {
    const Result<Bytes> bytes = marker.answer.get();
    if (bytes.ok()) {
      if (found.format == nullptr) found.format = marker.format;
      found.version = XXH3_64bits_withSeed(bytes->span().data(), bytes->size(), found.version);
    } else if (bytes.status().code() != StatusCode::kNotFound && !failure) {
      failure = bytes.status();
    }
  }
  if (failure) return *failure;
  if (found.format != nullptr) return found;
  std::vector<std::string_view> keys;
  for (const Marker& marker : markers) keys.push_back(marker.key);
  return Printable(
      Status::NotFound(fmt::format("{}: is no volume that can be read from an address: it holds none of {}", url, fmt::join(keys, ", "))));
}

Result<std::shared_ptr<VolumeSource>> OpenRemote(std::uint64_t version, const OpenFunction& open) {
  Result<std::shared_ptr<VolumeSource>> source = open();
  if (!source.ok()) return source;
  return std::shared_ptr<VolumeSource>(std::make_shared<RemoteSource>(*std::move(source), version));
}

}  // namespace slabstream
