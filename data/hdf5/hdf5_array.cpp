#include "data/hdf5/hdf5_array.h"

#include <fmt/format.h>
#include <hdf5.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "common/base/check.h"
#include "data/codecs/codecs.h"
#include "data/codecs/decoded_bytes.h"
#include "data/sources/file_array.h"

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

// Fletcher's checksum of 16-bit words, big endian ones, as HDF5 computes it.
std::uint32_t Fletcher32Of(std::span<const std::byte> bytes) {
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

// The checksum stands in four bytes behind the others.
Result<Bytes> TakeFletcher32(const Bytes& packed, std::uint64_t most) {
  Result<SummedBytes> summed = TakeSum("fletcher32", packed, most);
  if (!summed.ok()) return summed.status();
  const std::uint32_t sum = Fletcher32Of(summed->bytes.span());
  // HDF5 before 1.6.3 wrote the bytes of each half in the other order.
  const std::uint32_t reversed = ((sum & 0x00ff00ff) << 8) | ((sum & 0xff00ff00) >> 8);
  if (summed->sum == sum || summed->sum == reversed) return std::move(summed->bytes);
  return Status::DataLoss(fmt::format("damaged: its checksum is {:08x}, stored is {:08x}", sum, summed->sum));
}

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

// The filters of HDF5 as codecs, one a filter, in their order. InvalidArgument, naming the filter: it is not supported. `named`: the
// beginning of the message.
Result<CodecChain> CodecsOf(const std::vector<Hdf5Filter>& filters, std::size_t element_bytes, const std::string& named) {
  CodecChain chain;
  for (const Hdf5Filter& filter : filters) {
    switch (filter.id) {
      case H5Z_FILTER_DEFLATE: chain.push_back(ZlibCodec()); continue;
      case H5Z_FILTER_SHUFFLE:
        chain.push_back(ShuffleCodec(filter.values.empty() || filter.values[0] == 0 ? element_bytes : filter.values[0]));
        continue;
      case H5Z_FILTER_FLETCHER32: chain.push_back(std::make_shared<ChunkCodec>(TakeFletcher32)); continue;
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

// The codecs of one chunk, of those of all: the byte order, if it is the other one, and a codec for each filter. Filters may have been left
// out.
CodecChain Applied(const Hdf5Dataset& dataset, const CodecChain& codecs, std::span<const std::uint64_t> index, std::uint32_t left_out) {
  bool cut = false;
  for (std::size_t axis = 0; axis < index.size(); ++axis) cut = cut || (index[axis] + 1) * dataset.chunk()[axis] > dataset.size()[axis];
  if (cut && !dataset.filters_cut_chunks()) left_out = ~std::uint32_t{0};
  const std::size_t before = codecs.size() - dataset.filters().size();
  CodecChain applied(codecs.begin(), codecs.begin() + std::ptrdiff_t(before));
  for (std::size_t i = before; i < codecs.size(); ++i) {
    if ((left_out >> (i - before) & 1) == 0) applied.push_back(codecs[i]);
  }
  return applied;
}

}  // namespace

Result<std::shared_ptr<ChunkedArray>> MakeHdf5Array(std::shared_ptr<Hdf5Dataset> dataset, const SourceContext& context,
                                                    std::optional<SampleType> as, std::vector<std::uint64_t> size) {
  const std::string named = dataset->named();
  const std::size_t element_bytes = BytesPerSample(dataset->type());
  CHECK(!as || BytesPerSample(*as) == element_bytes);
  if (size.empty()) size = dataset->size();
  if (size.size() != dataset->size().size()) {
    return Status::InvalidArgument(fmt::format("{} has {} axes, must have {}", named, dataset->size().size(), size.size()));
  }
  for (std::size_t axis = 0; axis < size.size(); ++axis) {
    if (size[axis] >= 1 && size[axis] <= dataset->size()[axis]) continue;
    return Status::InvalidArgument(fmt::format("{} has {} samples along axis {}, of which {} are said to be its image", named,
                                               dataset->size()[axis], axis, size[axis]));
  }
  ArrayShape shape{.size = std::move(size), .type = as.value_or(dataset->type()), .fill = dataset->fill()};
  if (dataset->layout() == Hdf5Dataset::Layout::kCompact) {
    Result<Bytes> samples = dataset->ReadCompact();
    if (!samples.ok()) return samples.status();
    shape.chunk = dataset->size();
    return MakeHeldArray(std::move(shape), *std::move(samples));
  }
  if (dataset->layout() == Hdf5Dataset::Layout::kContiguous) {
    if (shape.size != dataset->size()) return Status::InvalidArgument(named + " is larger than its image, but has no chunks");
    return MakePlainArray(dataset->file(), named, std::move(shape), {.begin = dataset->begin(), .big_endian = dataset->big_endian()},
                          context);
  }
  shape.chunk = dataset->chunk();
  CodecChain codecs;
  if (dataset->big_endian() && element_bytes > 1) codecs.push_back(SwapBytesCodec(element_bytes));
  const Result<CodecChain> filters = CodecsOf(dataset->filters(), element_bytes, named);
  if (!filters.ok()) return filters.status();
  codecs.insert(codecs.end(), filters->begin(), filters->end());
  const std::string path = dataset->file();
  const auto find = [dataset = std::move(dataset), codecs, named,
                     bytes = shape.chunk_bytes()](std::span<const std::uint64_t> index) -> Result<std::optional<FilePiece>> {
    const Result<std::optional<Hdf5StoredChunk>> chunk = dataset->Find(index);
    if (!chunk.ok()) return chunk.status();
    if (!*chunk) return std::optional<FilePiece>();
    // Filters make what does not shrink a little longer.
    if ((*chunk)->bytes > 2 * bytes + 65536) {
      return Status::DataLoss(fmt::format("{} has a chunk of {} stored bytes, which has {}", named, (*chunk)->bytes, bytes));
    }
    return std::optional(FilePiece{(*chunk)->begin, (*chunk)->bytes, Applied(*dataset, codecs, index, (*chunk)->left_out), bytes});
  };
  return MakeFileArray(path, named, std::move(shape), find, context);
}

Result<std::shared_ptr<ChunkedArray>> Hdf5File::Array(const std::string& dataset, const SourceContext& context,
                                                      std::optional<SampleType> as) {
  Result<std::shared_ptr<Hdf5Dataset>> opened = Dataset(dataset);
  if (!opened.ok()) return opened.status();
  return MakeHdf5Array(*std::move(opened), context, as);
}

}  // namespace slabstream
