#include "data/precomputed/precomputed_array.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cstring>
#include <string_view>
#include <utility>
#include <vector>

#include "common/text/url.h"
#include "data/codecs/codecs.h"
#include "data/metadata/json_fields.h"
#include "data/precomputed/jpeg_codec.h"
#include "data/precomputed/segmentation_codec.h"
#include "data/sources/decode_chunk.h"

namespace slabstream::precomputed {
namespace {

// What CloudVolume appends to the names of files that it packs. Objects of a web server are packed without it, but folders are served, too.
struct Ending {
  std::string_view name;
  SharedCodec codec;  // null: as they are, or packed by a mirror
};
const std::vector<Ending>& Endings() {
  static const std::vector<Ending> endings = {{"", nullptr},          {".gz", GzipCodec()},   {".br", BrotliCodec()},
                                              {".zstd", ZstdCodec()}, {".bz2", Bzip2Codec()}, {".xz", XzCodec()}};
  return endings;
}

constexpr std::size_t kEndingsOfServers = 4;  // the first ones, which are not rare: each costs a request for a chunk that is not there

bool BeginsWith(const Bytes& bytes, std::string_view magic) {
  return bytes.size() >= magic.size() && std::memcmp(bytes.span().data(), magic.data(), magic.size()) == 0;
}

// Unpacks a file with this ending, or what a mirror has packed. It may be longer than what it holds, so `most` is of its own.
SharedCodec Unpacking(const SharedCodec& stated, std::uint64_t most) {
  return std::make_shared<ChunkCodec>([=](Bytes packed, std::uint64_t) {
    const SharedCodec codec = stated != nullptr                        ? stated
                              : BeginsWith(packed, "\x1f\x8b")         ? GzipCodec()
                              : BeginsWith(packed, "\x28\xb5\x2f\xfd") ? ZstdCodec()
                                                                       : nullptr;
    return codec == nullptr ? Result<Bytes>(std::move(packed)) : codec->Decode(std::move(packed), most);
  });
}

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
  std::string NameOf(std::span<const std::uint64_t> index) const override {
    return store_->name() + "/" + metadata::Join(scale_.key, scale_.sharding ? ShardOf(index).file : FileOf(index));
  }

  void ReadChunk(std::span<const std::uint64_t> index, ChunkDone done, StillWanted wanted) override {
    std::array<std::uint64_t, 3> size{};
    for (std::size_t axis = 0; axis < 3; ++axis) size[axis] = EndOf(index, axis) - BeginOf(index, axis);
    if (scale_.sharding) return ReadFromShard(index, size, std::move(done), wanted);
    ReadFile(metadata::Join(scale_.key, FileOf(index)), size, ending_, 0, std::move(done), wanted);
  }

 private:
  // Tries the endings in turn, from `first` on.
  void ReadFile(const std::string& key, const std::array<std::uint64_t, 3>& size, std::size_t first, std::size_t tried, ChunkDone done,
                const StillWanted& wanted) {
    const std::size_t endings = IsUrl(store_->name()) ? kEndingsOfServers : Endings().size(), number = (first + tried) % endings;
    const std::string file = key + std::string(Endings()[number].name);
    auto read = [self = shared_from_this(), key, file, size, first, tried, endings, number, done = std::move(done),
                 wanted](Result<Bytes> answer) {
      const bool missing = answer.status().code() == StatusCode::kNotFound;
      if (missing && tried + 1 < endings) return self->ReadFile(key, size, first, tried + 1, done, wanted);
      if (answer.ok()) self->ending_ = number;
      self->Decode(self->store_->name() + "/" + file, size, std::move(answer), done, Endings()[number].codec);
    };
    store_->Read(file, {}, MostStored(), std::move(read), wanted);
  }

  // Of a chunk, in voxels of the scale along x, y and z.
  std::uint64_t BeginOf(std::span<const std::uint64_t> index, std::size_t axis) const { return index[3 - axis] * scale_.chunk[axis]; }
  std::uint64_t EndOf(std::span<const std::uint64_t> index, std::size_t axis) const {
    return std::min(BeginOf(index, axis) + scale_.chunk[axis], scale_.size[axis]);
  }

  std::string FileOf(std::span<const std::uint64_t> index) const {
    std::string name;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      name += fmt::format("{}{}-{}", axis > 0 ? "_" : "", scale_.offset[axis] + std::int64_t(BeginOf(index, axis)),
                          scale_.offset[axis] + std::int64_t(EndOf(index, axis)));
    }
    return name;
  }

