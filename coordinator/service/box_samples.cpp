#include "coordinator/service/box_samples.h"

#include <algorithm>
#include <cstring>
#include <utility>
#include <vector>

#include "common/base/check.h"

namespace slabstream {

Bytes BoxSamples(const std::shared_ptr<const Volume>& volume, const Box& box, std::uint64_t begin, std::uint64_t end) {
  const VoxelBlock& block = volume->block;
  const Index3 whole = block.box.size();
  const Index3 size = box.size();
  CHECK(block.box.Contains(box) && !box.empty());
  CHECK_LT(begin, end);
  const std::uint64_t sample_bytes = BytesPerSample(block.type);
  const auto at = [&](std::uint64_t box_offset) {  // address of a byte of the box
    const auto sample = std::int64_t(box_offset / sample_bytes);
    const Index3 voxel = {box.begin.x + std::int32_t(sample % size.x), box.begin.y + std::int32_t(sample / size.x % size.y),
                          box.begin.z + std::int32_t(sample / size.x / size.y)};
    return block.bytes.data() + std::uint64_t(block.Offset(voxel)) * sample_bytes + box_offset % sample_bytes;
  };

  // Samples that follow each other in the box and in the volume: the whole box, a slice of it, or a row.
  const bool whole_rows = size.x == whole.x;
  const bool whole_slices = whole_rows && size.y == whole.y;
  const std::uint64_t row = std::uint64_t(size.x) * sample_bytes;
  const std::uint64_t stretch = whole_slices ? row * size.y * size.z : whole_rows ? row * size.y : row;
  if (begin / stretch == (end - 1) / stretch) return {volume, {at(begin), std::size_t(end - begin)}};

  std::vector<std::byte> samples(end - begin);
  for (std::uint64_t offset = begin; offset < end;) {
    const std::uint64_t next = std::min(end, (offset / stretch + 1) * stretch);
    std::memcpy(samples.data() + (offset - begin), at(offset), next - offset);
    offset = next;
  }
  return Bytes(std::move(samples));
}

}  // namespace slabstream
