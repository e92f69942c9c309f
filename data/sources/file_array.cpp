#include "data/sources/file_array.h"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <utility>
#include <vector>

#include "data/codecs/codecs.h"
#include "data/sources/decode_chunk.h"
#include "data/stores/store.h"

namespace slabstream {
namespace {

class FileArray : public ChunkedArray, public std::enable_shared_from_this<FileArray> {
 public:
  FileArray(const std::string& path, std::string named, ArrayShape shape, FindPiece find, SourceContext context)
      : named_(std::move(named)), shape_(std::move(shape)), find_(std::move(find)), context_(std::move(context)), store_(FileStore(path)) {}

  const ArrayShape& shape() const override { return shape_; }

  void ReadChunk(std::span<const std::uint64_t> index, ChunkDone done, StillWanted /*wanted*/) override {
    context_->PostDecode([self = shared_from_this(), at = std::vector(index.begin(), index.end()), done = std::move(done)] {
      try {
        self->Read(at, done);
      } catch (const std::exception& error) {  // before anything else could call it
        done(Status::ResourceExhausted(self->named_ + " cannot be read: " + error.what()));
      }
    });
  }

 private:
  void Read(const std::vector<std::uint64_t>& index, const ChunkDone& done) {
    Result<std::optional<FilePiece>> piece = find_(index);
    if (!piece.ok()) return done(piece.status());
    if (!*piece) return done(std::optional<StoredChunk>());
    const ByteRange range{(*piece)->begin, (*piece)->bytes};
    const auto decode = [self = shared_from_this(), piece = **std::move(piece),
                         what = fmt::format("{}: chunk {}", named_, fmt::join(index, ".")), done](Result<Bytes> answer) {
      if (answer.status().code() == StatusCode::kNotFound)
        answer = Status::Unavailable(what + ": the file is gone");  // no chunk is missing
      if (answer.ok() && answer->size() != piece.bytes) answer = Status::DataLoss(what + ": the file ends before it does");
      DecodeOn(self->context_, piece.codecs, std::move(answer), piece.decoded_bytes, what, done);
    };
    store_->Read("file", range, range.bytes, decode);
  }

  const std::string named_;
  const ArrayShape shape_;
  const FindPiece find_;
  const SourceContext context_;
  const std::shared_ptr<Store> store_;
};

// A slice of at most kFileSliceBytes that lies in one piece.
std::vector<std::uint64_t> SliceOf(const std::vector<std::uint64_t>& size, std::uint64_t element_bytes) {
  std::vector<std::uint64_t> slice(size.size(), 1);
  std::uint64_t most = kFileSliceBytes / element_bytes;  // elements
  for (std::size_t axis = size.size(); axis-- > 0 && most > 1;) {
    slice[axis] = std::min(size[axis], most);
    most = slice[axis] == size[axis] ? most / slice[axis] : 1;
  }
  return slice;
}

class HeldArray : public ChunkedArray {
 public:
  HeldArray(ArrayShape shape, Bytes elements) : shape_(std::move(shape)), elements_(std::move(elements)) {}
  const ArrayShape& shape() const override { return shape_; }
  void ReadChunk(std::span<const std::uint64_t>, ChunkDone done, StillWanted /*wanted*/) override {
    done(std::optional(StoredChunk{elements_, elements_.size()}));
  }

 private:
  const ArrayShape shape_;
  const Bytes elements_;
};

}  // namespace

std::shared_ptr<ChunkedArray> MakeFileArray(const std::string& path, const std::string& named, ArrayShape shape, FindPiece find,
                                            const SourceContext& context) {
  return std::make_shared<FileArray>(path, named, std::move(shape), std::move(find), context);
}

std::shared_ptr<ChunkedArray> MakePlainArray(const std::string& path, const std::string& named, ArrayShape shape,
                                             const PlainSamples& samples, const SourceContext& context) {
  const std::uint64_t element_bytes = BytesPerSample(shape.type);
  shape.chunk = SliceOf(shape.size, element_bytes);
  if (samples.record_bytes != 0) shape.chunk.front() = 1;
  shape.cut_at_end = true;
  CodecChain codecs;
  if (samples.big_endian && element_bytes > 1) codecs.push_back(SwapBytesCodec(element_bytes));
  const auto find = [samples, codecs, element_bytes, size = shape.size,
                     chunk = shape.chunk](std::span<const std::uint64_t> index) -> Result<std::optional<FilePiece>> {
    if (!samples.begin) return std::optional<FilePiece>();
    std::uint64_t first = 0, count = 1;  // elements
    for (std::size_t axis = 0; axis < size.size(); ++axis) {
      const std::uint64_t begin = index[axis] * chunk[axis];
      first = first * size[axis] + (axis == 0 && samples.record_bytes != 0 ? 0 : begin);
      count *= std::min(chunk[axis], size[axis] - begin);
    }
    const std::uint64_t bytes = count * element_bytes;
    return std::optional(FilePiece{*samples.begin + index[0] * samples.record_bytes + first * element_bytes, bytes, codecs, bytes});
  };
  return MakeFileArray(path, named, std::move(shape), find, context);
}

std::shared_ptr<ChunkedArray> MakeHeldArray(ArrayShape shape, Bytes elements) {
  return std::make_shared<HeldArray>(std::move(shape), std::move(elements));
}

}  // namespace slabstream
