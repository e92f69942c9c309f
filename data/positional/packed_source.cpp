#include "data/positional/packed_source.h"

#include <algorithm>
#include <cstdint>
#include <utility>

#include "data/codecs/codecs.h"
#include "data/sources/chunked_source.h"
#include "data/sources/decode_chunk.h"
#include "data/stores/store.h"
#include "data/volume_io/packed_samples.h"

namespace slabstream {
namespace {

// Bytes of a chunk, about. Chunks do not end where blocks do, so a block may be decoded for two of them: for few if a chunk has many
// blocks.
std::uint64_t ChunkBytes(std::uint64_t block_bytes) {
  constexpr std::uint64_t kLeast = std::uint64_t{512} << 10, kMost = std::uint64_t{4} << 20, kBlocks = 16;
  return std::max(std::clamp(kBlocks * block_bytes, kLeast, kMost), block_bytes);
}

// Whole slices, or whole rows of one slice. The axes are z, y, x and the components of a voxel.
ArrayShape ShapeOf(const RawHeader& header, std::uint64_t block_bytes) {
  ArrayShape shape{.type = header.type, .cut_at_end = true, .fill = std::vector<std::byte>(BytesPerSample(header.type))};
  for (const std::int32_t side : {header.size.z, header.size.y, header.size.x, std::int32_t{header.components}}) {
    shape.size.push_back(std::uint64_t(side));
  }
  const std::uint64_t row = shape.size[2] * shape.size[3] * BytesPerSample(header.type), slice = shape.size[1] * row;
  const std::uint64_t bytes = ChunkBytes(block_bytes);
  const auto most = [&](std::uint64_t each, std::uint64_t count) { return std::clamp<std::uint64_t>(bytes / each, 1, count); };
  shape.chunk = {most(slice, shape.size[0]), most(row, shape.size[1]), shape.size[2], shape.size[3]};
  return shape;
}

class PackedArray : public ChunkedArray, public std::enable_shared_from_this<PackedArray> {
 public:
  PackedArray(const std::string& path, const RawHeader& header, std::shared_ptr<const PackedSamples> samples, SourceContext context)
      : store_(FileStore(path)),
        samples_(std::move(samples)),
        context_(std::move(context)),
        shape_(ShapeOf(header, samples_->block_bytes)),
        row_bytes_(shape_.size[2] * shape_.size[3] * BytesPerSample(shape_.type)) {}

  const ArrayShape& shape() const override { return shape_; }

  void ReadChunk(std::span<const std::uint64_t> index, ChunkDone done, StillWanted /*wanted*/) override {
    const std::uint64_t z = index[0] * shape_.chunk[0], y = index[1] * shape_.chunk[1];
    const std::uint64_t rows = std::min(shape_.chunk[0], shape_.size[0] - z) * std::min(shape_.chunk[1], shape_.size[1] - y);
    const PackedSamples::Range part{(z * shape_.size[1] + y) * row_bytes_, rows * row_bytes_};
    const PackedSamples::Range stored = samples_->Stored(part);
    const auto decode = [self = shared_from_this(), part, wanted = stored.bytes, done = std::move(done)](Result<Bytes> answer) {
      const std::string& name = self->samples_->name;
      if (answer.status().code() == StatusCode::kNotFound)
        answer = Status::Unavailable(name + ": the file is gone");  // no chunk is missing
      if (answer.ok() && answer->size() != wanted) answer = Status::DataLoss(name + ": the file ends before it does");
      CodecChain chain;
      if (const std::size_t each = BytesPerSample(self->shape_.type); self->samples_->big_endian && each > 1) {
        chain.push_back(SwapBytesCodec(each));
      }
      chain.push_back(std::make_shared<ChunkCodec>(
          [samples = self->samples_, part](Bytes packed, std::uint64_t /*most*/) { return samples->Decode(std::move(packed), part); }));
      DecodeOn(self->context_, std::move(chain), std::move(answer), part.bytes, name, done);
    };
    store_->Read("file", {stored.begin, stored.bytes}, stored.bytes, decode);
  }

 private:
  const std::shared_ptr<Store> store_;
  const std::shared_ptr<const PackedSamples> samples_;
  const SourceContext context_;
  const ArrayShape shape_;
  const std::uint64_t row_bytes_;
};

}  // namespace

Result<std::shared_ptr<VolumeSource>> OpenPacked(const std::string& path, LocatedVolume volume, const SourceContext& context) {
  const auto& [size, spacing, orientation, stretch] = volume.info.finest().geometry;
  PyramidLevel level{.array = std::make_shared<PackedArray>(path, volume.header, std::move(volume.packed), context),
                     .mirrored = volume.turn.flipped,
                     .at = {0, 0, 0, std::uint64_t(volume.component)},
                     .channel_axis = 3,
                     .spacing = spacing,
                     .origin = orientation.origin};
  std::ranges::transform(volume.turn.from, level.axes.begin(), [](int axis) { return 2 - axis; });
  Pyramid pyramid{.levels = {std::move(level)}, .orientation = orientation, .rescale = volume.header.rescale};
  pyramid.info = std::move(volume.info);
  return MakeChunkedSource(path, std::move(pyramid), context);
}

}  // namespace slabstream
