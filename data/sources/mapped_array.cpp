#include "data/sources/mapped_array.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <exception>
#include <utility>

#include "common/base/check.h"
#include "common/memory/pooled_vector.h"

namespace slabstream {
namespace {

class MappedArray : public ChunkedArray, public std::enable_shared_from_this<MappedArray> {
 public:
  MappedArray(std::shared_ptr<ChunkedArray> array, ElementMeaning meaning)
      : array_(std::move(array)), meaning_(std::move(meaning)), shape_(array_->shape()) {
    shape_.type = SampleType::kFloat32;
    shape_.fill.resize(sizeof(float));
    Map(array_->shape().fill, 0, 1, shape_.fill.data());
  }

  const ArrayShape& shape() const override { return shape_; }
  std::string NameOf(std::span<const std::uint64_t> index) const override { return array_->NameOf(index); }

  void ReadChunk(std::span<const std::uint64_t> index, ChunkDone done, StillWanted wanted) override {
    auto mapped_done = [self = shared_from_this(), at = std::vector(index.begin(), index.end()),
                        done = std::move(done)](Result<std::optional<StoredChunk>> read) {
      if (!read.ok()) return done(std::move(read));
      if (!*read && self->meaning_.mapped_axes == 0) return done(std::move(read));
      Result<std::optional<StoredChunk>> mapped = self->Mapped(at, *read);
      done(std::move(mapped));
    };
    array_->ReadChunk(index, std::move(mapped_done), std::move(wanted));
  }

 private:
  Result<std::optional<StoredChunk>> Mapped(const std::vector<std::uint64_t>& index, const std::optional<StoredChunk>& chunk) const try {
    // Elements of the chunk along each axis, and of one index of the mapped axes.
    std::vector<std::uint64_t> sides = shape_.chunk;
    for (std::size_t axis = 0; shape_.cut_at_end && axis < sides.size(); ++axis) {
      sides[axis] = std::min(sides[axis], shape_.size[axis] - index[axis] * sides[axis]);
    }
    std::uint64_t slices = 1, each = 1;
    for (std::size_t axis = 0; axis < sides.size(); ++axis) (axis < meaning_.mapped_axes ? slices : each) *= sides[axis];
    const std::size_t element_bytes = BytesPerSample(array_->shape().type);
    if (chunk && chunk->elements.size() != slices * each * element_bytes) {
      return Status::DataLoss("a chunk has another number of bytes than expected");
    }
    UnwrittenVector<std::byte> values(slices * each * sizeof(float));
    for (std::uint64_t slice = 0; slice < slices; ++slice) {
      const std::size_t number = NumberOf(index, sides, slice);
      std::byte* const out = values.data() + slice * each * sizeof(float);
      if (chunk) {
        Map(chunk->elements.span().subspan(slice * each * element_bytes), number, each, out);
      } else {
        for (std::uint64_t i = 0; i < each; ++i) Map(array_->shape().fill, number, 1, out + i * sizeof(float));
      }
    }
    return std::optional(StoredChunk{Bytes(std::move(values)), chunk ? chunk->stored_bytes : 0});
  } catch (const std::exception& error) {
    return Status::ResourceExhausted(std::string("a chunk cannot be scaled: ") + error.what());
  }

  // Of the mapping for a slice of a chunk. Those beyond the array have the last one.
  std::size_t NumberOf(const std::vector<std::uint64_t>& index, const std::vector<std::uint64_t>& sides, std::uint64_t slice) const {
    std::array<std::uint64_t, kMaxArrayAxes> at{};
    for (std::size_t axis = meaning_.mapped_axes; axis-- > 0; slice /= sides[axis]) {
      at[axis] = std::min(index[axis] * shape_.chunk[axis] + slice % sides[axis], shape_.size[axis] - 1);
    }
    std::size_t number = 0;
    for (std::size_t axis = 0; axis < meaning_.mapped_axes; ++axis) number = number * shape_.size[axis] + at[axis];
    return number;
  }

  // `count` elements by the mapping of that number.
  void Map(std::span<const std::byte> elements, std::size_t number, std::uint64_t count, std::byte* out) const {
    const ValueMapping mapping = meaning_.mappings[number];
    VisitSampleType(array_->shape().type, [&](const auto* null) {
      std::remove_cvref_t<decltype(*null)> element;
      for (std::uint64_t i = 0; i < count; ++i) {
        std::memcpy(&element, elements.data() + i * sizeof(element), sizeof(element));
        const float value = ValueOf(double(element), mapping);
        std::memcpy(out + i * sizeof(float), &value, sizeof(float));
      }
    });
  }

  float ValueOf(double element, const ValueMapping& mapping) const {
    const bool outside = element < meaning_.least || element > meaning_.most;
    if ((outside && !meaning_.clamp) || std::ranges::find(meaning_.missing, element) != meaning_.missing.end()) {
      return std::numeric_limits<float>::quiet_NaN();
    }
    return float(mapping.FromStored(outside ? std::clamp(element, meaning_.least, meaning_.most) : element));
  }

  const std::shared_ptr<ChunkedArray> array_;
  const ElementMeaning meaning_;
  ArrayShape shape_;
};

}  // namespace

bool ElementMeaning::linear() const {
  const bool all_mean_some = std::ranges::all_of(missing, [](double element) { return std::isnan(element); });
  const ValueMapping& first = mappings.front();
  const bool invertible = first.scale > 0 && std::isfinite(first.scale) && std::isfinite(first.offset);
  return mappings.size() == 1 && invertible && all_mean_some && std::isinf(least) && std::isinf(most);
}

std::shared_ptr<ChunkedArray> MakeMappedArray(std::shared_ptr<ChunkedArray> array, ElementMeaning meaning) {
  std::uint64_t mappings = 1;
  for (std::size_t axis = 0; axis < meaning.mapped_axes; ++axis) mappings *= array->shape().size.at(axis);
  CHECK(meaning.mappings.size() == mappings);
  if (array->shape().type == SampleType::kFloat32) {  // files state doubles for their floats
    const auto round = [](double& number) {
      number = std::abs(number) <= std::numeric_limits<float>::max() ? double(float(number)) : number;
    };
    std::ranges::for_each(meaning.missing, round);
    round(meaning.least);
    round(meaning.most);
  }
  return std::make_shared<MappedArray>(std::move(array), std::move(meaning));
}

}  // namespace slabstream
