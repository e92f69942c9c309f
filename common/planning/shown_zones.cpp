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

class Finder {
 public:
  Finder(const FrameSetup& setup, LevelMap& map) : setup_(setup), bounds_(setup.description.geometry.bounds()), map_(map) {}

  // Of all zones: voxels of those that the picture shows.
  std::int64_t Find() { return Find({{0, 0, 0}, map_.counts}); }

 private:
  std::int64_t Find(const Box& zones) {
    const Box voxels = Intersection({zones.begin * map_.side, zones.end * map_.side}, bounds_);
    // Voxels show in the picture as far as they reach, and boxes may end so much before the zone does (Partition::OfBlocks).
    const Box reached = Grown(voxels, setup_.renderer->reach(), bounds_);
    if (!setup_.clip.MayKeep(reached) || !InPicture(ExtentOf(reached, {}, setup_.camera), setup_.camera)) return 0;
    if (zones.voxel_count() == 1) {
      map_.of_zone[NumberIn(map_.counts, zones.begin)] = 0;
      return voxels.voxel_count();
    }
    const auto length = [&](Axis axis) { return zones.size()[axis] > 1 ? voxels.size()[axis] : 0; };
    const Axis longest = std::ranges::max(kAxes, {}, length);
    Box lower = zones, upper = zones;
    lower.end[longest] = upper.begin[longest] = zones.begin[longest] + zones.size()[longest] / 2;
    return Find(lower) + Find(upper);
  }

  const FrameSetup& setup_;
  const Box bounds_;
  LevelMap& map_;
};

}  // namespace

std::shared_ptr<const LevelMap> ShownZones(const FrameSetup& setup) {
  if (!setup.stored || !setup.coarser.empty()) return nullptr;
  const VolumeGeometry& geometry = setup.description.geometry;
  LevelMap map = EmptyMap(geometry.size, setup.stored->block.end);
  const std::int64_t shown = Finder(setup, map).Find();
  return 2 * shown > geometry.bounds().voxel_count() ? nullptr : std::make_shared<const LevelMap>(std::move(map));
}

}  // namespace slabstream
