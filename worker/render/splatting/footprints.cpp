#include "worker/render/splatting/footprints.h"

#include <algorithm>
#include <cmath>

namespace slabstream {
namespace {
constexpr double kLadderSteps = 32;  // an octave
constexpr std::int32_t kCell = kFootprintCell;
}  // namespace

double LadderSigma(double sigma, bool perspective) {
  return perspective ? std::exp2(std::round(kLadderSteps * std::log2(sigma)) / kLadderSteps) : sigma;
}

Footprints::Footprints(const SliceProjection& projection, const VolumeGeometry& geometry, const Box& box)
    : projection_(projection), volume_size_(geometry.size) {
  const auto [c, u, v] = projection.axes();
  first_u_ = box.begin[u] / kCell;
  count_u_ = (box.end[u] - 1) / kCell + 1 - first_u_;
  first_v_ = box.begin[v] / kCell;
  count_v_ = (box.end[v] - 1) / kCell + 1 - first_v_;
  FootprintPair everywhere;
  if (!projection.perspective()) {
    const FootprintSigma sigma = projection.SigmaAt(0, 0, 0);
    everywhere = {Kernel(sigma.x), Kernel(sigma.y)};
  }
  pairs_.assign(std::size_t(count_u_) * std::size_t(count_v_), everywhere);
}

const GaussianKernel* Footprints::Kernel(double sigma) {
  auto found = kernels_.find(sigma);
  if (found == kernels_.end()) found = kernels_.emplace(sigma, MakeGaussianKernel(sigma)).first;
  return &found->second;
}

void Footprints::SetSlice(std::int32_t k) {
  if (!projection_.perspective()) return;
  const auto centre = [&](std::int32_t cell, Axis axis) {
    const std::int32_t end = std::min((cell + 1) * kCell, volume_size_[axis]);
    return 0.5 * (cell * kCell + end - 1);
  };
  std::size_t i = 0;
  for (std::int32_t cell_v = first_v_; cell_v < first_v_ + count_v_; ++cell_v) {
    for (std::int32_t cell_u = first_u_; cell_u < first_u_ + count_u_; ++cell_u, ++i) {
      const FootprintSigma sigma = projection_.SigmaAt(centre(cell_u, projection_.axes().u), centre(cell_v, projection_.axes().v), k);
      pairs_[i] = {Kernel(LadderSigma(sigma.x, true)), Kernel(LadderSigma(sigma.y, true))};
    }
  }
}

}  // namespace slabstream
