#include "data/hdf5/hdf5_array.h"

#include <fmt/format.h>
#include <hdf5.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <string>
#include <utility>
#include <vector>

#include "common/base/check.h"
#include "common/base/printable.h"
#include "data/codecs/codecs.h"
#include "data/codecs/decoded_bytes.h"
#include "data/sources/decode_chunk.h"
#include "data/stores/store.h"

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

class Hdf5Array : public ChunkedArray, public std::enable_shared_from_this<Hdf5Array> {
 public:
  Hdf5Array(std::shared_ptr<Hdf5Dataset> dataset, SourceContext context, ArrayShape shape, CodecChain codecs)
      : dataset_(std::move(dataset)),
        context_(std::move(context)),
        shape_(std::move(shape)),
        codecs_(std::move(codecs)),
        store_(FileStore(dataset_->file())) {}

  const ArrayShape& shape() const override { return shape_; }

  void ReadChunk(std::span<const std::uint64_t> index, ChunkDone done) override {
    // The library may read parts of its index, so its lock may take a while.
    context_->PostDecode([self = shared_from_this(), at = std::vector(index.begin(), index.end()), done = std::move(done)] {
      try {
        self->Find(at, done);
      } catch (const std::exception& error) {  // before anything else could call it
        done(Status::ResourceExhausted(self->Named() + " cannot be read: " + error.what()));
      }
    });
  }

 private:
  // Bytes of the file, and how they are packed.
  void Read(const Hdf5StoredChunk& stored, CodecChain codecs, std::uint64_t bytes, const std::vector<std::uint64_t>& index,
            ChunkDone done) {
    std::string what = fmt::format("{}: chunk {} of dataset '{}'", dataset_->file(), fmt::join(index, "."), Printable(dataset_->path()));
    const auto decode = [self = shared_from_this(), codecs = std::move(codecs), bytes, wanted = stored.bytes, what = std::move(what),
                         done](Result<Bytes> answer) {
      if (answer.status().code() == StatusCode::kNotFound)
        answer = Status::Unavailable(what + ": the file is gone");  // no chunk is missing
      if (answer.ok() && answer->size() != wanted) answer = Status::DataLoss(what + ": the file ends before it does");
      DecodeOn(self->context_, codecs, std::move(answer), bytes, what, done);
    };
    store_->Read("file", {stored.begin, stored.bytes}, stored.bytes, decode);
  }

  void Find(const std::vector<std::uint64_t>& index, const ChunkDone& done) {
    if (dataset_->layout() == Hdf5Dataset::Layout::kContiguous) {
      if (!dataset_->begin()) return done(std::optional<StoredChunk>());
      const Hdf5StoredChunk slice = Slice(index);
      return Read(slice, codecs_, slice.bytes, index, done);
    }
    const Result<std::optional<Hdf5StoredChunk>> chunk = dataset_->Find(index);
    if (!chunk.ok()) return done(chunk.status());
    if (!*chunk) return done(std::optional<StoredChunk>());
    // Filters make what does not shrink a little longer.
    const std::uint64_t bytes = shape_.chunk_bytes();
    if ((*chunk)->bytes > 2 * bytes + 65536) {
      return done(Status::DataLoss(fmt::format("{} has a chunk of {} stored bytes, which has {}", Named(), (*chunk)->bytes, bytes)));
    }
    Read(**chunk, Applied(index, (*chunk)->left_out), bytes, index, done);
  }

  // Of a dataset in one piece.
  Hdf5StoredChunk Slice(const std::vector<std::uint64_t>& index) const {
    std::uint64_t first = 0, count = 1;
    for (std::size_t axis = 0; axis < index.size(); ++axis) {
      const std::uint64_t begin = index[axis] * shape_.chunk[axis], all = dataset_->size()[axis];
      first = first * all + begin;
      count *= std::min(shape_.chunk[axis], all - begin);
    }
    const std::uint64_t bytes = BytesPerSample(shape_.type);
    return {*dataset_->begin() + first * bytes, count * bytes, 0};
  }

