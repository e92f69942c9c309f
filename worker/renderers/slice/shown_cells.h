// ShownCells: the tetrahedra of a padded box of which anything may be visible. Kept until other values are visible.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/mesh/mesh.h"
#include "common/volume/summary.h"
#include "worker/rays/ray_look.h"
#include "worker/renderers/box_data.h"

namespace slabstream::slice {

class ShownCells : public BoxCache {
 public:
  // Numbers of tetrahedra, ascending. Those with a value that is not finite are not among them. `mesh` is the padded box's. Parallel.
  std::span<const std::uint32_t> Of(const Mesh& mesh, const VisibleSamples& visible);

  std::size_t bytes() const override { return ranges_.capacity() * sizeof(ranges_[0]) + shown_.capacity() * sizeof(shown_[0]); }

 private:
  std::vector<ValueRange> ranges_;  // by tetrahedron: ValuesIn
  std::optional<VisibleSamples> visible_;
  std::vector<std::uint32_t> shown_;
};

}  // namespace slabstream::slice
