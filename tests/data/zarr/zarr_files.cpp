#include "tests/data/zarr/zarr_files.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <map>
#include <numeric>

#include "common/base/check.h"
#include "tests/data/codecs/packed_bytes.h"
#include "tests/data/volume_io/volume_files.h"
#include "tests/support/whole_file.h"

namespace slabstream {
namespace {

std::string DtypeOf(SampleType type, bool big_endian) {
  const std::string name(ToString(type));
  const std::string kind = name.starts_with("uint") ? "u" : name.substr(0, 1);
  const std::size_t bytes = BytesPerSample(type);
  return (bytes == 1 ? "|" : big_endian ? ">" : "<") + kind + std::to_string(bytes);
}

Json NamedCodec(const std::string& codec, const ZarrSpec& spec) {
  Json configuration = Json::object();
  if (codec == "gzip") configuration["level"] = 6;
  if (codec == "zstd") configuration = {{"level", 1}, {"checksum", false}};
  if (codec == "blosc") {
    configuration = {{"cname", "zstd"}, {"clevel", 5}, {"shuffle", "shuffle"}, {"typesize", BytesPerSample(spec.type)}, {"blocksize", 0}};
  }
  const bool standard = codec == "gzip" || codec == "zstd" || codec == "blosc" || codec == "crc32c";
  return {{"name", (standard ? "" : "numcodecs.") + codec}, {"configuration", configuration}};
}

Json TransposeCodec(const std::vector<std::size_t>& order) { return {{"name", "transpose"}, {"configuration", {{"order", order}}}}; }
Json BytesCodec(bool big_endian) { return {{"name", "bytes"}, {"configuration", {{"endian", big_endian ? "big" : "little"}}}}; }

Json ChunkCodecs(const ZarrSpec& spec, const std::vector<std::size_t>& transpose) {
  Json codecs = Json::array();
  if (!transpose.empty()) codecs.push_back(TransposeCodec(transpose));
  codecs.push_back(BytesCodec(spec.big_endian));
  if (!spec.codec.empty()) codecs.push_back(NamedCodec(spec.codec, spec));
  if (spec.checked) codecs.push_back(NamedCodec("crc32c", spec));
  return codecs;
}

std::vector<std::size_t> OrderOrSame(const std::vector<std::size_t>& order, std::size_t axes) {
  std::vector<std::size_t> same(axes);
  std::iota(same.begin(), same.end(), 0);
  return order.empty() ? same : order;
}

Counts Reordered(const Counts& counts, const std::vector<std::size_t>& order) {
  Counts reordered;
  for (const std::size_t axis : order) reordered.push_back(counts[axis]);
  return reordered;
}

// A chunk's bytes as stored. `order`: its axis i is the array's axis order[i].
std::string ChunkBytes(const ZarrSpec& spec, const Counts& index, const std::vector<std::size_t>& order, const ElementAt& element) {
  constexpr double kBeyond = 77;
  std::vector<double> values;
  ForEachIndex(Reordered(spec.chunk, order), [&](const Counts& at) {
    Counts place(order.size());
    bool inside = true;
    for (std::size_t i = 0; i < order.size(); ++i) {
      const std::size_t axis = order[i];
      place[axis] = index[axis] * spec.chunk[axis] + at[i];
      inside = inside && place[axis] < spec.shape[axis];
    }
    values.push_back(inside ? element(place) : kBeyond);
  });
  std::string bytes = EncodeSamples(spec.type, values, spec.big_endian);
  if (spec.shuffled) bytes = ShuffledBytes(bytes, BytesPerSample(spec.type));
  bytes = PackBytes(spec.codec, bytes, BytesPerSample(spec.type));
  return spec.checked ? PackBytes("crc32c", bytes) : bytes;
}

std::string KeyOf(const ZarrSpec& spec, const Counts& index) {
  std::string key = spec.version == 3 && !spec.old_keys ? std::string("c") + spec.separator : "";
  for (std::size_t axis = 0; axis < index.size(); ++axis)
    key += (axis > 0 ? std::string(1, spec.separator) : "") + std::to_string(index[axis]);
  return key;
}

Counts ChunkCounts(const Counts& shape, const Counts& chunk) {
  Counts counts;
  for (std::size_t axis = 0; axis < shape.size(); ++axis) counts.push_back((shape[axis] + chunk[axis] - 1) / chunk[axis]);
  return counts;
}

void PutNumber(std::string& bytes, std::uint64_t number, bool big_endian) {
  std::string text(sizeof number, '\0');
  std::memcpy(text.data(), &number, sizeof number);
  bytes += big_endian ? SwappedBytes(text, sizeof number) : text;
}

// The chunks of a shard one behind the other, and their index. Nothing if none of them is there.
std::string ShardBytes(const ZarrSpec& spec, const Counts& shard, const ElementAt& element, const IsMissing& missing) {
  const std::size_t axes = spec.shape.size();
  const std::vector<std::size_t> outer = OrderOrSame(spec.transpose, axes), inner = OrderOrSame(spec.inner_transpose, axes);
  std::vector<std::size_t> order;
  for (const std::size_t axis : inner) order.push_back(outer[axis]);
  const Counts per_shard = ChunkCounts(spec.shard, spec.chunk), all = ChunkCounts(spec.shape, spec.chunk);
  std::uint64_t count = 1;
  for (const std::uint64_t along : per_shard) count *= along;
  const std::uint64_t index_bytes = 16 * count + (spec.index_checked ? 4 : 0);
  std::string chunks, index;
  bool any = false;
  ForEachIndex(Reordered(per_shard, outer), [&](const Counts& at) {
    Counts chunk(axes);
    bool there = true;
    for (std::size_t i = 0; i < axes; ++i) chunk[outer[i]] = shard[outer[i]] * per_shard[outer[i]] + at[i];
    for (std::size_t axis = 0; axis < axes; ++axis) there = there && chunk[axis] < all[axis];
    const std::string bytes = there && !(missing && missing(chunk)) ? ChunkBytes(spec, chunk, order, element) : "";
    any = any || !bytes.empty();
    constexpr std::uint64_t kNone = std::numeric_limits<std::uint64_t>::max();
    PutNumber(index, bytes.empty() ? kNone : (spec.index_at_end ? 0 : index_bytes) + chunks.size(), spec.index_big_endian);
    PutNumber(index, bytes.empty() ? kNone : bytes.size(), spec.index_big_endian);
    chunks += bytes;
  });
  if (!any) return "";
  if (spec.index_checked) index = PackBytes("crc32c", index);
  return spec.index_at_end ? chunks + index : index + chunks;
}

}  // namespace

Json MetadataOf(const ZarrSpec& spec) {
  if (spec.version == 2) {
    const Json compressor = spec.codec.empty() ? Json() : Json{{"id", spec.codec}};
    const Json filters = spec.shuffled ? Json::array({{{"id", "shuffle"}, {"elementsize", BytesPerSample(spec.type)}}}) : Json();
    return {{"zarr_format", 2},
            {"shape", spec.shape},
            {"chunks", spec.chunk},
            {"dtype", DtypeOf(spec.type, spec.big_endian)},
            {"compressor", compressor},
            {"filters", filters},
            {"fill_value", spec.fill},
            {"order", spec.fortran ? "F" : "C"},
            {"dimension_separator", std::string(1, spec.separator)}};
  }
  Json codecs = ChunkCodecs(spec, spec.shard.empty() ? spec.transpose : spec.inner_transpose);
  if (!spec.shard.empty()) {
    Json index_codecs = Json::array({BytesCodec(spec.index_big_endian)});
    if (spec.index_checked) index_codecs.push_back({{"name", "crc32c"}});
    const Counts chunk = Reordered(spec.chunk, OrderOrSame(spec.transpose, spec.shape.size()));
    const Json sharding = {{"chunk_shape", chunk},
                           {"codecs", codecs},
                           {"index_codecs", index_codecs},
                           {"index_location", spec.index_at_end ? "end" : "start"}};
    codecs = Json::array();
    if (!spec.transpose.empty()) codecs.push_back(TransposeCodec(spec.transpose));
    codecs.push_back({{"name", "sharding_indexed"}, {"configuration", sharding}});
  }
  Json metadata = {
      {"zarr_format", 3},
      {"node_type", "array"},
      {"shape", spec.shape},
      {"data_type", ToString(spec.type)},
      {"chunk_grid", {{"name", "regular"}, {"configuration", {{"chunk_shape", spec.shard.empty() ? spec.chunk : spec.shard}}}}},
      {"chunk_key_encoding",
       {{"name", spec.old_keys ? "v2" : "default"}, {"configuration", {{"separator", std::string(1, spec.separator)}}}}},
      {"fill_value", spec.fill},
      {"codecs", codecs},
      {"attributes", Json::object()}};
  if (!spec.names.is_null()) metadata["dimension_names"] = spec.names;
  return metadata;
}

void ForEachIndex(const Counts& counts, const std::function<void(const Counts&)>& function) {
  Counts index(counts.size(), 0);
  while (true) {
    function(index);
    std::size_t axis = counts.size();
    while (axis > 0 && ++index[axis - 1] == counts[axis - 1]) index[--axis] = 0;
    if (axis == 0) return;
  }
}

void WriteJson(const std::string& path, const Json& json) { WriteFile(path, json.dump()); }

void WriteZarrGroup(const std::string& folder, int version, const Json& attributes) {
  if (version == 3) {
    Json group = {{"zarr_format", 3}, {"node_type", "group"}};
    if (!attributes.is_null()) group["attributes"] = attributes;
    return WriteJson(folder + "/zarr.json", group);
  }
  WriteJson(folder + "/.zgroup", {{"zarr_format", 2}});
  if (!attributes.is_null()) WriteJson(folder + "/.zattrs", attributes);
}

void WriteZarrArray(const std::string& folder, const ZarrSpec& spec, const ElementAt& element, const IsMissing& missing) {
  WriteJson(folder + (spec.version == 2 ? "/.zarray" : "/zarr.json"), MetadataOf(spec));
  const std::size_t axes = spec.shape.size();
  std::vector<std::size_t> order = OrderOrSame(spec.transpose, axes);
  if (spec.fortran) std::reverse(order.begin(), order.end());
  ForEachIndex(ChunkCounts(spec.shape, spec.shard.empty() ? spec.chunk : spec.shard), [&](const Counts& index) {
    std::string bytes;
    if (!spec.shard.empty()) {
      bytes = ShardBytes(spec, index, element, missing);
    } else if (!missing || !missing(index)) {
      bytes = ChunkBytes(spec, index, order, element);
    }
    if (!bytes.empty()) WriteFile(folder + "/" + KeyOf(spec, index), bytes);
  });
}

bool NamesChunk(const std::string& key) {
  const std::string name = key.substr(key.rfind('/') + 1);
  return !name.empty() && name.find_first_not_of("0123456789.") == std::string::npos;
}

}  // namespace slabstream