  // The codecs of one chunk: filters may have been left out.
  CodecChain Applied(const std::vector<std::uint64_t>& index, std::uint32_t left_out) const {
    bool cut = false;
    for (std::size_t axis = 0; axis < index.size(); ++axis) cut = cut || (index[axis] + 1) * shape_.chunk[axis] > dataset_->size()[axis];
    if (cut && !dataset_->filters_cut_chunks()) left_out = ~std::uint32_t{0};
    const std::size_t before = codecs_.size() - dataset_->filters().size();  // the byte order
    CodecChain applied(codecs_.begin(), codecs_.begin() + std::ptrdiff_t(before));
    for (std::size_t i = before; i < codecs_.size(); ++i) {
      if ((left_out >> (i - before) & 1) == 0) applied.push_back(codecs_[i]);
    }
    return applied;
  }

  std::string Named() const { return fmt::format("{}: dataset '{}'", dataset_->file(), Printable(dataset_->path())); }

  const std::shared_ptr<Hdf5Dataset> dataset_;
  const SourceContext context_;
  const ArrayShape shape_;
  const CodecChain codecs_;  // the byte order, if it is the other one, and a codec for each filter
  const std::shared_ptr<Store> store_;
};

// All of a compact dataset.
class SmallArray : public ChunkedArray {
 public:
  SmallArray(ArrayShape shape, Bytes samples) : shape_(std::move(shape)), samples_(std::move(samples)) {}
  const ArrayShape& shape() const override { return shape_; }
  void ReadChunk(std::span<const std::uint64_t>, ChunkDone done) override { done(std::optional(StoredChunk{samples_, samples_.size()})); }

 private:
  const ArrayShape shape_;
  const Bytes samples_;
};

// A slice of at most kHdf5SliceBytes that lies in one piece.
std::vector<std::uint64_t> SliceOf(const std::vector<std::uint64_t>& size, std::uint64_t element_bytes) {
  std::vector<std::uint64_t> slice(size.size(), 1);
  std::uint64_t most = kHdf5SliceBytes / element_bytes;  // elements
  for (std::size_t axis = size.size(); axis-- > 0 && most > 1;) {
    slice[axis] = std::min(size[axis], most);
    most = slice[axis] == size[axis] ? most / slice[axis] : 1;
  }
  return slice;
}

}  // namespace

Result<std::shared_ptr<ChunkedArray>> MakeHdf5Array(std::shared_ptr<Hdf5Dataset> dataset, const SourceContext& context,
                                                    std::optional<SampleType> as, std::vector<std::uint64_t> size) {
  const std::string named = fmt::format("{}: dataset '{}'", dataset->file(), Printable(dataset->path()));
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
  switch (dataset->layout()) {
    case Hdf5Dataset::Layout::kCompact: {
      Result<Bytes> samples = dataset->ReadCompact();
      if (!samples.ok()) return samples.status();
      shape.chunk = dataset->size();
      return std::shared_ptr<ChunkedArray>(std::make_shared<SmallArray>(std::move(shape), *std::move(samples)));
    }
    case Hdf5Dataset::Layout::kContiguous:
      if (shape.size != dataset->size()) return Status::InvalidArgument(named + " is larger than its image, but has no chunks");
      shape.chunk = SliceOf(shape.size, element_bytes);
      shape.cut_at_end = true;
      break;
    case Hdf5Dataset::Layout::kChunked: shape.chunk = dataset->chunk(); break;
  }
  CodecChain codecs;
  if (dataset->big_endian() && element_bytes > 1) codecs.push_back(SwapBytesCodec(element_bytes));
  const Result<CodecChain> filters = CodecsOf(dataset->filters(), element_bytes, named);
  if (!filters.ok()) return filters.status();
  codecs.insert(codecs.end(), filters->begin(), filters->end());
  return std::shared_ptr<ChunkedArray>(std::make_shared<Hdf5Array>(std::move(dataset), context, std::move(shape), std::move(codecs)));
}

}  // namespace slabstream
