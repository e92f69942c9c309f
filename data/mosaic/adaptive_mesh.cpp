#include "data/mosaic/adaptive_mesh.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <utility>

#include "data/volume_io/world_placement.h"

namespace slabstream {
namespace {

Status Wrong(const std::string& name, const std::string& why) { return Status::InvalidArgument(name + ": " + why); }

// How many cells of the level lie along one of the coarsest level, along each axis.
Result<Index3> RatioOf(const std::string& name, const std::vector<MeshLevel>& levels, std::size_t number) {
  constexpr double kSame = 1e-3;
  Index3 ratio;
  for (const Axis axis : kAxes) {
    const double exact = levels.front().spacing[axis] / levels[number].spacing[axis];
    if (!(exact >= 1 - kSame && exact <= kMaxVolumeSide && std::abs(exact - std::round(exact)) <= kSame * exact)) {
      return Wrong(name, fmt::format("cells of level {} are no whole part of those of level 0 along {}", number, Letter(axis)));
    }
    ratio[axis] = std::int32_t(std::round(exact));
  }
  return ratio;
}

Result<Box> DomainOf(const std::string& name, const Box& coarsest, const Index3& ratio, std::size_t number) {
  Box domain;
  for (const Axis axis : kAxes) {
    const std::int64_t begin = std::int64_t{coarsest.begin[axis]} * ratio[axis], end = std::int64_t{coarsest.end[axis]} * ratio[axis];
    if (end - begin > kMaxVolumeSide || std::abs(begin) > std::numeric_limits<std::int32_t>::max() / 2) {
      return Wrong(name,
                   fmt::format("level {} has {} cells along {}, must have at most {}", number, end - begin, Letter(axis), kMaxVolumeSide));
    }
    domain.begin[axis] = std::int32_t(begin);
    domain.end[axis] = std::int32_t(end);
  }
  return domain;
}

}  // namespace

Result<std::shared_ptr<VolumeSource>> MakeAdaptiveMesh(const std::string& name, SourceInfo info, const Vec3& origin,
                                                       std::vector<MeshLevel> levels) {
  const Vec3 coarsest_spacing = levels.front().spacing;
  if (levels.front().parts.empty()) return Wrong(name, "has no boxes at level 0");
  Box coarsest = levels.front().parts.front().box;
  for (const MosaicPart& part : levels.front().parts) coarsest = Hull(coarsest, part.box);
  info.notes.push_back(fmt::format("{} levels of cells", levels.size()));
  std::vector<std::vector<MosaicPart>> parts;
  for (std::size_t number = 0; number < levels.size(); ++number) {
    const Result<Index3> ratio = RatioOf(name, levels, number);
    if (!ratio.ok()) return ratio.status();
    const Result<Box> domain = DomainOf(name, coarsest, *ratio, number);
    if (!domain.ok()) return domain.status();
    const Vec3 spacing = coarsest_spacing / ToVec3(*ratio);
    RawHeader header{.size = domain->size(), .world = World::kScene, .matrix = "the spacing of its levels"};
    header.steps = StepsOf(spacing);
    header.origin = origin + spacing * (ToVec3(domain->begin) + Vec3{0.5, 0.5, 0.5});
    const Result<WorldPlacement> placed = PlaceInWorld(header, name);
    if (!placed.ok()) return placed.status();
    info.levels.insert(info.levels.begin(), SourceLevel{{placed->geometry, ScalarType::kFloat32, {}}, {}});
    for (MosaicPart& part : levels[number].parts) {
      if (!domain->Contains(part.box)) return Wrong(part.name, "lies beyond level 0");
      part.box = {part.box.begin - domain->begin, part.box.end - domain->begin};
    }
    parts.insert(parts.begin(), std::move(levels[number].parts));
  }
  return MakeMosaic(name, std::move(info), std::move(parts));
}

}  // namespace slabstream
