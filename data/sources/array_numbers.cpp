#include "data/sources/array_numbers.h"

#include <algorithm>
#include <atomic>
#include <cstring>
#include <future>
#include <mutex>
#include <optional>
#include <utility>

#include "common/base/check.h"
#include "common/volume/memory_budget.h"

namespace slabstream {
namespace {

using Index = std::vector<std::uint64_t>;

// A read under way. It ends with its last chunk.
class Reading {
 public:
  Reading(std::shared_ptr<ChunkedArray> array, ArrayBox box, std::uint64_t bytes, ElementsDone done)
      : array_(std::move(array)), shape_(array_->shape()), box_(std::move(box)), elements_(bytes), done_(std::move(done)) {}

  static void Start(const std::shared_ptr<Reading>& reading) {
    const ArrayShape& shape = reading->shape_;
    Index chunk;
    for (std::size_t axis = 0; axis < shape.size.size(); ++axis) chunk.push_back(reading->box_.begin[axis] / shape.chunk[axis]);
    do {
      ++reading->under_way_;
      reading->array_->ReadChunk(chunk, [reading, chunk](const Result<std::optional<StoredChunk>>& read) { reading->Take(chunk, read); });
    } while (reading->Advance(chunk));
    reading->EndPart();
  }

 private:
  // To the next chunk that the box has some of, the last axis fastest. False: there is none.
  bool Advance(Index& chunk) const {
    for (std::size_t axis = chunk.size(); axis-- > 0;) {
      if (++chunk[axis] * shape_.chunk[axis] < box_.begin[axis] + box_.count[axis]) return true;
      chunk[axis] = box_.begin[axis] / shape_.chunk[axis];
    }
    return false;
  }
  void Take(const Index& chunk, const Result<std::optional<StoredChunk>>& read) {
    if (read.ok()) {
      Copy(chunk, 0, *read ? (*read)->elements.span().data() : nullptr, elements_.data());
    } else {
      const std::lock_guard lock(mutex_);
      if (failure_.ok()) failure_ = read.status();
    }
    EndPart();
  }
  void EndPart() {
    if (--under_way_ == 0) done_(failure_.ok() ? Result(std::move(elements_)) : failure_);
  }

  // Copies what box and chunk have in common, from `axis` on. `from`: of the chunk; null: it is not there. `to`: of the box.
  void Copy(const Index& chunk, std::size_t axis, const std::byte* from, std::byte* to) {
    const std::uint64_t along = shape_.chunk[axis], first = chunk[axis] * along, bytes = BytesPerSample(shape_.type);
    const std::uint64_t begin = std::max(first, box_.begin[axis]), end = std::min(first + along, box_.begin[axis] + box_.count[axis]);
    std::uint64_t in_chunk = bytes, in_box = bytes;  // from one element along the axis to the next
    for (std::size_t inner = axis + 1; inner < chunk.size(); ++inner) {
      const std::uint64_t left = shape_.size[inner] - chunk[inner] * shape_.chunk[inner];
      in_chunk *= shape_.cut_at_end ? std::min(shape_.chunk[inner], left) : shape_.chunk[inner];
      in_box *= box_.count[inner];
    }
    if (from != nullptr) from += (begin - first) * in_chunk;
    to += (begin - box_.begin[axis]) * in_box;
    const bool last = axis + 1 == chunk.size();
    if (last && from != nullptr) {
      std::memcpy(to, from, (end - begin) * bytes);
      return;
    }
    for (std::uint64_t i = begin; i < end; ++i, to += in_box) {
      if (last) {
        std::memcpy(to, shape_.fill.data(), bytes);
      } else {
        Copy(chunk, axis + 1, from, to);
        if (from != nullptr) from += in_chunk;
      }
    }
  }

  const std::shared_ptr<ChunkedArray> array_;
  const ArrayShape& shape_;
  const ArrayBox box_;
  AlignedVector<std::byte> elements_;  // chunks fill parts of it that do not overlap
  const ElementsDone done_;
  std::atomic<std::uint64_t> under_way_ = 1;
  std::mutex mutex_;
  Status failure_;
};

}  // namespace

void ReadElements(const std::string& named, const std::shared_ptr<ChunkedArray>& array, const ArrayBox& box, ElementsDone done) {
  const ArrayShape& shape = array->shape();
  std::uint64_t bytes = BytesPerSample(shape.type);
  CHECK(box.begin.size() == shape.size.size() && box.count.size() == shape.size.size());
  for (std::size_t axis = 0; axis < shape.size.size(); ++axis) {
    CHECK(box.count[axis] > 0 && box.begin[axis] <= shape.size[axis] && box.count[axis] <= shape.size[axis] - box.begin[axis]) << named;
    bytes *= box.count[axis];
  }
  if (Status status = CheckFitsMemory(std::int64_t(bytes), named); !status.ok()) return done(std::move(status));
  Reading::Start(std::make_shared<Reading>(array, box, bytes, std::move(done)));
}

Result<AlignedVector<std::byte>> ReadElements(const std::string& named, const std::shared_ptr<ChunkedArray>& array, const ArrayBox& box) {
  const auto promise = std::make_shared<std::promise<Result<AlignedVector<std::byte>>>>();
  std::future<Result<AlignedVector<std::byte>>> read = promise->get_future();
  ReadElements(named, array, box, [promise](Result<AlignedVector<std::byte>> elements) { promise->set_value(std::move(elements)); });
  return read.get();
}

}  // namespace slabstream
