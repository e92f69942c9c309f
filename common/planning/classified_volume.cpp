#include "common/planning/classified_volume.h"

#include <functional>
#include <utility>

namespace slabstream {
namespace {

template <class T>
void Mix(std::size_t& hash, const T& value) {
  hash ^= std::hash<T>()(value) + 0x9e3779b97f4a7c15 + (hash << 6) + (hash >> 2);
}

std::size_t HashOf(DatasetId dataset, const TransferFunction& transfer, RendererKind renderer) {
  std::size_t hash = 0;
  Mix(hash, dataset);
  Mix(hash, renderer);
  Mix(hash, transfer.opacity_distance);
  for (const ColorPoint& point : transfer.colors) {
    Mix(hash, point.value);
    for (const float channel : {point.color.r, point.color.g, point.color.b}) Mix(hash, channel);
  }
  for (const OpacityPoint& point : transfer.opacities) {
    for (const double number : {point.value, point.opacity, point.midpoint, point.sharpness}) Mix(hash, number);
  }
  return hash;
}

}  // namespace

ClassifiedVolume::ClassifiedVolume(DatasetId dataset, TransferFunction transfer, RendererKind renderer)
    : dataset_(dataset),
      transfer_(std::make_shared<const TransferFunction>(std::move(transfer))),
      renderer_(renderer),
      hash_(HashOf(dataset, *transfer_, renderer)) {}

}  // namespace slabstream
