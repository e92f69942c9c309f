#include "data/zarr_writer/zarr_objects.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zstd.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <limits>
#include <memory>
#include <mutex>
#include <span>
#include <system_error>

#include "common/files/file_descriptor.h"
#include "common/files/files.h"
#include "common/memory/pooled_vector.h"
#include "common/parallel/parallel.h"
#include "data/codecs/codecs.h"

namespace slabstream {
namespace {

static_assert(std::endian::native == std::endian::little, "elements are written as they are in memory");

using Packed = UnwrittenVector<std::byte>;

constexpr std::uint64_t kNoChunk = std::numeric_limits<std::uint64_t>::max();  // in the index of a shard
struct IndexEntry {
  std::uint64_t begin = kNoChunk, bytes = kNoChunk;
};
constexpr std::size_t kSumBytes = 4;  // behind the index

std::size_t Threads() { return std::size_t(ThreadsHere()); }

// Calls function(offset of a row of the chunk, offset of it in the region, bytes) for all rows of the chunk inside the region.
template <class Function>
void ForEachRow(const Index3& region, const Index3& chunk, std::int32_t side, std::size_t sample, Function function) {
  const Box inside = Intersection({side * chunk, side * (chunk + Uniform(1))}, {{0, 0, 0}, region});
  const std::size_t bytes = std::size_t(inside.size().x) * sample;
  for (Index3 v = inside.begin; v.z < inside.end.z; ++v.z) {
    for (v.y = inside.begin.y; v.y < inside.end.y; ++v.y) {
      function(NumberIn(Uniform(side), v - side * chunk) * sample, NumberIn(region, v) * sample, bytes);
    }
  }
}

// A chunk of the region, with zeros beyond its end.
Packed Chunk(const Index3& region, const Index3& chunk, std::int32_t side, std::size_t sample, const std::byte* elements) {
  Packed bytes(CountIn(Uniform(side)) * sample);
  if (!Box{{0, 0, 0}, region}.Contains(Box{side * chunk, side * (chunk + Uniform(1))})) std::ranges::fill(bytes, std::byte{0});
  ForEachRow(region, chunk, side, sample,
             [&](std::size_t to, std::size_t from, std::size_t count) { std::memcpy(bytes.data() + to, elements + from, count); });
  return bytes;
}

bool IsZero(std::span<const std::byte> bytes) {
  return bytes.front() == std::byte{0} && std::memcmp(bytes.data(), bytes.data() + 1, bytes.size() - 1) == 0;
}

// The frame depends on the bytes and the level alone, and has a checksum of the bytes.
Result<Packed> Compress(std::span<const std::byte> bytes, int level) {
  thread_local const std::unique_ptr<ZSTD_CCtx, decltype(&ZSTD_freeCCtx)> context(ZSTD_createCCtx(), ZSTD_freeCCtx);
  if (context == nullptr) return Status::ResourceExhausted("no memory to compress");
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_compressionLevel, level);
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_checksumFlag, 1);
  Packed packed(ZSTD_compressBound(bytes.size()));
  const std::size_t size = ZSTD_compress2(context.get(), packed.data(), packed.size(), bytes.data(), bytes.size());
  if (ZSTD_isError(size) != 0) return Status::ResourceExhausted(std::string("cannot compress: ") + ZSTD_getErrorName(size));
  packed.resize(size);
  return packed;
}

bool Decompress(std::span<const std::byte> packed, std::span<std::byte> bytes) {
  return ZSTD_decompress(bytes.data(), bytes.size(), packed.data(), packed.size()) == bytes.size();
}

Status MakeFolderOf(const std::string& file) {
  std::error_code error;
  std::filesystem::create_directories(std::filesystem::path(file).parent_path(), error);
  return error ? Status::Unavailable(fmt::format("cannot write '{}': {}", file, error.message())) : Status::Ok();
}

class ObjectReader {
 public:
  static Result<ObjectReader> Open(const std::string& file) {
    ObjectReader reader(file, FileDescriptor(::open(file.c_str(), O_RDONLY | O_CLOEXEC)));
    struct stat status {};
    if (reader.descriptor_.number() < 0 || ::fstat(reader.descriptor_.number(), &status) != 0) return reader.Failure();
    reader.bytes_ = std::uint64_t(status.st_size);
    return reader;
  }

  std::uint64_t bytes() const { return bytes_; }
  Status Damaged() const { return Status::DataLoss(fmt::format("'{}' is damaged: remove it, and go on", file_)); }

  Status Read(std::uint64_t begin, std::span<std::byte> out) const {
    if (begin > bytes_ || out.size() > bytes_ - begin) return Damaged();
    if (ReadBytesAt(descriptor_.number(), begin, out) == out.size()) return Status::Ok();
    return errno != 0 ? Failure() : Damaged();
  }

 private:
  ObjectReader(std::string file, FileDescriptor descriptor) : file_(std::move(file)), descriptor_(std::move(descriptor)) {}
  Status Failure() const { return Status::Unavailable(fmt::format("cannot read '{}': {}", file_, std::strerror(errno))); }

