#include "common/frame/smooth_label.h"

#include <functional>
#include <map>

namespace slabstream {
namespace {

// At the distances 1 + t, t, 1 - t and 2 - t.
std::array<double, 4> SplineWeights(double t) {
  const double u = 1 - t;
  const auto middle = [](double v) { return 2.0 / 3 - v * v + v * v * v / 2; };
  return {u * u * u / 6, middle(t), middle(u), t * t * t / 6};
}

}  // namespace

LabelledVoxel SmoothLabel(const std::array<LabelledVoxel, 64>& around, const Vec3& fraction) {
  const auto x = SplineWeights(fraction.x), y = SplineWeights(fraction.y), z = SplineWeights(fraction.z);
  const auto weight = [&](std::size_t i) { return x.at(i % 4) * y.at(i / 4 % 4) * z.at(i / 16); };
  std::map<double, double, std::greater<>> by_opacity;
  for (std::size_t i = 0; i < around.size(); ++i) by_opacity[around.at(i).opacity] += weight(i);
  LabelledVoxel found;
  double membership = 0;
  for (const auto& [opacity, of_opacity] : by_opacity) {
    found.opacity = opacity;
    membership += of_opacity;
    if (membership >= kHalfMembership) break;
  }
  if (found.opacity < 0) return {};
  // Of two labels with the same weight, the one that comes first.
  double most = 0;
  for (const LabelledVoxel& candidate : around) {
    if (candidate.opacity != found.opacity || candidate.label == found.label) continue;
    double sum = 0;
    for (std::size_t i = 0; i < around.size(); ++i) sum += around.at(i) == candidate ? weight(i) : 0;
    if (sum <= most + kWeightMargin) continue;
    most = sum;
    found.label = candidate.label;
  }
  return found;
}

}  // namespace slabstream
