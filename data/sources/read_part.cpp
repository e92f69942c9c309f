#include "data/sources/read_part.h"

#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "common/base/pooled_vector.h"

namespace slabstream {

void ReadPart(const std::shared_ptr<VolumeSource>& source, int level, const Box& box, std::uint64_t begin, std::uint64_t bytes,
              std::function<void(Result<Bytes>)> done) {
  const ScalarType type = source->info().levels[std::size_t(level)].description.type;
  const Index3 size = box.size();
  const std::uint64_t slice_bytes = std::uint64_t(size.x) * std::uint64_t(size.y) * BytesPerSample(type);
  const auto first = std::int32_t(begin / slice_bytes), end = std::int32_t((begin + bytes + slice_bytes - 1) / slice_bytes);
  Box slices = box;
  slices.begin.z = box.begin.z + first;
  slices.end.z = box.begin.z + end;
  const auto buffer = std::make_shared<PooledVector<std::byte>>(std::size_t(end - first) * slice_bytes);
  const std::uint64_t skipped = begin - std::uint64_t(first) * slice_bytes;
  source->Read(level, slices, *buffer, {}, [source, buffer, skipped, bytes, done = std::move(done)](const Status& status) {
    if (!status.ok()) return done(status);
    done(Bytes(buffer, std::span<const std::byte>(*buffer).subspan(skipped, bytes)));
  });
}

}  // namespace slabstream
