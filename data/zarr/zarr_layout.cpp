#include "data/zarr/zarr_layout.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

#include "data/zarr/element_type.h"
#include "data/zarr/zarr_codecs.h"

namespace slabstream::zarr {
namespace {

using metadata::Field;

template <class T>
std::vector<T> Reordered(const std::vector<T>& of_axes, const std::vector<std::size_t>& from) {
  std::vector<T> reordered;
  for (const std::size_t axis : from) reordered.push_back(of_axes[axis]);
  return reordered;
}

Status CheckChunkBytes(const Field& field, const std::vector<std::uint64_t>& chunk, SampleType type) {
  std::uint64_t bytes = BytesPerSample(type);
  for (const std::uint64_t along : chunk) {
    if (along > kMostChunkBytes / bytes) return field.Wrong(fmt::format("smaller: a chunk has at most {} bytes", kMostChunkBytes));
    bytes *= along;
  }
  return Status::Ok();
}

Result<char> ReadSeparator(const Field& separator, char usual) {
  if (!separator.given()) return usual;
  if (!separator.is_text() || (separator.value() != "." && separator.value() != "/")) return separator.Wrong("\".\" or \"/\"");
  return separator.value().text()[0];
}

Status ReadKeys(const Field& encoding, ZarrLayout& layout) {
  const Field name = encoding["name"];
  const bool with_prefix = name.is_text() && name.value() == "default";
  if (!with_prefix && !(name.is_text() && name.value() == "v2")) return name.Wrong("\"default\" or \"v2\"");
  const Result<char> separator = ReadSeparator(encoding["configuration"]["separator"], with_prefix ? '/' : '.');
  if (!separator.ok()) return separator.status();
  layout.key_separator = *separator;
  if (with_prefix) layout.key_prefix = std::string("c") + *separator;
  return Status::Ok();
}

Status ReadNames(const Field& names, ZarrLayout& layout) {
  if (!names.given()) return Status::Ok();
  if (!names.is_array() || names.size() != layout.from.size()) return names.Wrong(fmt::format("a list of {} names", layout.from.size()));
  for (const std::size_t axis : layout.from) {
    const Field name = names[axis];
    if (name.given() && !name.is_text()) return name.Wrong("a text or null");
    layout.dimension_names.push_back(name.given() ? *name.Text() : "");
  }
  return Status::Ok();
}

// The chunks of a shard. `order` and `shape`: of the axes as they are when sharding_indexed gets them.
Status ReadSharding(const Field& configuration, const Field& shard_field, const std::vector<std::uint64_t>& shard, SampleType type,
                    const std::vector<std::size_t>& order, ZarrLayout& layout) {
  const std::size_t axes = shard.size();
  const Field chunk_field = configuration["chunk_shape"];
  const Result<std::vector<std::uint64_t>> chunk = chunk_field.Counts(axes);
  if (!chunk.ok()) return chunk.status();
  if (Status status = CheckChunkBytes(chunk_field, *chunk, type); !status.ok()) return status;
  std::vector<std::uint64_t> chunks(axes), strides(axes);
  std::uint64_t count = 1;
  for (std::size_t i = axes; i-- > 0;) {
    if (shard[i] % (*chunk)[i] != 0) return chunk_field[i].Wrong(fmt::format("a divisor of {}, the side of a shard", shard[i]));
    chunks[i] = shard[i] / (*chunk)[i];
    strides[i] = count;
    if (chunks[i] > kMostShardChunks / count)
      return shard_field.Wrong(fmt::format("smaller: a shard has at most {} chunks", kMostShardChunks));
    count *= chunks[i];
  }

  const Field codecs_field = configuration["codecs"], index_codecs_field = configuration["index_codecs"];
  Result<CodecList> codecs = ReadCodecList(codecs_field, axes, type);
  if (!codecs.ok()) return codecs.status();
  if (codecs->sharding) return codecs_field.Wrong("codecs without sharding_indexed: shards in shards are not supported");
  // The index is an array of pairs of numbers of 64 bits, of a size that is known before it is read.
  Result<CodecList> index_codecs = ReadCodecList(index_codecs_field, axes + 1, SampleType::kUint64);
  if (!index_codecs.ok()) return index_codecs.status();
  std::uint64_t index_bytes = 2 * sizeof(std::uint64_t) * count;
  for (std::size_t i = 1; i < index_codecs_field.size(); ++i) {
    const Field codec = index_codecs_field[i];
    const Field name = codec.is_text() ? codec : codec["name"];
    if (name.value() != "crc32c") return name.Wrong("crc32c in an index");
    constexpr std::uint64_t kSumBytes = 4;
    index_bytes += kSumBytes;
  }
  if (index_codecs->sharding || !std::ranges::is_sorted(index_codecs->order))
    return index_codecs_field.Wrong("bytes, and crc32c if need be");
  const Field location = configuration["index_location"];
  if (location.stated() && !(location.is_text() && (location.value() == "start" || location.value() == "end"))) {
    return location.Wrong("\"start\" or \"end\"");
  }

  layout.shape.chunk = Reordered(*chunk, codecs->order);
  layout.codecs = std::move(codecs->chain);
  layout.from = Reordered(order, codecs->order);
  layout.sharding = Sharding{.chunks = Reordered(chunks, codecs->order),
                             .strides = Reordered(strides, codecs->order),
                             .index_codecs = std::move(index_codecs->chain),
                             .index_bytes = index_bytes,
                             .index_at_end = !location.stated() || location.value() == "end"};
  return Status::Ok();
}

// What a reader does not know it may only pass over if the writer says so.
Status CheckNothingElse(const Field& metadata) {
  constexpr std::array<std::string_view, 11> kKnown = {"zarr_format",         "node_type",  "shape",  "data_type",  "chunk_grid",
                                                       "chunk_key_encoding",  "fill_value", "codecs", "attributes", "dimension_names",
                                                       "storage_transformers"};
  for (const auto& [name, value] : metadata.value().items()) {
    if (std::ranges::find(kKnown, name) != kKnown.end()) continue;
    const Field must = metadata[name]["must_understand"];
    if (!must.given() || !must.value().is_boolean() || must.value().get<bool>()) {
      return metadata[name].Wrong("left out: this extension is not supported");
    }
  }
  if (const Field transformers = metadata["storage_transformers"]; transformers.size() > 0) return transformers.Wrong("empty");
  return Status::Ok();
}

}  // namespace

std::string ZarrLayout::Key(std::span<const std::uint64_t> index, char separator) const {
  std::array<std::uint64_t, kMaxArrayAxes> of_axes{};
  for (std::size_t i = 0; i < from.size(); ++i) of_axes.at(from[i]) = index[i];
  std::string key = key_prefix;
  for (std::size_t axis = 0; axis < from.size(); ++axis) {
    if (axis > 0) key += separator;
    key += std::to_string(of_axes.at(axis));
  }
  return key;
}

Result<ZarrLayout> ParseLayout2(const Field& metadata) {
  if (!metadata.is_object()) return metadata.Wrong("an object");
  if (const Result<std::uint64_t> version = metadata["zarr_format"].Whole(2, 2); !version.ok()) return version.status();
  Result<std::vector<std::uint64_t>> size = metadata["shape"].Counts(0);
  if (!size.ok()) return size.status();
  Result<std::vector<std::uint64_t>> chunk = metadata["chunks"].Counts(size->size());
  if (!chunk.ok()) return chunk.status();
  const Result<ElementType> type = ReadDtype(metadata["dtype"]);
  if (!type.ok()) return type.status();
  if (Status status = CheckChunkBytes(metadata["chunks"], *chunk, type->type); !status.ok()) return status;
  Result<std::vector<std::byte>> fill = ReadFill(metadata["fill_value"], type->type);
  if (!fill.ok()) return fill.status();

  ZarrLayout layout;
  layout.from.resize(size->size());
  std::iota(layout.from.begin(), layout.from.end(), 0);
  const Field order = metadata["order"];
  if (!order.is_text() || (order.value() != "C" && order.value() != "F")) return order.Wrong("\"C\" or \"F\"");
  if (order.value() == "F") std::ranges::reverse(layout.from);
  layout.shape = {
      .size = Reordered(*size, layout.from), .chunk = Reordered(*chunk, layout.from), .type = type->type, .fill = *std::move(fill)};
  const Result<char> separator = ReadSeparator(metadata["dimension_separator"], '.');
  if (!separator.ok()) return separator.status();
  layout.key_separator = *separator;
  layout.separator_stated = metadata["dimension_separator"].given() || layout.from.size() == 1;

  if (type->swapped) layout.codecs.push_back(SwapBytesCodec(BytesPerSample(type->type)));
  const Result<CodecChain> filters = ReadFilters(metadata["filters"], metadata["compressor"], type->type);
  if (!filters.ok()) return filters.status();
  layout.codecs.insert(layout.codecs.end(), filters->begin(), filters->end());
  return layout;
}

Result<ZarrLayout> ParseLayout3(const Field& metadata) {
  if (!metadata.is_object()) return metadata.Wrong("an object");
  if (const Result<std::uint64_t> version = metadata["zarr_format"].Whole(3, 3); !version.ok()) return version.status();
  if (Status status = CheckNothingElse(metadata); !status.ok()) return status;
  const Result<std::vector<std::uint64_t>> size = metadata["shape"].Counts(0);
  if (!size.ok()) return size.status();
  const Result<SampleType> type = ReadDataType(metadata["data_type"]);
  if (!type.ok()) return type.status();
  const Field grid = metadata["chunk_grid"], chunk_field = grid["configuration"]["chunk_shape"];
  if (!grid["name"].is_text() || grid["name"].value() != "regular") return grid["name"].Wrong("\"regular\"");
  const Result<std::vector<std::uint64_t>> chunk = chunk_field.Counts(size->size());
  if (!chunk.ok()) return chunk.status();
  if (!metadata["fill_value"].stated()) return metadata["fill_value"].Wrong("a value of data_type");
  Result<std::vector<std::byte>> fill = ReadFill(metadata["fill_value"], *type);
  if (!fill.ok()) return fill.status();

  ZarrLayout layout;
  layout.shape.type = *type;
  layout.shape.fill = *std::move(fill);
  if (Status status = ReadKeys(metadata["chunk_key_encoding"], layout); !status.ok()) return status;
  Result<CodecList> codecs = ReadCodecList(metadata["codecs"], size->size(), *type);
  if (!codecs.ok()) return codecs.status();
  if (codecs->sharding) {
    const Status status = ReadSharding(*codecs->sharding, chunk_field, Reordered(*chunk, codecs->order), *type, codecs->order, layout);
    if (!status.ok()) return status;
  } else {
    if (Status status = CheckChunkBytes(chunk_field, *chunk, *type); !status.ok()) return status;
    layout.from = std::move(codecs->order);
    layout.shape.chunk = Reordered(*chunk, layout.from);
    layout.codecs = std::move(codecs->chain);
  }
  layout.shape.size = Reordered(*size, layout.from);
  if (Status status = ReadNames(metadata["dimension_names"], layout); !status.ok()) return status;
  return layout;
}

}  // namespace slabstream::zarr
