#include "worker/rays/ray_volume.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace slabstream {

Status TooLargeForRays(std::size_t field) {
  return Status::ResourceExhausted(fmt::format("field {} has more than {} MiB of voxels beside one box; more workers have smaller boxes",
                                               field + 1, kMostRayBytes >> 20));
}

std::vector<Box> CutIntoLayers(const Box& box, ScalarType type, std::size_t most_bytes) {
  const Index3 size = box.size();
  const std::int64_t slice = std::int64_t{size.x + 2 * kPad} * (size.y + 2 * kPad) * std::int64_t(BytesPerSample(type));
  const std::int64_t slices = std::max<std::int64_t>(std::int64_t(most_bytes) / slice - 2 * kPad, 1);
  std::vector<Box> layers;
  for (std::int64_t z = box.begin.z; z < box.end.z; z += slices) {
    layers.push_back(box);
    layers.back().begin.z = std::int32_t(z);
    layers.back().end.z = std::int32_t(std::min<std::int64_t>(z + slices, box.end.z));
  }
  return layers;
}

const std::vector<RayPiece>& RayVolume::PiecesOf(const BoxData& data) {
  if (!pieces_.empty()) return pieces_;
  const VoxelBricks bricks = data.bricks();
  const PaddedVoxels* const padded = data.padded();
  const std::vector<Box> layers = CutIntoLayers(bricks.box(), bricks.type(), kMostRayBytes);
  for (const Box& layer : layers) {
    RayPiece piece;
    piece.voxels = padded != nullptr && layers.size() == 1 ? *padded : Pad(bricks, layer);
    piece.cells = FindMacrocellRanges(piece.voxels);
    pieces_.push_back(std::move(piece));
  }
  return pieces_;
}

std::size_t RayVolume::bytes() const {
  std::size_t total = 0;
  for (const RayPiece& piece : pieces_) {
    const bool shared = piece.voxels.samples.use_count() > 1;  // with the padded box, which counts them
    total += (shared ? 0 : piece.voxels.bytes()) + piece.cells.bytes();
  }
  return total;
}

std::vector<std::size_t> NearestFirst(std::span<const RayPiece> pieces, const Camera& camera, const GridMap& map, const Stretch& stretch) {
  std::vector<std::size_t> order(pieces.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  if (camera.projection == Projection::kOrthographic) {
    if (camera.view_direction.z < 0) std::ranges::reverse(order);
    return order;
  }
  // A ray meets only pieces on one side of the eye, so the order between pieces on different sides does not matter.
  const double eye = stretch.ToVoxel(map.To(camera.eye.z, Axis::kZ), Axis::kZ);
  const auto distance = [&](std::size_t piece) {
    const Box& box = pieces[piece].voxels.box;
    return std::abs(std::clamp(eye, box.begin.z - 0.5, box.end.z - 0.5) - eye);
  };
  std::ranges::stable_sort(order, {}, distance);
  return order;
}

SampledRegion PartIn(const RayPiece& piece, std::span<const RayPiece> pieces, const Box& box, const GridMap& map) {
  SampledRegion part = WholeBox(box);
  if (&piece != &pieces.front()) part.low.z = std::max(part.low.z, map.From(piece.voxels.box.begin.z - 0.5, Axis::kZ));
  if (&piece != &pieces.back()) part.high.z = std::min(part.high.z, map.From(piece.voxels.box.end.z - 0.5, Axis::kZ));
  return part;
}

}  // namespace slabstream
