#include "data/hdf5/hdf5_filters.h"

#include <fmt/format.h>
#include <hdf5.h>

#include <algorithm>
#include <memory>
#include <utility>

#include "data/codecs/codecs.h"
#include "data/codecs/decoded_bytes.h"

namespace slabstream {
namespace {

// Numbers of registered filters: https://github.com/HDFGroup/hdf5_plugins/blob/master/docs/RegisteredFilterPlugins.md
constexpr int kBzip2 = 307, kLzf = 32000, kBlosc = 32001, kLz4 = 32004, kBitshuffle = 32008, kZstd = 32015, kBitGroom = 32022,
              kBitRound = 32023;
struct FilterName {
  int id;
  std::string_view name;
};
constexpr FilterName kNotSupported[] = {{H5Z_FILTER_SZIP, "szip"},
                                        {H5Z_FILTER_NBIT, "nbit"},
                                        {H5Z_FILTER_SCALEOFFSET, "scaleoffset"},
                                        {32003, "snappy"},
                                        {32007, "JPEG XR"},
                                        {32012, "JPEG-LS"},
                                        {32013, "zfp"},
                                        {32014, "fpzip"},
                                        {32016, "B3D"},
                                        {32017, "SZ"},
                                        {32018, "FCIDECOMP"},
                                        {32019, "JPEG"},
                                        {32024, "SZ3"},
                                        {32026, "blosc2"},
                                        {32028, "SPERR"},
                                        {32030, "FFMPEG"}};

// Four bytes behind the others: Fletcher's checksum of their 16-bit words, big endian ones, as HDF5 computes it.
class Fletcher32 : public ChunkCodec {
 public:
  Result<Bytes> Decode(Bytes packed, std::uint64_t most) const override {
    Result<SummedBytes> summed = TakeSum("fletcher32", std::move(packed), most);
    if (!summed.ok()) return summed.status();
    const std::uint32_t sum = SumOf(summed->bytes.span());
    // HDF5 before 1.6.3 wrote the bytes of each half in the other order.
    const std::uint32_t reversed = ((sum & 0x00ff00ff) << 8) | ((sum & 0xff00ff00) >> 8);
    if (summed->sum == sum || summed->sum == reversed) return std::move(summed->bytes);
    return Status::DataLoss(fmt::format("damaged: its checksum is {:08x}, stored is {:08x}", sum, summed->sum));
  }

 private:
  static std::uint32_t SumOf(std::span<const std::byte> bytes) {
    constexpr std::size_t kWithoutOverflow = 360;  // words
    std::uint32_t a = 0, b = 0;
    const auto fold = [](std::uint32_t sum) { return (sum & 0xffff) + (sum >> 16); };
    while (!bytes.empty()) {
      const std::size_t count = std::min(bytes.size(), 2 * kWithoutOverflow);
      for (std::size_t i = 0; i < count; i += 2) {
        a += std::to_integer<std::uint32_t>(bytes[i]) << 8;
        if (i + 1 < count) a += std::to_integer<std::uint32_t>(bytes[i + 1]);
        b += a;
      }
      a = fold(a);
      b = fold(b);
      bytes = bytes.subspan(count);
    }
    return fold(b) << 16 | fold(a);
  }
};

std::string_view KnownName(int id) {
  const auto* const known = std::ranges::find(kNotSupported, id, &FilterName::id);
  return known == std::end(kNotSupported) ? "" : known->name;
}

// Its parameters: two numbers of its version, bytes of an element, elements of a block (0: as many as it takes by itself), and how blocks
// are packed. nullptr: one of them is not known.
SharedCodec BitshuffleFilter(const std::vector<unsigned>& values, std::size_t element_bytes) {
  constexpr unsigned kPlain = 0, kByLz4 = 2, kByZstd = 3, kMostElements = 1U << 26;
  const auto value = [&](std::size_t number) { return number < values.size() ? values[number] : 0; };
  if (value(2) != 0) element_bytes = value(2);
  const unsigned packing = value(4);
  if (packing == kByLz4) return BlocksCodec({Lz4BlockCodec(), true, element_bytes});
  if (packing == kByZstd) return BlocksCodec({ZstdCodec(), true, element_bytes});
  const std::size_t by_itself = std::max<std::size_t>(8192 / element_bytes / 8 * 8, 128);
  const std::size_t block = value(3) == 0 ? by_itself : value(3);
  return packing != kPlain || block % 8 != 0 || block > kMostElements ? nullptr : BitshuffleCodec(element_bytes, block);
}

}  // namespace

Result<CodecChain> CodecsOf(const std::vector<Hdf5Filter>& filters, std::size_t element_bytes, const std::string& named) {
  CodecChain chain;
  for (const Hdf5Filter& filter : filters) {
    switch (filter.id) {
      case H5Z_FILTER_DEFLATE: chain.push_back(ZlibCodec()); continue;
      case H5Z_FILTER_SHUFFLE:
        chain.push_back(ShuffleCodec(filter.values.empty() || filter.values[0] == 0 ? element_bytes : filter.values[0]));
        continue;
      case H5Z_FILTER_FLETCHER32: chain.push_back(std::make_shared<Fletcher32>()); continue;
      case kLzf: chain.push_back(LzfCodec()); continue;
      case kBlosc: chain.push_back(BloscCodec()); continue;
      case kZstd: chain.push_back(ZstdCodec()); continue;
      case kBzip2: chain.push_back(Bzip2Codec()); continue;
      case kLz4: chain.push_back(BlocksCodec({Lz4BlockCodec()})); continue;
      case kBitshuffle:
        chain.push_back(BitshuffleFilter(filter.values, element_bytes));
        if (chain.back() == nullptr) {
          return Status::InvalidArgument(
              fmt::format("{} is packed by bitshuffle with the parameters {}, which are not known", named, fmt::join(filter.values, ", ")));
        }
        continue;
      case kBitGroom:
      case kBitRound: chain.push_back(ShuffleCodec(1)); continue;  // they rounded samples, and there is nothing to undo
      default: break;
    }
    const std::string name(filter.name.empty() ? KnownName(filter.id) : filter.name);
    return Status::InvalidArgument(
        fmt::format("{} is packed by the filter {}{}, which is not supported; supported: deflate, shuffle, fletcher32, lzf, lz4, bzip2, "
                    "blosc, zstd and bitshuffle",
                    named, filter.id, name.empty() ? "" : " (" + name + ")"));
  }
  return chain;
}

}  // namespace slabstream