  std::string file_;
  FileDescriptor descriptor_;
  std::uint64_t bytes_ = 0;
};

// The first failure of tasks that run at a time.
class FirstFailure {
 public:
  void Add(const Status& status) {
    if (status.ok()) return;
    const std::lock_guard lock(mutex_);
    if (status_.ok()) status_ = status;
    any_ = true;
  }
  bool any() const { return any_; }
  const Status& status() const { return status_; }

 private:
  std::atomic<bool> any_ = false;
  std::mutex mutex_;
  Status status_;
};

Index3 Along(const Index3& counts, std::size_t number) {
  const auto n = std::int64_t(number);
  return {std::int32_t(n % counts.x), std::int32_t(n / counts.x % counts.y), std::int32_t(n / counts.x / counts.y)};
}

}  // namespace

ZarrObjects::ZarrObjects(std::string folder, const ZarrLayout& layout, std::vector<WrittenLevel> levels)
    : folder_(std::move(folder)), layout_(layout), levels_(std::move(levels)) {}

Box ZarrObjects::BoxOf(const ZarrRegion& region) const {
  const Index3 begin = layout_.shard * region.index;
  return {begin, Min(begin + layout_.shard, levels_[std::size_t(region.level)].size)};
}

Index3 ZarrObjects::RegionsOf(int level) const {
  const Index3& size = levels_[std::size_t(level)].size;
  return (size + layout_.shard - Uniform(1)) / layout_.shard;
}

std::uint64_t ZarrObjects::BytesOf(const ZarrRegion& region) const {
  return std::uint64_t(BoxOf(region).voxel_count()) * BytesPerSample(layout_.type);
}

Index3 ZarrObjects::ChunksOf(const ZarrRegion& region) const { return CubesOver(BoxOf(region).size(), layout_.chunk_side); }

std::string ZarrObjects::FileOf(int level, const Index3& object) const {
  return fmt::format("{}/{}/{}{}/{}/{}", folder_, level, layout_.version == OmeZarrVersion::k05 ? "c/" : "", object.z, object.y, object.x);
}

std::uint64_t ZarrObjects::memory() const {
  constexpr std::uint64_t kCompressor = std::uint64_t{4} << 20;  // its tables
  const std::uint64_t chunk = CountIn(Uniform(layout_.chunk_side)) * BytesPerSample(layout_.type);
  return Threads() * (kCompressor + chunk + 2 * std::bit_ceil(ZSTD_compressBound(chunk)));
}

bool ZarrObjects::IsFinished(const ZarrRegion& region) const {
  std::error_code error;
  if (layout_.version == OmeZarrVersion::k05) return std::filesystem::is_regular_file(FileOf(region.level, region.index), error);
  const Index3 counts = ChunksOf(region), first = layout_.shard / layout_.chunk_side * region.index;
  for (std::size_t i = 0; i < CountIn(counts); ++i) {
    if (!std::filesystem::is_regular_file(FileOf(region.level, first + Along(counts, i)), error)) return false;
  }
  return true;
}

Status ZarrObjects::Write(const ZarrRegion& region, const std::byte* elements) const {
  return layout_.version == OmeZarrVersion::k05 ? WriteShard(region, elements) : WriteChunks(region, elements);
}

Status ZarrObjects::Read(const ZarrRegion& region, std::byte* elements) const {
  return layout_.version == OmeZarrVersion::k05 ? ReadShard(region, elements) : ReadChunks(region, elements);
}

Status ZarrObjects::WriteShard(const ZarrRegion& region, const std::byte* elements) const {
  const std::string file = FileOf(region.level, region.index);
  if (Status status = MakeFolderOf(file); !status.ok()) return status;
  Result<OutputFile> output = OutputFile::Create(file);
  if (!output.ok()) return output.status();
  const Index3 size = BoxOf(region).size(), counts = ChunksOf(region);
  const Index3 places = ShardOf(layout_, levels_[std::size_t(region.level)]) / layout_.chunk_side;
  std::vector<IndexEntry> index(CountIn(places));
  std::uint64_t end = 0;
  FirstFailure failure;
  // None: the chunk is left out.
  const auto pack = [&](std::int64_t number) {
    if (failure.any()) return Packed();
    const Packed chunk = Chunk(size, Along(counts, std::size_t(number)), layout_.chunk_side, BytesPerSample(layout_.type), elements);
    if (IsZero(chunk)) return Packed();
    Result<Packed> packed = Compress(chunk, layout_.codec_level);
    failure.Add(packed.status());
    return packed.ok() ? *std::move(packed) : Packed();
  };
  const auto append = [&](std::int64_t number, const Packed& bytes) {
    if (bytes.empty()) return;
    output->Append(bytes);
    if (!output->ok()) failure.Add(output->Close());
    index[NumberIn(places, Along(counts, std::size_t(number)))] = {end, bytes.size()};
    end += bytes.size();
  };
  ParallelInOrder(std::int64_t(CountIn(counts)), std::int64_t(Threads()) + 1, pack, append);
  if (failure.any()) return failure.status();
  const auto index_bytes = std::as_bytes(std::span(index));
  const std::uint32_t sum = Crc32c(index_bytes);
  output->Append(index_bytes);
  output->Append(std::as_bytes(std::span(&sum, 1)));
  return output->Finish();
}

