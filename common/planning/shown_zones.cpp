#include "common/planning/shown_zones.h"

#include <algorithm>
#include <utility>

#include "common/planning/picture_extent.h"
#include "common/renderers/renderer_kind.h"

namespace slabstream {
namespace {

constexpr std::int32_t kMostZones = 64;  // along an axis
constexpr std::int32_t kLeastSide = 32;  // voxels: smaller zones are mostly halo

LevelMap EmptyMap(const Index3& size, const Index3& block) {
  LevelMap map;
  for (const Axis axis : kAxes) {
    const std::int32_t least = std::max(kLeastSide, (size[axis] - 1) / kMostZones + 1);
    map.side[axis] = ((least - 1) / block[axis] + 1) * block[axis];
  }
  map.counts = (size - Uniform(1)) / map.side + Uniform(1);
  map.of_zone.assign(CountIn(map.counts), LevelMap::kOutside);
  return map;
}

// Parts of a level, `side` voxels each, from coarse to fine: calls found(number of the part, its voxels) for those that the picture shows.
template <class Found>
class ShownParts {
 public:
  ShownParts(const FrameSetup& setup, const Index3& side, Found found)
      : setup_(setup), bounds_(setup.description.geometry.bounds()), side_(side), found_(std::move(found)) {}

  // `parts`: numbers.
  void Find(const Box& parts) {
    const Box voxels = Intersection({parts.begin * side_, parts.end * side_}, bounds_);
    // Voxels show in the picture as far as they reach, and boxes may end so much before the part does (Partition::OfBlocks).
    const Box reached = setup_.description.geometry.InDataSpace(Grown(voxels, setup_.renderer->reach(), bounds_));
    if (!setup_.clip.MayKeep(reached) || !InPicture(ExtentOf(reached, {}, setup_.camera), setup_.camera)) return;
    if (parts.voxel_count() == 1) return found_(parts.begin, voxels);
    const auto length = [&](Axis axis) { return parts.size()[axis] > 1 ? voxels.size()[axis] : 0; };
    const Axis longest = std::ranges::max(kAxes, {}, length);
    Box lower = parts, upper = parts;
    lower.end[longest] = upper.begin[longest] = parts.begin[longest] + parts.size()[longest] / 2;
    Find(lower);
    Find(upper);
  }

 private:
  const FrameSetup& setup_;
  const Box bounds_;
  const Index3 side_;
  Found found_;
};

}  // namespace

std::shared_ptr<const LevelMap> ShownZones(const FrameSetup& setup) {
  if (!setup.stored || !setup.coarser.empty()) return nullptr;
  const VolumeGeometry& geometry = setup.description.geometry;
  LevelMap map = EmptyMap(geometry.size, setup.stored->block.end);
  std::int64_t shown = 0;  // voxels
  ShownParts find(setup, map.side, [&](const Index3& zone, const Box& voxels) {
    map.of_zone[NumberIn(map.counts, zone)] = 0;
    shown += voxels.voxel_count();
  });
  find.Find({{0, 0, 0}, map.counts});
  return 2 * shown > geometry.bounds().voxel_count() ? nullptr : std::make_shared<const LevelMap>(std::move(map));
}

}  // namespace slabstream
