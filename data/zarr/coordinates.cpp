#include "data/zarr/coordinates.h"

#include <algorithm>
#include <cstring>
#include <future>
#include <type_traits>

#include "common/volume/volume.h"

namespace slabstream::zarr {
namespace {

Result<std::optional<StoredChunk>> ReadNow(ChunkedArray& array, std::uint64_t index) {
  std::promise<Result<std::optional<StoredChunk>>> answer;
  array.ReadChunk(std::span(&index, 1), [&](Result<std::optional<StoredChunk>> chunk) { answer.set_value(std::move(chunk)); });
  return answer.get_future().get();
}

}  // namespace

Result<std::optional<AxisCoordinates>> ReadCoordinates(const ArrayContext& context, const std::string& group, const std::string& name,
                                                       std::uint64_t size) {
  const std::optional<AxisCoordinates> none;
  if (name.empty() || name.find('/') != std::string::npos || size > std::uint64_t(kMaxVolumeSide)) return none;
  const Result<std::optional<ZarrNode>> node = NodeReading(*context.store, metadata::Join(group, name)).Get();
  if (!node.ok() || !node->has_value() || !(*node)->array) return none;
  const Result<ZarrArray> opened = OpenArray(context, **node);
  if (!opened.ok()) return none;
  const ArrayShape& shape = opened->array->shape();
  constexpr std::uint64_t kMostChunks = 1024;
  if (shape.size.size() != 1 || shape.size[0] != size || (size - 1) / shape.chunk[0] >= kMostChunks) return none;
  AxisCoordinates coordinates;
  for (std::uint64_t chunk = 0; chunk * shape.chunk[0] < size; ++chunk) {
    const Result<std::optional<StoredChunk>> read = ReadNow(*opened->array, chunk);
    if (!read.ok()) return read.status();
    for (std::uint64_t i = 0; i < std::min(shape.chunk[0], size - chunk * shape.chunk[0]); ++i) {
      coordinates.values.push_back(VisitSampleType(shape.type, [&](const auto* null) {
        std::remove_cvref_t<decltype(*null)> element;
        std::memcpy(&element, *read ? (*read)->elements.span().data() + i * sizeof element : shape.fill.data(), sizeof element);
        return double(element);
      }));
    }
  }
  const metadata::Field attributes = (*node)->attributes_field();
  for (const char* const key : {"units", "unit"}) {
    if (const metadata::Field unit = attributes[key]; unit.is_text()) coordinates.unit = *unit.Text();
  }
  return std::optional(std::move(coordinates));
}

}  // namespace slabstream::zarr
