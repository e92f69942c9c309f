// ModelCells: how many bytes the cells of a box take in a simulated world whose dataset is a grid. The seed decides it, and nothing else is
// drawn for it: in the other worlds everything is as if there were no grids.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "common/frame/dataset_id.h"
#include "common/volume/box.h"
#include "common/wire/digest.h"
#include "common/wire/ids.h"
#include "common/wire/voxel_messages.h"

namespace slabstream {

class ModelCells {
 public:
  // `may_be`: the dataset may be a grid.
  ModelCells(std::uint64_t seed, bool may_be) : seed_(seed), may_be_(may_be) {}

  // In every fourth world where it may be.
  bool present() const { return may_be_ && Draw({}) % 4 == 0; }
  // 1 to 3 chunks; always the same of a box of a dataset.
  std::uint64_t BytesOf(DatasetId dataset, const Box& box) const {
    return 1 + Draw({dataset, Of(box.begin.x), Of(box.begin.y), Of(box.begin.z), Of(box.end.x), Of(box.end.y), Of(box.end.z)}) %
                   (std::uint64_t{3} * kChunkBytes);
  }

 private:
  static std::uint64_t Of(std::int32_t coordinate) { return std::uint64_t(std::int64_t{coordinate}); }
  std::uint64_t Draw(std::array<std::uint64_t, 7> of) const {
    const std::array<std::uint64_t, 8> all = {seed_, of[0], of[1], of[2], of[3], of[4], of[5], of[6]};
    return Digest(std::as_bytes(std::span(all)));
  }

  const std::uint64_t seed_;
  const bool may_be_;
};

}  // namespace slabstream
