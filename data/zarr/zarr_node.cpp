#include "data/zarr/zarr_node.h"

#include <utility>

namespace slabstream::zarr {

using metadata::Field;
using metadata::Join;

NodeReading::NodeReading(Store& store, const std::string& path)
    : store_(store),
      path_(path),
      node3_(store, Join(path, kNode3)),
      array2_(store, Join(path, kArray2)),
      group2_(store, Join(path, kGroup2)),
      attributes2_(store, Join(path, kAttributes2)) {}

Result<std::optional<ZarrNode>> NodeReading::Get() {
  Result<std::optional<ZarrNode>> node3 = Node3();
  return !node3.ok() || node3->has_value() ? node3 : Node2();
}

Result<std::optional<ZarrNode>> NodeReading::Node3() {
  Result<std::optional<Json>> metadata = node3_.Get();
  if (!metadata.ok()) return metadata.status();
  if (!metadata->has_value()) return std::optional<ZarrNode>();
  const std::string key = Join(path_, kNode3);
  ZarrNode node{.path = path_, .version = 3, .metadata = **std::move(metadata), .metadata_name = store_.name() + "/" + key, .keys = {key}};
  const Field field = node.metadata_field(), type = field["node_type"];
  if (!field.is_object()) return field.Wrong("an object");
  if (!type.is_text() || (type.value() != "array" && type.value() != "group")) return type.Wrong("\"array\" or \"group\"");
  if (const Result<std::uint64_t> version = field["zarr_format"].Whole(3, 3); !version.ok()) return version.status();
  node.array = type.value() == "array";
  return std::optional(std::move(node));
}

Result<std::optional<ZarrNode>> NodeReading::Node2() {
  ZarrNode node{.path = path_, .version = 2};
  for (const char* const name : {kArray2, kGroup2}) {
    const std::string key = Join(path_, name);
    Result<std::optional<Json>> metadata = (name == kArray2 ? array2_ : group2_).Get();
    if (!metadata.ok()) return metadata.status();
    if (!metadata->has_value()) continue;
    node.array = name == kArray2;
    node.metadata = **std::move(metadata);
    node.metadata_name = store_.name() + "/" + key;
    node.keys.push_back(key);
    break;
  }
  // Some writers leave out .zgroup.
  const std::string key = Join(path_, kAttributes2);
  Result<std::optional<Json>> attributes = attributes2_.Get();
  if (!attributes.ok()) return attributes.status();
  if (attributes->has_value()) {
    node.attributes = **std::move(attributes);
    node.keys.push_back(key);
  }
  node.attributes_name = store_.name() + "/" + key;
  if (node.keys.empty()) return std::optional<ZarrNode>();
  return std::optional(std::move(node));
}

}  // namespace slabstream::zarr
