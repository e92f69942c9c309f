#include "data/open/remote_source.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <xxhash.h>

#include <algorithm>
#include <future>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "common/base/printable.h"
#include "data/stores/store.h"

namespace slabstream {
namespace {

// "sv" and "sig" of "sv=1&sig=2"; values may be secret.
std::vector<std::string_view> NamesIn(std::string_view query) {
  std::vector<std::string_view> names;
  for (std::size_t begin = 0; begin < query.size();) {
    const std::string_view each = query.substr(begin, std::min(query.find('&', begin), query.size()) - begin);
    names.push_back(each.substr(0, each.find('=')));
    begin += each.size() + 1;
  }
  return names;
}

// The markers of all formats are asked for at a time.
struct Marker {
  const VolumeFormat* format = nullptr;
  std::string key;
  std::future<Result<Bytes>> answer;
};

class RemoteSource : public DescribedSource {
 public:
  using DescribedSource::DescribedSource;

 private:
  std::shared_ptr<VolumeSource> Around(std::shared_ptr<VolumeSource> source, SourceInfo info) const override {
    return std::make_shared<RemoteSource>(std::move(source), std::move(info));
  }
};

bool MayBeJsonObject(std::span<const std::byte> bytes) {
  constexpr std::string_view kBlank = "\xEF\xBB\xBF \t\r\n";  // and a byte order mark
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const std::size_t begin = text.find_first_not_of(kBlank);
  return begin != std::string_view::npos && text[begin] == '{';
}

}  // namespace

Result<RemoteFormat> FindRemoteFormat(Store& store, std::span<const VolumeFormat> formats) {
  std::vector<Marker> markers;
  for (const VolumeFormat& format : formats) {
    for (const std::string_view key : format.markers) markers.push_back({&format, std::string(key), BeginRead(store, std::string(key))});
  }
  RemoteFormat found;
  std::optional<Status> failure;
  std::set<std::uint64_t> contents;
  std::size_t count = 0;
  for (Marker& marker : markers) {
    const Result<Bytes> bytes = marker.answer.get();
    if (bytes.ok() && MayBeJsonObject(bytes->span())) {
      ++count;
      if (found.format == nullptr) found.format = marker.format;
      contents.insert(XXH3_64bits(bytes->span().data(), bytes->size()));
      found.version = XXH3_64bits_withSeed(bytes->span().data(), bytes->size(), found.version);
    } else if (!bytes.ok() && bytes.status().code() != StatusCode::kNotFound && !failure) {
      failure = bytes.status();
    }
  }
  // A server that answers all with one page, such as {"error": "not found"}, has no volume.
  const bool is_one_page = count > 1 && count == markers.size() && contents.size() == 1;
  if (found.format != nullptr && !is_one_page) return found;
  if (failure) return *failure;
  std::vector<std::string_view> keys;
  for (const Marker& marker : markers) keys.push_back(marker.key);
  return Printable(Status::NotFound(
      fmt::format("{}: is no volume that can be read from an address: it holds none of {}", store.name(), fmt::join(keys, ", "))));
}

Result<std::shared_ptr<VolumeSource>> OpenRemote(std::uint64_t version, std::string_view query, const OpenFunction& open) {
  Result<std::shared_ptr<VolumeSource>> source = open();
  if (!source.ok()) return source;
  SourceInfo info = (*source)->info();
  info.files.clear();
  // The markers may stay what they are when a store grows.
  const int times = info.times.count;
  info.version = times > 1 ? XXH3_64bits_withSeed(&times, sizeof times, version) : version;
  if (!query.empty()) info.notes.push_back(fmt::format("each request has the query of the address: {}", fmt::join(NamesIn(query), ", ")));
  return std::shared_ptr<VolumeSource>(std::make_shared<RemoteSource>(*std::move(source), std::move(info)));
}

}  // namespace slabstream
