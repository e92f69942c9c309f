#include "data/zarr/zarr_codecs.h"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <numeric>
#include <utility>

#include "common/base/find_named.h"
#include "data/zarr/element_filters.h"

namespace slabstream::zarr {
namespace {

using metadata::Field;

struct NamedCodec {
  std::string_view name;
  SharedCodec (*make)();
};

// From bytes to bytes, by their names in numcodecs, which version 2 uses; version 3 may have "numcodecs." before them.
constexpr std::array<NamedCodec, 6> kByteCodecs = {
    {{"zlib", ZlibCodec}, {"gzip", GzipCodec}, {"zstd", ZstdCodec}, {"blosc", BloscCodec}, {"lz4", Lz4Codec}, {"bz2", Bzip2Codec}}};
struct NamedChecksum {
  std::string_view name;
  Checksum checksum;
  bool in_front;  // unless `location` says something else
};
constexpr std::array<NamedChecksum, 3> kChecksums = {
    {{"crc32c", Checksum::kCrc32c, false}, {"crc32", Checksum::kCrc32, true}, {"adler32", Checksum::kAdler32, true}}};

Result<SharedCodec> ReadShuffle(const Field& settings) {
  const Field element = settings["elementsize"];
  constexpr std::uint64_t kUsual = 4, kMost = 255;
  const Result<std::uint64_t> bytes = element.stated() ? element.Whole(1, kMost) : kUsual;
  if (!bytes.ok()) return bytes.status();
  return ShuffleCodec(*bytes);
}

// `name_field`: for messages. `settings`: of the codec.
Result<SharedCodec> ReadByteCodec(const Field& name_field, std::string_view name, const Field& settings) {
  if (name == "shuffle") return ReadShuffle(settings);
  if (const NamedChecksum* const sum = FindNamed(kChecksums, name)) {
    const Field location = settings["location"];
    return ChecksumCodec(sum->checksum, location.is_text() ? location.value() == "start" : sum->in_front);
  }
  if (const NamedCodec* const named = FindNamed(kByteCodecs, name)) return named->make();
  return name_field.Wrong(fmt::format("one of {}, {}, shuffle here", NamesOf(kByteCodecs), NamesOf(kChecksums)));
}

// A codec of version 3 without the prefix of those that numcodecs adds.
std::string_view WithoutPrefix(std::string_view name) {
  constexpr std::string_view kNumcodecs = "numcodecs.";
  return name.starts_with(kNumcodecs) ? name.substr(kNumcodecs.size()) : name;
}

// A codec by itself may be its name alone.
Result<std::string> CodecName(const Field& codec) { return codec.is_text() ? codec.Text() : codec["name"].Text(); }
Status WrongName(const Field& codec, std::string_view must_be) { return (codec.is_text() ? codec : codec["name"]).Wrong(must_be); }

Result<std::vector<std::size_t>> ReadOrder(const Field& order, std::size_t axes) {
  std::vector<std::size_t> read;
  std::vector<bool> taken(axes, false);
  for (std::size_t i = 0; i < axes && order.size() == axes; ++i) {
    const Result<std::uint64_t> axis = order[i].Whole(0, axes - 1);
    if (!axis.ok()) return axis.status();
    if (!taken[*axis]) read.push_back(*axis);
    taken[*axis] = true;
  }
  if (!order.is_array() || read.size() != axes) return order.Wrong(fmt::format("an order of the axes 0 to {}", axes - 1));
  return read;
}

Result<bool> ReadBigEndian(const Field& endian, SampleType type) {
  if (!endian.stated() && BytesPerSample(type) == 1) return false;
  if (!endian.is_text() || (endian.value() != "little" && endian.value() != "big")) return endian.Wrong("\"little\" or \"big\"");
  return endian.value() == "big";
}

}  // namespace

Result<CodecChain> ReadFilters(const Field& filters, const Field& compressor, SampleType type) {
  constexpr std::size_t kMostFilters = 16;
  if (filters.given() && (!filters.is_array() || filters.size() > kMostFilters))
    return filters.Wrong("a list of at most 16 filters, or null");
  CodecChain chain;
  const auto read = [&](const Field& codec) -> Status {
    const Result<std::string> id = codec["id"].Text();
    if (!id.ok()) return id.status();
    if (IsElementFilter(*id)) {
      const Result<ElementFilter> filter = ReadElementFilter(*id, codec, type, true);
      if (!filter.ok()) return filter.status();
      chain.insert(chain.end(), filter->chain.begin(), filter->chain.end());
      type = filter->stored;
      return Status::Ok();
    }
    Result<SharedCodec> byte_codec = ReadByteCodec(codec["id"], *id, codec);
    if (byte_codec.ok()) chain.push_back(*std::move(byte_codec));
    return byte_codec.status();
  };
  for (std::size_t i = 0; i < filters.size(); ++i) {
    if (Status status = read(filters[i]); !status.ok()) return status;
  }
  if (compressor.given()) {
    if (Status status = read(compressor); !status.ok()) return status;
  }
  return chain;
}

Result<CodecList> ReadCodecList(const Field& codecs, std::size_t axes, SampleType type) {
  CodecList list;
  list.order.resize(axes);
  std::iota(list.order.begin(), list.order.end(), 0);
  constexpr std::size_t kMostCodecs = 16;
  if (!codecs.is_array() || codecs.size() < 1 || codecs.size() > kMostCodecs) {
    return codecs.Wrong(fmt::format("a list of 1 to {} codecs", kMostCodecs));
  }
  bool in_bytes = false;  // the elements have become bytes
  for (std::size_t i = 0; i < codecs.size(); ++i) {
    const Field codec = codecs[i], configuration = codec["configuration"];
    const Result<std::string> name = CodecName(codec);
    if (!name.ok()) return name.status();
    if (list.sharding) return WrongName(codec, "left out: codecs behind sharding_indexed are not supported");
    if (in_bytes) {
      Result<SharedCodec> byte_codec = ReadByteCodec(codec.is_text() ? codec : codec["name"], WithoutPrefix(*name), configuration);
      if (!byte_codec.ok()) return byte_codec.status();
      list.chain.push_back(*std::move(byte_codec));
    } else if (IsElementFilter(WithoutPrefix(*name))) {
      const Result<ElementFilter> filter = ReadElementFilter(WithoutPrefix(*name), configuration, type, false);
      if (!filter.ok()) return filter.status();
      list.chain.insert(list.chain.end(), filter->chain.begin(), filter->chain.end());
      type = filter->stored;
    } else if (!list.chain.empty() && *name != "bytes") {
      return WrongName(codec, "bytes, which comes next");
    } else if (*name == "transpose") {
      const Result<std::vector<std::size_t>> order = ReadOrder(configuration["order"], axes);
      if (!order.ok()) return order.status();
      std::vector<std::size_t> both;
      for (const std::size_t axis : *order) both.push_back(list.order[axis]);
      list.order = std::move(both);
    } else if (*name == "bytes" || *name == "endian") {  // its name before Zarr 3.0 was finished
      const Result<bool> big = ReadBigEndian(configuration["endian"], type);
      if (!big.ok()) return big.status();
      if (*big != (std::endian::native == std::endian::big) && BytesPerSample(type) > 1) {
        list.chain.push_back(SwapBytesCodec(BytesPerSample(type)));
      }
      in_bytes = true;
    } else if (*name == "sharding_indexed") {
      if (!configuration.is_object()) return configuration.Wrong("an object");
      list.sharding = configuration;
      in_bytes = true;
    } else {
      return WrongName(codec, "one of transpose, bytes, sharding_indexed or a filter of numcodecs here");
    }
  }
  if (!in_bytes) return codecs.Wrong("a list with bytes or sharding_indexed");
  return list;
}

}  // namespace slabstream::zarr
