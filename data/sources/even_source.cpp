#include "data/sources/even_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <utility>
#include <vector>

#include "common/base/check.h"
#include "common/memory/pooled_vector.h"
#include "common/volume/memory_budget.h"
#include "data/sources/copy_samples.h"
#include "data/sources/prolong.h"

namespace slabstream {
namespace {

// Of all voxels along each axis.
using Places = std::shared_ptr<const VoxelPlaces>;

class EvenSource final : public DescribedSource {
 public:
  EvenSource(std::shared_ptr<VolumeSource> source, SourceInfo info, Places places)
      : DescribedSource(std::move(source), std::move(info)), places_(std::move(places)) {}

  using VolumeSource::Read;
  void Read(int level, const Box& box, const BoxRoom& out, std::stop_token stop, ReadDone done) override {
    CHECK(level == 0 && !box.empty() && info_.finest().geometry.bounds().Contains(box)) << "a box outside the volume";
    struct Work {
      VoxelPlaces places;
      UnwrittenVector<std::byte> samples;
    };
    const auto work = std::make_shared<Work>();
    for (const Axis axis : kAxes) {
      const auto i = std::size_t(Number(axis));
      work->places[i].assign((*places_)[i].begin() + box.begin[axis], (*places_)[i].begin() + box.end[axis]);
    }
    const Box between = BoxBetween(work->places);
    const ScalarType type = source_->info().finest().type;
    const std::size_t bytes = std::size_t(between.voxel_count()) * BytesPerSample(type);
    if (Status fits = CheckFitsMemory(std::int64_t(bytes), info_.format + ": a part of it"); !fits.ok()) return done(fits);
    try {
      work->samples.resize(bytes);
    } catch (const std::exception& error) {
      return done(Status::ResourceExhausted(info_.format + ": a part of it cannot be read: " + error.what()));
    }
    source_->Read(0, between, BoxRoom::Dense(between, work->samples.data()), std::move(stop),
                  [work, type, shift = KeptTypeOf(source_->info().exact.type).shift, out, done = std::move(done)](Status status) {
                    if (status.ok()) {
                      VisitScalarType(type, [&]<class T>(const T*) {
                        Prolong<T, float>(reinterpret_cast<const T*>(work->samples.data()), work->places, out, shift);
                      });
                    }
                    done(std::move(status));
                  });
  }

 private:
  std::shared_ptr<VolumeSource> Around(std::shared_ptr<VolumeSource> source, SourceInfo info) const override {
    return std::make_shared<EvenSource>(std::move(source), std::move(info), places_);
  }

  const Places places_;
};

Result<std::int32_t> VoxelsAlong(const std::string& name, const UnevenAxis& axis, Axis letter, std::int32_t voxels) {
  const std::size_t least = axis.centres.size();
  if (voxels > 0 && std::size_t(voxels) < least) {
    return Status::InvalidArgument(
        fmt::format("{}: resample is {}, must be at least {}, the voxels along {}", name, voxels, least, Letter(letter)));
  }
  if (voxels > 0) return voxels;
  const double needed = std::max(VoxelsForShortest(axis), double(least));
  if (needed <= kMaxVolumeSide) return std::int32_t(needed);
  return Status::InvalidArgument(
      fmt::format("{}: resample=even needs {:g} voxels along {}, limit {}; resample=VOXELS, of {} or more, takes longer ones", name, needed,
                  Letter(letter), kMaxVolumeSide, least));
}

// For people.
std::string NoteOf(const UnevenAxis& axis, Axis letter, std::int32_t voxels, double spacing) {
  std::size_t shorter = 0;
  for (std::size_t i = 1; i < axis.centres.size(); ++i) {
    if (axis.centres[i] - axis.centres[i - 1] < spacing * (1 - 1e-6)) ++shorter;
  }
  return fmt::format("{} are resampled linearly to {} even ones {:g} apart{}", DistancesText(axis, letter), voxels, spacing,
                     shorter > 0 ? fmt::format("; {} of the distances are shorter", shorter) : "");
}

}  // namespace

Result<std::shared_ptr<VolumeSource>> MakeEven(const std::string& name, std::shared_ptr<VolumeSource> source, std::int32_t voxels) {
  SourceInfo info = source->info();
  const UnevenAxes uneven = std::exchange(info.uneven, {});
  if (std::ranges::all_of(uneven, [](const UnevenAxis& axis) { return axis.centres.empty(); })) return source;
  if (info.labels) return Status::InvalidArgument(name + ": its values are labels, which are not resampled");
  if (info.levels.size() > 1) return Status::InvalidArgument(name + ": has several levels, which are not resampled");
  auto& [description, block, refined, owned] = info.levels.front();
  owned = {};  // pieces count the voxels that they hold
  VolumeGeometry& geometry = description.geometry;
  const auto places = std::make_shared<VoxelPlaces>();
  for (const Axis axis : kAxes) {
    const UnevenAxis& its = uneven[std::size_t(Number(axis))];
    std::vector<double>& its_places = (*places)[std::size_t(Number(axis))];
    if (its.centres.empty()) {
      for (std::int32_t i = 0; i < geometry.size[axis]; ++i) its_places.push_back(i);
      continue;
    }
    CHECK(its.begin < its.end && its.centres.size() == std::size_t(geometry.size[axis]));
    const Result<std::int32_t> count = VoxelsAlong(name, its, axis, voxels);
    if (!count.ok()) return count.status();
    const double spacing = (its.end - its.begin) / *count, first = its.begin + spacing / 2 - its.centres.front();
    geometry.orientation.origin = geometry.orientation.origin + first * geometry.orientation.axes[std::size_t(Number(axis))];
    geometry.spacing[axis] = spacing;
    block[axis] = std::max(1, std::int32_t(std::int64_t{block[axis]} * *count / geometry.size[axis]));
    geometry.size[axis] = *count;
    its_places = EvenPlaces(its, *count);
    info.notes.push_back(NoteOf(its, axis, *count, spacing));
  }
  // Without the shift that int16 has (KeptTypeOf), which would cost digits.
  description.type = ScalarType::kFloat32;
  description.mapping = info.exact.mapping;
  info.exact.type = SampleType::kFloat32;
  info.stored = {};
  return std::shared_ptr<VolumeSource>(std::make_shared<EvenSource>(std::move(source), std::move(info), places));
}

}  // namespace slabstream
