// BoundsCache: bounds of a padded box's samples, by piece. It stays with the padded box between frames.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "worker/rays/project.h"
#include "worker/rays/ray_volume.h"

namespace slabstream {

class BoundsCache : public BoxCache {
 public:
  const std::vector<SampleBounds>& Of(const std::vector<RayPiece>& pieces, float sign) {
    std::vector<SampleBounds>& bounds = by_sign_[sign > 0 ? 1 : 0];
    if (bounds.empty()) {
      for (const RayPiece& piece : pieces) bounds.push_back(BoundSamples(piece.cells, sign));
    }
    return bounds;
  }

  std::size_t bytes() const override {
    std::size_t total = 0;
    for (const auto& bounds : by_sign_) {
      for (const SampleBounds& piece : bounds) total += piece.bytes();
    }
    return total;
  }

 private:
  std::array<std::vector<SampleBounds>, 2> by_sign_;
};

}  // namespace slabstream
