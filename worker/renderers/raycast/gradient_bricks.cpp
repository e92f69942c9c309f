#include "worker/renderers/raycast/gradient_bricks.h"

namespace slabstream {

void GradientBricks::Enter(const RayBox& box, bool smooth) {
  if (samples_ == box.samples && smooth_ == smooth) return;
  samples_ = box.samples;
  smooth_ = smooth;
  slope_unit_ = smooth && box.type == ScalarType::kUint8 ? kSmoothUnit : 1;
  counts_ = (box.cells + Uniform(1)) / 2;  // a cell has half a brick's side
  const std::size_t corner_bytes = box.type == ScalarType::kFloat32 ? sizeof(CornerOf<float>) : sizeof(CornerOf<std::uint8_t>);
  corners_.resize(kBytes);
  made_.assign(kBytes / (kCorners * corner_bytes), 0);
  next_ = 0;
  firsts_.assign(1 + std::size_t(CountIn(counts_)), kNone);
  firsts_[0] = 0;
}

std::int32_t GradientBricks::Add(std::int32_t number) {
  const std::size_t place = next_;
  next_ = (next_ + 1) % made_.size();
  if (made_[place] != 0) firsts_[std::size_t(made_[place])] = kNone;
  made_[place] = number;
  return firsts_[std::size_t(number)] = std::int32_t(place) * kCorners;
}

}  // namespace slabstream
