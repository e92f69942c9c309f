// A node of a Zarr hierarchy: an array or a group, with its attributes.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "data/metadata/json_fields.h"
#include "data/stores/store.h"

namespace slabstream::zarr {

struct ZarrNode {
  std::string path;           // in the store; "": its root
  int version = 3;            // Zarr's version: 2 or 3
  bool array = false;         // else a group
  Json metadata;              // of version 2: of an array .zarray, of a group nothing
  std::string metadata_name;  // the store's name and the object's: "/data/scan.zarr/0/zarr.json"
  Json attributes;
  std::string attributes_name;
  std::vector<std::string> keys = {};  // the keys of the objects that were read

  metadata::Field metadata_field() const { return {metadata_name, metadata}; }
  // In version 3 attributes are a member of the metadata, so their place in messages is "attributes".
  metadata::Field attributes_field() const {
    return version == 3 ? metadata_field()["attributes"] : metadata::Field(attributes_name, attributes);
  }
};

// A node that is being read: all objects that may describe it at the same time.
class NodeReading {
 public:
  NodeReading(Store& store, const std::string& path);
  const std::string& path() const { return path_; }
  // Waits. May be called once. nullopt: no node is there. DataLoss, InvalidArgument: damaged or wrong metadata; errors of Store::Read.
  Result<std::optional<ZarrNode>> Get();

 private:
  Result<std::optional<ZarrNode>> Node3();
  Result<std::optional<ZarrNode>> Node2();

  Store& store_;
  std::string path_;
  metadata::JsonReading node3_, array2_, group2_, attributes2_;
};

// The names of the objects of which a node has at least one.
inline constexpr const char *kNode3 = "zarr.json", *kArray2 = ".zarray", *kGroup2 = ".zgroup", *kAttributes2 = ".zattrs";
inline constexpr std::array<std::string_view, 4> kNodeObjects = {kNode3, kArray2, kGroup2, kAttributes2};

}  // namespace slabstream::zarr
