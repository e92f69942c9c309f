#include "data/zarr_writer/ome_metadata.h"

#include <fmt/format.h>

#include "common/json/json.h"

namespace slabstream {
namespace {

Json Numbers(const Index3& v) { return {v.z, v.y, v.x}; }  // in the order of the array's axes
Json Numbers(const Vec3& v) { return {v.z, v.y, v.x}; }
Json Xyz(const Vec3& v) { return {v.x, v.y, v.z}; }

// As UDUNITS names it; "": none is known.
std::string UnitName(const Orientation& orientation) {
  switch (orientation.unit.value_or(orientation.world == World::kPatient ? LengthUnit::kMillimetre : LengthUnit::kFile)) {
    case LengthUnit::kMillimetre: return "millimeter";
    case LengthUnit::kMicrometre: return "micrometer";
    case LengthUnit::kNanometre: return "nanometer";
    case LengthUnit::kAngstrom: return "angstrom";
    case LengthUnit::kCentimetre: return "centimeter";
    case LengthUnit::kMetre: return "meter";
    case LengthUnit::kVoxel:
    case LengthUnit::kFile: break;
  }
  return "";
}

Json Axes(const Orientation& orientation) {
  Json axes = Json::array();
  for (const char* const name : {"z", "y", "x"}) {
    Json axis = {{"name", name}, {"type", "space"}};
    if (const std::string unit = UnitName(orientation); !unit.empty()) axis["unit"] = unit;
    axes.push_back(axis);
  }
  return axes;
}

Json Multiscale(const std::vector<WrittenLevel>& levels, const std::string& name, const Orientation& orientation, const Vec3& shift,
                bool labels) {
  Json datasets = Json::array();
  for (std::size_t l = 0; l < levels.size(); ++l) {
    const Json scale = {{"type", "scale"}, {"scale", Numbers(levels[l].spacing)}};
    const Json translation = {{"type", "translation"}, {"translation", Numbers(shift + levels[l].first)}};
    datasets.push_back({{"path", std::to_string(l)}, {"coordinateTransformations", Json::array({scale, translation})}});
  }
  return {{"name", name}, {"axes", Axes(orientation)}, {"datasets", datasets}, {"type", labels ? "mode" : "mean"}};
}

Json ArrayV2(const ZarrLayout& layout, const WrittenLevel& level) {
  const std::size_t bytes = BytesPerSample(layout.type);
  const std::string name(ToString(layout.type));  // "uint16"
  const std::string type = fmt::format("{}{}{}", bytes == 1 ? '|' : '<', name[0], bytes);
  return {{"zarr_format", 2},
          {"shape", Numbers(level.size)},
          {"chunks", Numbers(Uniform(layout.chunk_side))},
          {"dtype", type},
          {"compressor", {{"id", "zstd"}, {"level", layout.codec_level}}},
          {"fill_value", 0},
          {"order", "C"},
          {"filters", nullptr},
          {"dimension_separator", "/"}};
}

Json ArrayV3(const ZarrLayout& layout, const WrittenLevel& level) {
  const Json bytes = {{"name", "bytes"}, {"configuration", {{"endian", "little"}}}};
  const Json zstd = {{"name", "zstd"}, {"configuration", {{"level", layout.codec_level}, {"checksum", true}}}};
  const Json shards = {{"name", "sharding_indexed"},
                       {"configuration",
                        {{"chunk_shape", Numbers(Uniform(layout.chunk_side))},
                         {"codecs", Json::array({bytes, zstd})},
                         {"index_codecs", Json::array({bytes, Json{{"name", "crc32c"}}})},
                         {"index_location", "end"}}}};
  return {{"zarr_format", 3},
          {"node_type", "array"},
          {"shape", Numbers(level.size)},
          {"data_type", ToString(layout.type)},
          {"chunk_grid", {{"name", "regular"}, {"configuration", {{"chunk_shape", Numbers(ShardOf(layout, level))}}}}},
          {"chunk_key_encoding", {{"name", "default"}, {"configuration", {{"separator", "/"}}}}},
          {"fill_value", 0},
          {"codecs", Json::array({shards})},
          {"attributes", Json::object()},
          {"dimension_names", {"z", "y", "x"}}};
}

}  // namespace

std::string_view ToString(OmeZarrVersion version) { return version == OmeZarrVersion::k04 ? "0.4" : "0.5"; }

Index3 ShardOf(const ZarrLayout& layout, const WrittenLevel& level) {
  return Min(layout.shard, layout.chunk_side * CubesOver(level.size, layout.chunk_side));
}

std::vector<MetadataFile> OmeMetadata(const ZarrLayout& layout, const std::vector<WrittenLevel>& levels, const std::string& name,
                                      const Orientation& orientation, const ValueMapping& mapping, bool labels) {
  // Where the axes are those of the world, others find the volume's place there, too.
  const bool straight = orientation.axes == Orientation{}.axes;
  Json multiscale = Multiscale(levels, name, orientation, straight ? orientation.origin : Vec3{}, labels);
  const Json axes = {Xyz(orientation.axes[0]), Xyz(orientation.axes[1]), Xyz(orientation.axes[2])};
  const Json place = {{"world", NameOf(orientation.world)}, {"origin", Xyz(straight ? Vec3{} : orientation.origin)}, {"axes", axes}};
  const Json own = {{"orientation", place}, {"values", {{"scale", mapping.scale}, {"offset", mapping.offset}}}};
  const auto text = [](const Json& json) { return json.dump(2) + "\n"; };
  std::vector<MetadataFile> files;
  for (std::size_t l = 0; l < levels.size(); ++l) {
    if (layout.version == OmeZarrVersion::k04) {
      files.push_back({fmt::format("{}/.zarray", l), text(ArrayV2(layout, levels[l]))});
    } else {
      files.push_back({fmt::format("{}/zarr.json", l), text(ArrayV3(layout, levels[l]))});
    }
  }
  const std::string version(ToString(layout.version));
  if (layout.version == OmeZarrVersion::k04) {
    multiscale["version"] = version;
    Json attributes = {{"multiscales", Json::array({multiscale})}};
    if (labels) attributes["image-label"] = {{"version", version}};
    attributes["slabstream"] = own;
    files.push_back({".zattrs", text(attributes)});
    files.push_back({".zgroup", text({{"zarr_format", 2}})});
  } else {
    Json ome = {{"version", version}, {"multiscales", Json::array({multiscale})}};
    if (labels) ome["image-label"] = Json::object();
    files.push_back({"zarr.json", text({{"zarr_format", 3}, {"node_type", "group"}, {"attributes", {{"ome", ome}, {"slabstream", own}}}})});
  }
  return files;
}

}  // namespace slabstream
