#include "data/precomputed/precomputed_array.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "data/codecs/codecs.h"
#include "data/precomputed/jpeg_codec.h"
#include "data/precomputed/segmentation_codec.h"
#include "data/sources/decode_chunk.h"
#include "data/zarr/metadata.h"

namespace slabstream::precomputed {
namespace {

bool IsGzip(const Bytes& bytes) { return bytes.size() > 2 && bytes.span()[0] == std::byte{0x1f} && bytes.span()[1] == std::byte{0x8b}; }

// Files of mirrors may be gzipped. What is encoded may be longer than what it holds, so `most` is of its own.
class MaybeGzip : public ChunkCodec {
 public:
  explicit MaybeGzip(std::uint64_t most) : most_(most) {}
  Result<Bytes> Decode(Bytes packed, std::uint64_t) const override {
    return IsGzip(packed) ? GzipCodec()->Decode(std::move(packed), most_) : Result<Bytes>(std::move(packed));
  }

 private:
  const std::uint64_t most_;
};

class PrecomputedArray : public ChunkedArray, public std::enable_shared_from_this<PrecomputedArray> {
 public:
  PrecomputedArray(std::shared_ptr<Store> store, Scale scale, SampleType type, std::uint64_t channels, SourceContext context)
      : store_(std::move(store)), scale_(std::move(scale)), context_(std::move(context)) {
    shape_.size = {channels, scale_.size[2], scale_.size[1], scale_.size[0]};
    shape_.chunk = {channels, scale_.chunk[2], scale_.chunk[1], scale_.chunk[0]};
    shape_.type = type;
    shape_.cut_at_end = true;
    shape_.fill.resize(BytesPerSample(type));
  }

  const ArrayShape& shape() const override { return shape_; }

  void ReadChunk(std::span<const std::uint64_t> index, ChunkDone done) override {
    std::string name;
    std::array<std::uint64_t, 3> size{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::uint64_t begin = index[3 - axis] * scale_.chunk[axis], end = std::min(begin + scale_.chunk[axis], scale_.size[axis]);
      size[axis] = end - begin;
      name +=
          fmt::format("{}{}-{}", axis > 0 ? "_" : "", scale_.offset[axis] + std::int64_t(begin), scale_.offset[axis] + std::int64_t(end));
    }
    const std::string key = zarr::Join(scale_.key, name);
    // CloudVolume gives gzipped files an ending.
    store_->Read(key, {}, MostStored(), [self = shared_from_this(), key, size, done = std::move(done)](Result<Bytes> answer) {
      if (answer.status().code() != StatusCode::kNotFound) return self->Decode(key, size, std::move(answer), done);
      self->store_->Read(key + ".gz", {}, self->MostStored(),
                         [self, key, size, done](Result<Bytes> gzipped) { self->Decode(key + ".gz", size, std::move(gzipped), done); });
    });
  }

 private:
  // A block of one voxel in the segmentation encoding takes two words and its label.
  std::uint64_t MostStored() const { return 4 * shape_.chunk_bytes() + (std::uint64_t{1} << 20); }

  void Decode(const std::string& key, const std::array<std::uint64_t, 3>& size, Result<Bytes> answer, const ChunkDone& done) const {
    const std::uint64_t channels = shape_.size[0], voxels = size[0] * size[1] * size[2];
    const std::size_t each = BytesPerSample(shape_.type);
    const std::uint64_t bytes = voxels * channels * each;
    CodecChain chain;
    switch (scale_.encoding) {
      case Encoding::kRaw:
        if (answer.ok() && answer->size() != bytes) chain.push_back(std::make_shared<MaybeGzip>(MostStored()));
        break;
      case Encoding::kJpeg: chain = {JpegCodec(voxels, int(channels)), std::make_shared<MaybeGzip>(MostStored())}; break;
      case Encoding::kSegmentation:
        chain = {SegmentationCodec(size, scale_.block, channels, each), std::make_shared<MaybeGzip>(MostStored())};
        break;
    }
    DecodeOn(context_, std::move(chain), std::move(answer), bytes, store_->name() + "/" + key, done);
  }

  const std::shared_ptr<Store> store_;
  const Scale scale_;
  const SourceContext context_;
  ArrayShape shape_;
};

}  // namespace

std::shared_ptr<ChunkedArray> MakeArray(const std::shared_ptr<Store>& store, const Scale& scale, SampleType type, std::uint64_t channels,
                                        const SourceContext& context) {
  return std::make_shared<PrecomputedArray>(store, scale, type, channels, context);
}

}  // namespace slabstream::precomputed