Status ZarrObjects::WriteChunks(const ZarrRegion& region, const std::byte* elements) const {
  const Index3 size = BoxOf(region).size(), counts = ChunksOf(region), first = layout_.shard / layout_.chunk_side * region.index;
  FirstFailure failure;
  ParallelFor(0, CountIn(counts), [&](std::size_t number) {
    if (failure.any()) return;
    const Index3 chunk = Along(counts, number);
    const std::string file = FileOf(region.level, first + chunk);
    const Status written = [&]() -> Status {
      const Result<Packed> packed =
          Compress(Chunk(size, chunk, layout_.chunk_side, BytesPerSample(layout_.type), elements), layout_.codec_level);
      if (!packed.ok()) return packed.status();
      if (Status status = MakeFolderOf(file); !status.ok()) return status;
      Result<OutputFile> output = OutputFile::Create(file);
      if (!output.ok()) return output.status();
      output->Append(*packed);
      return output->Finish();
    }();
    failure.Add(written);
  });
  return failure.status();
}

Status ZarrObjects::ReadShard(const ZarrRegion& region, std::byte* elements) const {
  const Result<ObjectReader> reader = ObjectReader::Open(FileOf(region.level, region.index));
  if (!reader.ok()) return reader.status();
  const Index3 size = BoxOf(region).size(), counts = ChunksOf(region);
  const Index3 places = ShardOf(layout_, levels_[std::size_t(region.level)]) / layout_.chunk_side;
  std::vector<IndexEntry> index(CountIn(places));
  const auto index_bytes = std::as_writable_bytes(std::span(index));
  if (reader->bytes() < index_bytes.size() + kSumBytes) return reader->Damaged();
  const std::uint64_t begin = reader->bytes() - index_bytes.size() - kSumBytes;
  std::uint32_t sum = 0;
  if (Status status = reader->Read(begin, index_bytes); !status.ok()) return status;
  if (Status status = reader->Read(begin + index_bytes.size(), std::as_writable_bytes(std::span(&sum, 1))); !status.ok()) return status;
  if (sum != Crc32c(index_bytes)) return reader->Damaged();
  FirstFailure failure;
  ParallelFor(0, CountIn(counts), [&](std::size_t number) {
    const Index3 chunk = Along(counts, number);
    const IndexEntry& entry = index[NumberIn(places, chunk)];
    Packed bytes(CountIn(Uniform(layout_.chunk_side)) * BytesPerSample(layout_.type));
    if (entry.begin == kNoChunk) {
      std::ranges::fill(bytes, std::byte{0});
    } else {
      if (entry.bytes > ZSTD_compressBound(bytes.size())) return failure.Add(reader->Damaged());
      Packed packed(entry.bytes);
      if (Status status = reader->Read(entry.begin, packed); !status.ok()) return failure.Add(status);
      if (!Decompress(packed, bytes)) return failure.Add(reader->Damaged());
    }
    ForEachRow(size, chunk, layout_.chunk_side, BytesPerSample(layout_.type),
               [&](std::size_t from, std::size_t to, std::size_t count) { std::memcpy(elements + to, bytes.data() + from, count); });
  });
  return failure.status();
}

Status ZarrObjects::ReadChunks(const ZarrRegion& region, std::byte* elements) const {
  const Index3 size = BoxOf(region).size(), counts = ChunksOf(region), first = layout_.shard / layout_.chunk_side * region.index;
  FirstFailure failure;
  ParallelFor(0, CountIn(counts), [&](std::size_t number) {
    const Index3 chunk = Along(counts, number);
    const Result<ObjectReader> reader = ObjectReader::Open(FileOf(region.level, first + chunk));
    if (!reader.ok()) return failure.Add(reader.status());
    Packed bytes(CountIn(Uniform(layout_.chunk_side)) * BytesPerSample(layout_.type));
    if (reader->bytes() > ZSTD_compressBound(bytes.size())) return failure.Add(reader->Damaged());
    Packed packed(reader->bytes());
    if (Status status = reader->Read(0, packed); !status.ok()) return failure.Add(status);
    if (!Decompress(packed, bytes)) return failure.Add(reader->Damaged());
    ForEachRow(size, chunk, layout_.chunk_side, BytesPerSample(layout_.type),
               [&](std::size_t from, std::size_t to, std::size_t count) { std::memcpy(elements + to, bytes.data() + from, count); });
  });
  return failure.status();
}

}  // namespace slabstream
