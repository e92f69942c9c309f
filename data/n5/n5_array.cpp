#include "data/n5/n5_array.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <span>
#include <utility>

#include "common/memory/pooled_vector.h"
#include "data/codecs/codecs.h"
#include "data/sources/decode_chunk.h"

namespace slabstream::n5 {
namespace {

// Numbers of a header are big endian. They stop at the end of the bytes.
class HeaderReader {
 public:
  explicit HeaderReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  std::uint32_t Take(std::size_t bytes) {
    if (bytes_.size() - at_ < bytes) {
      whole_ = false;
      return 0;
    }
    std::uint32_t number = 0;
    for (std::size_t i = 0; i < bytes; ++i) number = number << 8 | std::to_integer<std::uint32_t>(bytes_[at_ + i]);
    at_ += bytes;
    return number;
  }
  std::size_t at() const { return at_; }
  bool whole() const { return whole_; }

 private:
  const std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
  bool whole_ = true;
};

Result<CodecChain> CodecsOf(const metadata::Field& attributes, std::size_t element_bytes) {
  CodecChain chain;
  if (element_bytes > 1) chain.push_back(SwapBytesCodec(element_bytes));  // blocks are big endian
  const metadata::Field compression = attributes["compression"], old = attributes["compressionType"];
  const metadata::Field type = compression.given() ? compression["type"] : old;
  const Result<std::string> name = type.Text();
  if (!name.ok()) return name.status();
  const metadata::Field zlib = compression["useZlib"];
  if (*name == "raw") return chain;
  if (*name == "gzip") {
    chain.push_back(zlib.given() && zlib.value() == true ? ZlibCodec() : GzipCodec());
  } else if (*name == "zstd" || *name == "zstandard") {
    chain.push_back(ZstdCodec());
  } else if (*name == "blosc") {
    chain.push_back(BloscCodec());
  } else if (*name == "lz4") {
    chain.push_back(Lz4JavaCodec());
  } else if (*name == "bzip2") {
    chain.push_back(Bzip2Codec());
  } else if (*name == "xz") {
    chain.push_back(XzCodec());
  } else {
    return type.Wrong("a supported compression: raw, gzip, zstd, blosc, lz4, bzip2 or xz");
  }
  return chain;
}

// A cut block as a whole one: what is missing is 0. `cut` and `whole`: elements along each axis, the last one fastest.
Bytes Padded(const Bytes& elements, const std::vector<std::uint64_t>& cut, const std::vector<std::uint64_t>& whole,
             std::size_t element_bytes) {
  std::uint64_t rows = 1, bytes = element_bytes;
  for (const std::uint64_t along : whole) bytes *= along;
  for (std::size_t axis = 0; axis + 1 < cut.size(); ++axis) rows *= cut[axis];
  UnwrittenVector<std::byte> out(bytes);
  std::ranges::fill(out, std::byte{0});
  const std::uint64_t row_bytes = cut.back() * element_bytes;
  for (std::uint64_t row = 0; row < rows; ++row) {
    std::uint64_t rest = row, to = 0, step = whole.back();
    for (std::size_t axis = cut.size() - 1; axis-- > 0;) {
      to += rest % cut[axis] * step;
      rest /= cut[axis];
      step *= whole[axis];
    }
    std::memcpy(out.data() + to * element_bytes, elements.span().data() + row * row_bytes, row_bytes);
  }
  return Bytes(std::move(out));
}

class N5Array : public ChunkedArray, public std::enable_shared_from_this<N5Array> {
 public:
  N5Array(std::shared_ptr<Store> store, std::string path, ArrayShape shape, CodecChain codecs, SourceContext context)
      : store_(std::move(store)),
        path_(std::move(path)),
        shape_(std::move(shape)),
        codecs_(std::move(codecs)),
        context_(std::move(context)) {}

  const ArrayShape& shape() const override { return shape_; }
  std::string NameOf(std::span<const std::uint64_t> index) const override { return store_->name() + "/" + KeyOf(index); }

  void ReadChunk(std::span<const std::uint64_t> index, ChunkDone done, StillWanted wanted) override {
    const std::string key = KeyOf(index);
    // What does not shrink becomes a little longer.
    constexpr std::uint64_t kOverhead = 65536;
    auto decode = [self = shared_from_this(), what = store_->name() + "/" + key, done = std::move(done)](Result<Bytes> answer) {
      self->Decode(what, std::move(answer), done);
    };
    store_->Read(key, {}, 2 * shape_.chunk_bytes() + kOverhead, std::move(decode), std::move(wanted));
  }

