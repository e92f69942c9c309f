#include "data/zarr/consolidated_store.h"

#include <algorithm>
#include <cstring>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "common/memory/pooled_vector.h"
#include "data/metadata/json_fields.h"
#include "data/stores/range_reader.h"
#include "data/zarr/zarr_node.h"

namespace slabstream::zarr {
namespace {

using metadata::Field;
using metadata::Join;

using Objects = std::map<std::string, std::string, std::less<>>;  // by their keys

class ConsolidatedStore : public Store {
 public:
  ConsolidatedStore(std::shared_ptr<Store> store, std::string root, Objects objects)
      : store_(std::move(store)), root_(std::move(root)), objects_(std::move(objects)) {
    for (const auto& [key, text] : objects_) nodes_.insert(key.substr(0, NodeEnd(key)));
  }

  void Read(const std::string& key, const ByteRange& range, std::uint64_t most, Done done, StillWanted wanted) override {
    const std::size_t end = NodeEnd(key);
    const bool describes = std::ranges::find(kNodeObjects, std::string_view(key).substr(end == 0 ? 0 : end + 1)) != kNodeObjects.end();
    // What is said of a node is said as a whole. Of the root more may be said elsewhere.
    if (!describes || end == 0 || !nodes_.contains(key.substr(0, end)))
      return store_->Read(key, range, most, std::move(done), std::move(wanted));
    const auto object = objects_.find(key);
    if (object == objects_.end()) return done(Status::NotFound(name() + "/" + key + ": does not exist"));
    const Result<ByteSpan> span = BytesOfRange(name() + "/" + key, object->second.size(), range, most);
    if (!span.ok()) return done(span.status());
    UnwrittenVector<std::byte> bytes(span->bytes);
    std::memcpy(bytes.data(), object->second.data() + span->begin, bytes.size());
    done(Bytes(std::move(bytes)));
  }

  Result<std::vector<std::string>> List(const std::string& folder) override {
    std::set<std::string> names;
    const std::string prefix = folder.empty() ? "" : folder + "/";
    for (auto node = nodes_.lower_bound(prefix); node != nodes_.end() && node->starts_with(prefix); ++node) {
      const std::string name = node->substr(prefix.size(), node->find('/', prefix.size()) - prefix.size());
      if (!name.empty()) names.insert(name + "/");
    }
    return std::vector<std::string>(names.begin(), names.end());
  }

  std::future<Result<bool>> HasChanged(const std::string& key) override { return store_->HasChanged(objects_.contains(key) ? root_ : key); }

  const std::string& name() const override { return store_->name(); }

 private:
  // The length of the path of the node that an object describes.
  static std::size_t NodeEnd(std::string_view key) {
    const std::size_t slash = key.rfind('/');
    return slash == std::string_view::npos ? 0 : slash;
  }

  const std::shared_ptr<Store> store_;
  const std::string root_;  // the object that holds those of all nodes
  const Objects objects_;
  std::set<std::string, std::less<>> nodes_;
};

// None: it is no JSON, or not there.
std::optional<Json> ReadIfThere(metadata::JsonReading& reading) {
  Result<std::optional<Json>> json = reading.Get();
  return json.ok() ? *std::move(json) : std::nullopt;
}

}  // namespace

std::shared_ptr<Store> WithConsolidatedMetadata(std::shared_ptr<Store> store) {
  constexpr const char* kAll = ".zmetadata";
  metadata::JsonReading of_root(*store, kNode3), of_all(*store, kAll);
  const std::optional<Json> root = ReadIfThere(of_root), all = ReadIfThere(of_all);
  Objects objects;
  if (root) {
    const Field nodes = Field("", *root)["consolidated_metadata"]["metadata"];
    if (nodes.is_object()) {
      for (const auto& [path, node] : nodes.value().items()) objects.emplace(Join(path, kNode3), node.dump());
    }
  } else if (all) {
    const Field nodes = Field("", *all)["metadata"];
    if (nodes.is_object()) {
      for (const auto& [key, object] : nodes.value().items()) objects.emplace(key, object.dump());
    }
  }
  return objects.empty() ? store : std::make_shared<ConsolidatedStore>(std::move(store), root ? kNode3 : kAll, std::move(objects));
}

}  // namespace slabstream::zarr