  std::uint64_t NumberOf(std::span<const std::uint64_t> index) const {
    std::array<std::uint64_t, 3> counts{};
    for (std::size_t axis = 0; axis < 3; ++axis) counts[axis] = (scale_.size[axis] - 1) / scale_.chunk[axis] + 1;
    return ChunkNumber({index[3], index[2], index[1]}, counts);
  }
  ShardPlace ShardOf(std::span<const std::uint64_t> index) const { return PlaceOf(*scale_.sharding, NumberOf(index)); }

  // The index of the shard, that of the minishard, and the chunk, one after the other.
  void ReadFromShard(std::span<const std::uint64_t> index, const std::array<std::uint64_t, 3>& size, ChunkDone done,
                     const StillWanted& wanted) {
    const std::uint64_t chunk = NumberOf(index);
    const ShardPlace place = ShardOf(index);
    const std::string key = metadata::Join(scale_.key, place.file);
    const std::string what = fmt::format("{}/{}: chunk {}", store_->name(), key, chunk);
    constexpr std::uint64_t kEntryBytes = 16;
    auto found_chunk = [self = shared_from_this(), key, size, what, done, wanted](Result<std::optional<ByteRange>> range) {
      if (!range.ok()) return done(Status(range.status().code(), what + ": " + range.status().message()));
      if (!*range) return done(std::optional<StoredChunk>());
      auto decode = [self, size, what, bytes = (*range)->bytes, done](Result<Bytes> answer) {
        if (answer.status().code() == StatusCode::kNotFound) answer = Status::Unavailable(what + ": the shard is gone");
        if (answer.ok() && answer->size() != bytes) answer = Status::DataLoss(what + ": the shard ends before it does");
        self->Decode(what, size, std::move(answer), done);
      };
      self->store_->Read(key, **range, self->MostStored(), std::move(decode), wanted);
    };
    auto found_minishard = [self = shared_from_this(), key, what, chunk, found_chunk, done, wanted](Result<Bytes> entry) {
      if (entry.status().code() == StatusCode::kNotFound) return done(std::optional<StoredChunk>());
      if (!entry.ok()) return done(entry.status());
      const Result<ByteRange> range = MinishardRange(*self->scale_.sharding, *entry);
      if (!range.ok()) return found_chunk(range.status());
      if (range->bytes == 0) return done(std::optional<StoredChunk>());
      auto find_chunk = [self, chunk, found_chunk, done, bytes = range->bytes](Result<Bytes> packed) {
        if (!packed.ok()) return done(packed.status());
        if (packed->size() != bytes) return found_chunk(Status::DataLoss("the shard ends within an index"));
        found_chunk(ChunkRange(*self->scale_.sharding, *std::move(packed), chunk));
      };
      self->store_->Read(key, *range, kMostMinishardBytes, std::move(find_chunk), wanted);
    };
    store_->Read(key, {.begin = kEntryBytes * place.minishard, .bytes = kEntryBytes}, kEntryBytes, std::move(found_minishard), wanted);
  }

  // A block of one voxel in the segmentation encoding takes two words and its label.
  std::uint64_t MostStored() const { return 4 * shape_.chunk_bytes() + (std::uint64_t{1} << 20); }

  void Decode(const std::string& what, const std::array<std::uint64_t, 3>& size, Result<Bytes> answer, const ChunkDone& done,
              const SharedCodec& packing = nullptr) const {
    const std::uint64_t channels = shape_.size[0], voxels = size[0] * size[1] * size[2];
    const std::size_t each = BytesPerSample(shape_.type);
    const std::uint64_t bytes = voxels * channels * each;
    const SharedCodec unpacking = Unpacking(packing, MostStored());
    CodecChain chain;
    switch (scale_.encoding) {
      case Encoding::kRaw:
        if (packing != nullptr || (scale_.sharding ? scale_.sharding->gzip_data : answer.ok() && answer->size() != bytes))
          chain.push_back(unpacking);
        break;
      case Encoding::kJpeg: chain = {JpegCodec(voxels, int(channels)), unpacking}; break;
      case Encoding::kSegmentation: chain = {SegmentationCodec(size, scale_.block, channels, each), unpacking}; break;
    }
    DecodeOn(context_, std::move(chain), std::move(answer), bytes, what, done);
  }

  const std::shared_ptr<Store> store_;
  const Scale scale_;
  const SourceContext context_;
  ArrayShape shape_;
  std::atomic<std::size_t> ending_ = 0;  // of Endings(): that of the last file that was there
};

}  // namespace

std::shared_ptr<ChunkedArray> MakeArray(const std::shared_ptr<Store>& store, const Scale& scale, SampleType type, std::uint64_t channels,
                                        const SourceContext& context) {
  return std::make_shared<PrecomputedArray>(store, scale, type, channels, context);
}

}  // namespace slabstream::precomputed
