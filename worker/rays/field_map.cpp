#include "worker/rays/field_map.h"

#include <algorithm>

#include "worker/rays/ray_box.h"

namespace slabstream {

FieldMap MakeFieldMap(const LevelBox& at, const FrameSetup& setup, const FieldSetup& field) {
  const AffineMap map = MapTo(setup, field, at.level);
  const VolumeGeometry &finest = field.levels.front().description.geometry, &drawn = LevelOf(field, at.level).description.geometry;
  const VolumeGeometry& volume = GeometryOf(setup, at.level);
  // All levels end where the finest one does. A coarser one may reach half a voxel less far or farther.
  constexpr double kMargin = 1.0 / 64;
  const GridMap from_finest = MapBetween(finest, drawn);
  const SampledRegion box = WholeBox(at.box);
  const auto [least, most] = map.Bounds(box.low, box.high);
  FieldMap result = {.offset = ToFloat3(map.offset), .everywhere = true};
  for (const Axis axis : kAxes) {
    const auto i = std::size_t(Number(axis));
    const double low = std::max(from_finest.To(-0.5, axis), -1 + kMargin);
    const double high = std::min(from_finest.To(finest.size[axis] - 0.5, axis), drawn.size[axis] - kMargin);
    result.steps.at(i) = ToFloat3(map.steps.at(i));
    result.low.at(i) = float(low);
    result.high.at(i) = float(high);
    result.everywhere = result.everywhere && least[axis] > low + kMargin && most[axis] < high - kMargin;
  }
  result.everywhere = result.everywhere || (AffineMapBetween(volume, drawn).is_identity() && drawn.size == volume.size);
  return result;
}

}  // namespace slabstream
