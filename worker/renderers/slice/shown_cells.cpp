#include "worker/renderers/slice/shown_cells.h"

#include <algorithm>
#include <numeric>

#include "common/mesh/mesh_cell.h"
#include "common/parallel/parallel.h"

namespace slabstream::slice {

std::span<const std::uint32_t> ShownCells::Of(const Mesh& mesh, const VisibleSamples& visible) {
  if (visible_ == visible) return shown_;
  const std::size_t count = mesh.tetrahedra.size();
  constexpr std::size_t kBlock = 1 << 15;
  const std::size_t blocks = (count + kBlock - 1) / kBlock;
  const auto for_each_block = [&](auto&& work) {
    ParallelFor(0, blocks, [&](std::size_t block) { work(block, block * kBlock, std::min((block + 1) * kBlock, count)); });
  };

  if (ranges_.size() != count) {
    ranges_.resize(count);
    for_each_block([&](std::size_t, std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) ranges_[i] = ValuesIn(mesh, i);
    });
  }

  // Each block's cells are counted, then written behind those of the blocks before it.
  std::vector<std::size_t> first(blocks + 1, 0);
  const auto shows = [&](std::size_t i) { return visible.AnyBetween(ranges_[i].min, ranges_[i].max); };
  for_each_block([&](std::size_t block, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) first[block + 1] += shows(i) ? 1 : 0;
  });
  std::partial_sum(first.begin(), first.end(), first.begin());
  shown_.resize(first.back());
  for_each_block([&](std::size_t block, std::size_t begin, std::size_t end) {
    std::size_t at = first[block];
    for (std::size_t i = begin; i < end; ++i) {
      if (shows(i)) shown_[at++] = std::uint32_t(i);
    }
  });
  visible_ = visible;
  return shown_;
}

}  // namespace slabstream::slice
