#include "worker/rays/padded_voxels.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstring>
#include <span>
#include <type_traits>

#include "common/base/check.h"

namespace slabstream {
namespace {

// Row y of slice z of `inside`, with the padding at its ends.
template <class T>
void FillRow(const VoxelBricks& voxels, const Box& inside, std::int32_t y, std::int32_t z, std::int32_t left, std::int32_t count, T* row) {
  const Box read = {{inside.begin.x, y, z}, {inside.end.x, y + 1, z + 1}};
  const std::int32_t width = inside.size().x;
  voxels.Read(read, 0, std::as_writable_bytes(std::span(row + left, std::size_t(width))));
  std::fill_n(row, left, row[left]);
  std::fill_n(row + left + width, count - left - width, row[left + width - 1]);
}

}  // namespace

PaddedVoxels Pad(const VoxelBricks& voxels, const Box& box) {
  CHECK(!box.empty() && voxels.box().Contains(box));
  PaddedVoxels padded;
  padded.box = box;
  padded.type = voxels.type();
  const Index3 size = box.size();
  padded.row = size.x + 2 * kPad;
  padded.slice = std::int64_t{padded.row} * (size.y + 2 * kPad);
  padded.samples = MakeLargeArray<std::byte>(std::size_t(padded.slice) * std::size_t(size.z + 2 * kPad) * BytesPerSample(padded.type));

  const Box inside = Grown(box, kPad, voxels.box());
  VisitScalarType(voxels.type(), [&](auto* type) {
    using T = std::remove_cvref_t<decltype(*type)>;
    T* const samples = reinterpret_cast<T*>(padded.samples.get());
    const auto row_of = [&](std::int32_t y, std::int32_t z) {
      return samples + (z - (box.begin.z - kPad)) * padded.slice + std::ptrdiff_t{y - (box.begin.y - kPad)} * padded.row;
    };
    tbb::parallel_for(box.begin.z - kPad, box.end.z + kPad, [&](std::int32_t z) {
      const std::int32_t from_z = std::clamp(z, inside.begin.z, inside.end.z - 1);
      for (std::int32_t y = inside.begin.y; y < inside.end.y; ++y) {
        FillRow(voxels, inside, y, from_z, inside.begin.x - (box.begin.x - kPad), padded.row, row_of(y, z));
      }
      const std::size_t row_bytes = std::size_t(padded.row) * sizeof(T);
      for (std::int32_t y = box.begin.y - kPad; y < inside.begin.y; ++y) std::memcpy(row_of(y, z), row_of(inside.begin.y, z), row_bytes);
      for (std::int32_t y = inside.end.y; y < box.end.y + kPad; ++y) std::memcpy(row_of(y, z), row_of(inside.end.y - 1, z), row_bytes);
    });
  });
  return padded;
}

}  // namespace slabstream
