#include "data/zarr/zarr_codecs.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <numeric>
#include <utility>

#include "common/base/find_named.h"

namespace slabstream::zarr {
namespace {

using metadata::Field;

struct NamedCodec {
  std::string_view name;
  SharedCodec (*make)();
};

// Those of numcodecs, by which version 2 knows them.
constexpr std::array<NamedCodec, 5> kCompressors = {
    {{"zlib", ZlibCodec}, {"gzip", GzipCodec}, {"zstd", ZstdCodec}, {"blosc", BloscCodec}, {"lz4", Lz4Codec}}};
// Those of version 3 from bytes to bytes.
constexpr std::array<NamedCodec, 4> kByteCodecs = {
    {{"gzip", GzipCodec}, {"zstd", ZstdCodec}, {"blosc", BloscCodec}, {"crc32c", Crc32cCodec}}};
constexpr std::string_view kNumcodecs = "numcodecs.";  // before their names in version 3

Result<SharedCodec> ReadShuffle(const Field& settings) {
  const Field element = settings["elementsize"];
  constexpr std::uint64_t kUsual = 4, kMost = 255;
  const Result<std::uint64_t> bytes = element.stated() ? element.Whole(1, kMost) : kUsual;
  if (!bytes.ok()) return bytes.status();
  return ShuffleCodec(*bytes);
}

// A codec by itself may be its name alone.
Result<std::string> NameOf(const Field& codec) { return codec.is_text() ? codec.Text() : codec["name"].Text(); }
Status WrongName(const Field& codec, std::string_view must_be) { return (codec.is_text() ? codec : codec["name"]).Wrong(must_be); }

Result<SharedCodec> ReadByteCodec(const Field& codec, std::string_view name) {
  const NamedCodec* named = FindNamed(kByteCodecs, name);
  if (named == nullptr && name.starts_with(kNumcodecs)) {
    if (name == "numcodecs.shuffle") return ReadShuffle(codec["configuration"]);
    named = FindNamed(kCompressors, name.substr(kNumcodecs.size()));
  }
  if (named == nullptr) return WrongName(codec, "one of " + NamesOf(kByteCodecs) + " here");
  return named->make();
}

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

Result<SharedCodec> ReadCompressor(const Field& compressor) {
  const Result<std::string> id = compressor["id"].Text();
  if (!id.ok()) return id.status();
  const NamedCodec* const named = FindNamed(kCompressors, *id);
  if (named == nullptr) return compressor["id"].Wrong("one of " + NamesOf(kCompressors));
  return named->make();
}

Result<SharedCodec> ReadFilter(const Field& filter) {
  const Result<std::string> id = filter["id"].Text();
  if (!id.ok()) return id.status();
  if (*id == "shuffle") return ReadShuffle(filter);
  const NamedCodec* const named = FindNamed(kCompressors, *id);
  if (named == nullptr) return filter["id"].Wrong("shuffle, or one of " + NamesOf(kCompressors));
  return named->make();
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
    const Result<std::string> name = NameOf(codec);
    if (!name.ok()) return name.status();
    if (list.sharding) return WrongName(codec, "left out: codecs behind sharding_indexed are not supported");
    if (in_bytes) {
      Result<SharedCodec> byte_codec = ReadByteCodec(codec, *name);
      if (!byte_codec.ok()) return byte_codec.status();
      list.chain.push_back(*std::move(byte_codec));
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
      return WrongName(codec, "one of transpose, bytes, sharding_indexed here");
    }
  }
  if (!in_bytes) return codecs.Wrong("a list with bytes or sharding_indexed");
  return list;
}

}  // namespace slabstream::zarr
