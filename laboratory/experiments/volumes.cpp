#include "laboratory/experiments/volumes.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "common/classification/count_occupied.h"
#include "common/planning/frame_plan.h"
#include "common/renderers/renderer_kind.h"

namespace slabstream {

VolumeInUse VolumeCache::Get(const BenchCase& volume) {
  const auto found = std::ranges::find(held_, volume.dataset, &Held::dataset);
  if (found != held_.end()) {
    held_.splice(held_.begin(), held_, found);
    return found->volume;
  }
  std::shared_ptr<const Volume> loaded = OrThrow(LoadBenchVolume(volume));
  auto summary = std::make_shared<const VolumeSummary>(Summarize(*loaded));
  held_.push_front({volume.dataset, {std::move(loaded), std::move(summary)}});
  std::size_t bytes = 0;
  const auto first_too_many = std::find_if(std::next(held_.begin()), held_.end(), [&](const Held& held) {
    bytes += held.volume.volume->block.bytes.size();
    return bytes > budget_bytes_;
  });
  held_.erase(first_too_many, held_.end());
  return held_.front().volume;
}

std::shared_ptr<const OccupancyGrid> VolumeCache::Occupied(const BenchCase& volume) {
  std::shared_ptr<const OccupancyGrid>& grid = occupied_[{volume.name, volume.renderer}];
  if (grid != nullptr) return grid;
  const VolumeInUse in_use = Get(volume);
  const VolumeSummary& summary = *in_use.summary;
  const TransferFunction transfer = OrThrow(ResolveTransfer(volume.transfer, summary));
  grid = std::make_shared<const OccupancyGrid>(CountOccupied(in_use.volume->block, volume.renderer->DrawnTable(transfer, summary)));
  return grid;
}

std::string TitleOf(const BenchCase& volume) {
  const auto* sphere = std::get_if<SphereRequest>(&volume.volume);
  if (sphere == nullptr) return volume.dataset;
  return fmt::format("class {}, N = {}, {:.3g} % occupied", sphere->sphere_class == SphereClass::kHollow ? "I" : "II", sphere->size,
                     sphere->occupancy * 100);
}

std::vector<BenchCase> RealVolumes(const std::vector<std::string>& named) {
  std::vector<BenchCase> volumes;
  for (const std::string& text : named) {
    Result<BenchCase> parsed = ParseBenchCase(text, false);
    if (!parsed.ok()) throw Failure(Status(parsed.status().code(), "--volume: " + parsed.status().message()));
    volumes.push_back(*std::move(parsed));
  }
  const BenchCase brain = BrainCase();
  std::error_code error;
  if (volumes.empty() && std::filesystem::exists(std::get<std::string>(brain.volume), error)) volumes.push_back(brain);
  return volumes;
}

}  // namespace slabstream
