#include "tests/data/sources/memory_array.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "common/memory/pooled_vector.h"

namespace slabstream {

MemoryArray::MemoryArray(ArrayShape shape, std::vector<std::byte> elements, SourceContext context)
    : shape_(std::move(shape)), elements_(std::move(elements)), context_(std::move(context)) {}

void MemoryArray::ReadChunk(std::span<const std::uint64_t> index, ChunkDone done, StillWanted /*wanted*/) {
  std::function<void()> arrive = [this, at = std::vector(index.begin(), index.end()), under_way = Count(),
                                  done = std::move(done)]() mutable { done(Chunk(at, std::move(under_way))); };
  {
    const std::lock_guard lock(mutex_);
    asked_.push_back(NumberOf(index));
    if (held) return held_.push_back(std::move(arrive));
  }
  if (context_ == nullptr) return arrive();
  context_->PostDecode(std::move(arrive));
}

std::uint64_t MemoryArray::chunk_count() const {
  std::uint64_t count = 1;
  for (std::size_t a = 0; a < shape_.size.size(); ++a) count *= (shape_.size[a] - 1) / shape_.chunk[a] + 1;
  return count;
}

std::uint64_t MemoryArray::NumberOf(std::span<const std::uint64_t> index) const {
  std::uint64_t number = 0;
  for (std::size_t a = 0; a < index.size(); ++a) number = number * ((shape_.size[a] - 1) / shape_.chunk[a] + 1) + index[a];
  return number;
}

const std::byte* MemoryArray::element(std::span<const std::uint64_t> at) const {
  std::uint64_t place = 0;
  for (std::size_t a = 0; a < at.size(); ++a) {
    place = place * shape_.size[a] + at[a];
  }
  std::vector<std::uint64_t> chunk(at.begin(), at.end());
  for (std::size_t a = 0; a < at.size(); ++a) chunk[a] /= shape_.chunk[a];
  if (missing.contains(NumberOf(chunk))) return shape_.fill.data();
  return elements_.data() + place * BytesPerSample(shape_.type);
}

std::size_t MemoryArray::held_chunks() const {
  const std::lock_guard lock(mutex_);
  return held_.size();
}

bool MemoryArray::LetGo(std::size_t which) {
  std::function<void()> arrive;
  {
    const std::lock_guard lock(mutex_);
    if (which >= held_.size()) return false;
    arrive = std::move(held_[which]);
    held_.erase(held_.begin() + std::ptrdiff_t(which));
  }
  arrive();
  return true;
}

std::vector<std::uint64_t> MemoryArray::asked() const {
  const std::lock_guard lock(mutex_);
  return asked_;
}

MemoryArray::UnderWay MemoryArray::Count() const {
  const std::lock_guard lock(counter_->mutex);
  counter_->most = std::max(counter_->most, ++counter_->now);
  return {nullptr, [counter = counter_](void*) {
            const std::lock_guard at_end(counter->mutex);
            --counter->now;
          }};
}

Result<std::optional<StoredChunk>> MemoryArray::Chunk(std::span<const std::uint64_t> index, UnderWay under_way) const {
  const std::uint64_t number = NumberOf(index);
  if (missing.contains(number)) return std::optional<StoredChunk>();
  if (damaged.contains(number)) return Status::DataLoss("chunk " + std::to_string(number) + " is damaged");
  const std::size_t axes = index.size(), sample = BytesPerSample(shape_.type);
  std::vector<std::uint64_t> sides(axes), within(axes), first(axes);
  std::uint64_t count = 1;
  for (std::size_t a = 0; a < axes; ++a) {
    first[a] = index[a] * shape_.chunk[a];
    sides[a] = shape_.cut_at_end ? std::min(shape_.chunk[a], shape_.size[a] - first[a]) : shape_.chunk[a];
    count *= sides[a];
  }
  PooledVector<std::byte> bytes(count * sample);
  const std::uint64_t row = std::min(sides[axes - 1], shape_.size[axes - 1] - first[axes - 1]);
  for (std::uint64_t n = 0; n < count; n += sides[axes - 1]) {
    std::uint64_t rest = n, place = 0;
    bool inside = true;
    for (std::size_t a = axes; a-- > 0; rest /= sides[a]) within[a] = rest % sides[a];
    for (std::size_t a = 0; a < axes; ++a) {
      inside = inside && first[a] + within[a] < shape_.size[a];
      place = place * shape_.size[a] + first[a] + within[a];
    }
    if (inside) {
      std::memcpy(bytes.data() + n * sample, elements_.data() + place * sample, row * sample);
    } else {
      std::memset(bytes.data() + n * sample, 0xA5, row * sample);
    }
  }
  if (short_ones.contains(number)) bytes.resize(bytes.size() - 1);
  const auto owner = std::make_shared<std::pair<PooledVector<std::byte>, UnderWay>>(std::move(bytes), std::move(under_way));
  return std::optional(StoredChunk{Bytes(owner, owner->first), 7});
}

}  // namespace slabstream
