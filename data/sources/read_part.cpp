#include "data/sources/read_part.h"

#include <span>
#include <utility>

#include "common/memory/pooled_vector.h"

namespace slabstream {

void ReadPart(const std::shared_ptr<VolumeSource>& source, int level, const Box& box, std::uint64_t begin, std::uint64_t bytes,
              std::function<void(Result<Bytes>)> done) {
  const ScalarType type = source->info().levels[std::size_t(level)].description.type;
  const Index3 size = box.size();
  const std::uint64_t row_bytes = std::uint64_t(size.x) * BytesPerSample(type), slice_bytes = row_bytes * std::uint64_t(size.y);
  const auto first = [&](std::uint64_t unit) { return std::int32_t(begin / unit); };
  const auto last = [&](std::uint64_t unit) { return std::int32_t((begin + bytes - 1) / unit); };
  Box part = box;
  part.begin.z = box.begin.z + first(slice_bytes);
  part.end.z = box.begin.z + last(slice_bytes) + 1;
  std::uint64_t skipped = begin - std::uint64_t(first(slice_bytes)) * slice_bytes;
  if (first(slice_bytes) == last(slice_bytes)) {  // rows of one slice
    part.begin.y = box.begin.y + first(row_bytes) % size.y;
    part.end.y = box.begin.y + last(row_bytes) % size.y + 1;
    skipped = begin % row_bytes;
  }
  const auto buffer = std::make_shared<UnwrittenVector<std::byte>>(std::size_t(part.voxel_count()) * BytesPerSample(type));
  source->Read(level, part, *buffer, {}, [source, buffer, skipped, bytes, done = std::move(done)](const Status& status) {
    if (!status.ok()) return done(status);
    done(Bytes(buffer, std::span<const std::byte>(*buffer).subspan(skipped, bytes)));
  });
}

}  // namespace slabstream
