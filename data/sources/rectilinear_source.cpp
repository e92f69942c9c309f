#include "data/sources/rectilinear_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace slabstream {
namespace {

class RectilinearSource final : public DescribedSource {
 public:
  using DescribedSource::DescribedSource;

 private:
  std::shared_ptr<VolumeSource> Around(std::shared_ptr<VolumeSource> source, SourceInfo info) const override {
    return std::make_shared<RectilinearSource>(std::move(source), std::move(info));
  }
};

}  // namespace

Result<std::shared_ptr<VolumeSource>> AsRectilinear(const std::string& name, std::shared_ptr<VolumeSource> source) {
  SourceInfo info = source->info();
  const UnevenAxes uneven = std::exchange(info.uneven, {});
  if (std::ranges::all_of(uneven, [](const UnevenAxis& axis) { return axis.centres.empty(); })) return source;
  if (info.labels) return Status::InvalidArgument(name + ": its values are labels, and its coordinates are not even");
  if (info.levels.size() > 1) return Status::InvalidArgument(name + ": has several levels, and its coordinates are not even");
  VolumeGeometry& geometry = info.levels.front().description.geometry;
  Stretch::Places places;
  for (const Axis axis : kAxes) {
    const auto i = std::size_t(Number(axis));
    const UnevenAxis& its = uneven[i];
    if (its.centres.empty()) continue;
    const double spacing = (its.end - its.begin) / geometry.size[axis], first = its.begin + spacing / 2 - its.centres.front();
    geometry.orientation.origin = geometry.orientation.origin + first * geometry.orientation.axes[i];
    geometry.spacing[axis] = spacing;
    for (const double centre : its.centres) places[i].push_back((centre - its.begin) / spacing - 0.5);
    info.notes.push_back(fmt::format("{} lie at their own places; the spacing is their mean distance", DistancesText(its, axis)));
  }
  Result<Stretch> stretch = Stretch::Make(places, geometry.size);
  if (!stretch.ok()) {
    return Status::InvalidArgument(fmt::format("{}: {}; --resample VOXELS puts it on even voxels", name, stretch.status().message()));
  }
  geometry.stretch = *std::move(stretch);
  return std::shared_ptr<VolumeSource>(std::make_shared<RectilinearSource>(std::move(source), std::move(info)));
}

}  // namespace slabstream