 private:
  std::string KeyOf(std::span<const std::uint64_t> index) const {
    std::string key = path_;
    for (std::size_t axis = index.size(); axis-- > 0;) key = metadata::Join(key, std::to_string(index[axis]));
    return key;
  }

  void Decode(const std::string& what, Result<Bytes> answer, const ChunkDone& done) const {
    if (!answer.ok()) return DecodeOn(context_, codecs_, std::move(answer), 0, what, done);
    const std::uint64_t stored_bytes = answer->size();
    Result<Block> block = ParseBlock(*answer, {shape_.chunk.rbegin(), shape_.chunk.rend()});
    if (!block.ok()) return done(Status(block.status().code(), what + ": " + block.status().message()));
    const std::vector<std::uint64_t> cut(block->size.rbegin(), block->size.rend());
    const std::size_t element_bytes = BytesPerSample(shape_.type);
    std::uint64_t bytes = element_bytes;
    for (const std::uint64_t along : cut) bytes *= along;
    auto pad = [self = shared_from_this(), cut, element_bytes, stored_bytes, done](Result<std::optional<StoredChunk>> chunk) {
      if (chunk.ok() && *chunk) {
        (*chunk)->stored_bytes = stored_bytes;
        if (cut != self->shape_.chunk) (*chunk)->elements = Padded((*chunk)->elements, cut, self->shape_.chunk, element_bytes);
      }
      done(std::move(chunk));
    };
    DecodeOn(context_, codecs_, std::move(block->packed), bytes, what, std::move(pad));
  }

  const std::shared_ptr<Store> store_;
  const std::string path_;
  const ArrayShape shape_;
  const CodecChain codecs_;
  const SourceContext context_;
};

}  // namespace

Result<Block> ParseBlock(const Bytes& stored, const std::vector<std::uint64_t>& most) {
  constexpr std::uint32_t kDefault = 0, kWithCount = 1;
  HeaderReader header(stored.span());
  const std::uint32_t mode = header.Take(2), axes = header.Take(2);
  if (mode != kDefault && mode != kWithCount) return Status::DataLoss(fmt::format("is a block of mode {}, must be 0 or 1", mode));
  if (axes != most.size()) return Status::DataLoss(fmt::format("is a block of {} axes, must have {}", axes, most.size()));
  Block block;
  std::uint64_t count = 1;
  for (std::size_t axis = 0; axis < most.size(); ++axis) {
    const std::uint64_t along = header.Take(4);
    if (!header.whole()) break;
    if (along < 1 || along > most[axis]) {
      return Status::DataLoss(fmt::format("is a block of {} elements along axis {}, must have 1 to {}", along, axis, most[axis]));
    }
    block.size.push_back(along);
    count *= along;  // at most that of a whole block
  }
  const std::uint64_t counted = mode == kWithCount ? header.Take(4) : count;
  if (!header.whole()) return Status::DataLoss("damaged: the header of the block is cut off");
  if (counted != count) return Status::DataLoss(fmt::format("is a block of {} elements, must have {}", counted, count));
  block.packed = stored.Part(header.at(), stored.size() - header.at());
  return block;
}

Result<std::shared_ptr<ChunkedArray>> OpenArray(const std::shared_ptr<Store>& store, const std::string& path,
                                                const metadata::Field& attributes, const SourceContext& context) {
  const Result<std::vector<std::uint64_t>> size = attributes["dimensions"].Counts(0);
  if (!size.ok()) return size.status();
  const Result<std::vector<std::uint64_t>> block = attributes["blockSize"].Counts(size->size());
  if (!block.ok()) return block.status();
  const metadata::Field type_field = attributes["dataType"];
  const Result<std::string> type_name = type_field.Text();
  if (!type_name.ok()) return type_name.status();
  const std::optional<SampleType> type = SampleTypeNamed(*type_name);
  if (!type) return type_field.Wrong("one of " + SampleTypeNames());
  std::uint64_t bytes = BytesPerSample(*type);
  for (const std::uint64_t along : *block) {
    if (along > kMostChunkBytes / bytes) {
      return Status::ResourceExhausted(fmt::format("{}: has blocks of more than {} bytes", attributes.object(), kMostChunkBytes));
    }
    bytes *= along;
  }
  Result<CodecChain> codecs = CodecsOf(attributes, BytesPerSample(*type));
  if (!codecs.ok()) return codecs.status();
  ArrayShape shape{.size = {size->rbegin(), size->rend()},
                   .chunk = {block->rbegin(), block->rend()},
                   .type = *type,
                   .fill = std::vector<std::byte>(BytesPerSample(*type))};
  return std::shared_ptr<ChunkedArray>(std::make_shared<N5Array>(store, path, std::move(shape), *std::move(codecs), context));
}

}  // namespace slabstream::n5
