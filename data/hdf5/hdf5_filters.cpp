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
constexpr int kLzf = 32000, kBlosc = 32001, kLz4 = 32004, kBitShuffle = 32008, kZfp = 32013, kZstd = 32015, kBlosc2 = 32026;

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
  switch (id) {
    case H5Z_FILTER_SZIP: return "szip";
    case H5Z_FILTER_NBIT: return "nbit";
    case H5Z_FILTER_SCALEOFFSET: return "scaleoffset";
    case kLz4: return "lz4";
    case kBitShuffle: return "bitshuffle";
    case kZfp: return "zfp";
    case kBlosc2: return "blosc2";
    default: return "";
  }
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
      default: break;
    }
    const std::string name(filter.name.empty() ? KnownName(filter.id) : filter.name);
    return Status::InvalidArgument(
        fmt::format("{} is packed by the filter {}{}, which is not supported; supported: deflate, shuffle, fletcher32, lzf, blosc and zstd",
                    named, filter.id, name.empty() ? "" : " (" + name + ")"));
  }
  return chain;
}

}  // namespace slabstream
