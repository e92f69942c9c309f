#include "data/zarr/zarr_node.h"

#include <utility>

namespace slabstream::zarr {
namespace {

using metadata::Field;
using metadata::Join;
using metadata::Json;
using metadata::ReadJson;

Result<std::optional<ZarrNode>> ReadNode3(Store& store, const std::string& path) {
  const std::string key = Join(path, kNode3);
  Result<std::optional<Json>> metadata = ReadJson(store, key);
  if (!metadata.ok()) return metadata.status();
  if (!metadata->has_value()) return std::optional<ZarrNode>();
  ZarrNode node{.path = path, .version = 3, .metadata = **std::move(metadata), .metadata_name = store.name() + "/" + key, .keys = {key}};
  const Field field = node.metadata_field(), type = field["node_type"];
  if (!field.is_object()) return field.Wrong("an object");
  if (!type.is_text() || (type.value() != "array" && type.value() != "group")) return type.Wrong("\"array\" or \"group\"");
  if (const Result<std::uint64_t> version = field["zarr_format"].Whole(3, 3); !version.ok()) return version.status();
  node.array = type.value() == "array";
  return std::optional(std::move(node));
}

}  // namespace

Result<std::optional<ZarrNode>> ReadNode(Store& store, const std::string& path) {
  Result<std::optional<ZarrNode>> node3 = ReadNode3(store, path);
  if (!node3.ok() || node3->has_value()) return node3;
  ZarrNode node{.path = path, .version = 2};
  for (const char* const name : {kArray2, kGroup2}) {
    const std::string key = Join(path, name);
    Result<std::optional<Json>> metadata = ReadJson(store, key);
    if (!metadata.ok()) return metadata.status();
    if (!metadata->has_value()) continue;
    node.array = name == kArray2;
    node.metadata = **std::move(metadata);
    node.metadata_name = store.name() + "/" + key;
    node.keys.push_back(key);
    break;
  }
  // Some writers leave out .zgroup.
  const std::string key = Join(path, kAttributes2);
  Result<std::optional<Json>> attributes = ReadJson(store, key);
  if (!attributes.ok()) return attributes.status();
  if (attributes->has_value()) {
    node.attributes = **std::move(attributes);
    node.keys.push_back(key);
  }
  node.attributes_name = store.name() + "/" + key;
  if (node.keys.empty()) return std::optional<ZarrNode>();
  return std::optional(std::move(node));
}

}  // namespace slabstream::zarr
