#include "laboratory/experiments/volumes.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <span>

#include "common/mesh/mesh_part.h"
#include "common/mesh/summarize_cells.h"
#include "common/planning/count_drawn.h"
#include "common/planning/frame_plan.h"
#include "common/planning/resolved_request.h"
#include "common/renderers/renderer_kind.h"
#include "data/volume_io/read_options.h"

namespace slabstream {

namespace {

Json SphereJson(const SphereRequest& sphere) {
  const auto& [sphere_class, size, occupancy] = sphere;
  return {{"class", int(sphere_class)}, {"size", size}, {"occupancy", occupancy}};
}

Json ClusterJson(const ClusterRequest& clusters) {
  const auto& [size, occupancy, balls, seed, time] = clusters;
  return {{"clusters", balls}, {"size", size}, {"occupancy", occupancy}, {"seed", seed}, {"time", time}};
}

// What is made here; null: the volume is read from a file.
Json MadeJson(const BenchCase& volume) {
  if (const auto* sphere = std::get_if<SphereRequest>(&volume.volume)) return SphereJson(*sphere);
  if (const auto* clusters = std::get_if<ClusterRequest>(&volume.volume)) return ClusterJson(*clusters);
  if (const auto* grid = std::get_if<GridRequest>(&volume.volume)) return {{"grid", grid->cells}, {"size", grid->size}};
  return {};
}

// `source`: a path, with options for reading it or without.
std::string CanonicalSource(const std::string& source) {
  const Result<SourceText> parsed = ParseSourceText(source);
  std::error_code error;
  const std::filesystem::path canonical = parsed.ok() ? std::filesystem::canonical(parsed->path, error) : "";
  return !parsed.ok() || error ? source : canonical.string() + source.substr(parsed->path.size());  // the reader reports the error
}

std::string DigestOf(std::span<const std::byte> bytes) { return DigestText({reinterpret_cast<const char*>(bytes.data()), bytes.size()}); }

Json FileJson(const std::string& path, const Volume& volume) {
  const auto& [geometry, type, mapping] = volume.description;
  const auto& [size, spacing, orientation, stretch] = geometry;
  const auto& [scale, offset] = mapping;
  const auto numbers = [](const Vec3& v) { return Json::array({v.x, v.y, v.z}); };
  const AlignedVector<std::byte>& bytes = volume.block.bytes;
  Json json = {{"file", path},
               {"voxels", Json::array({size.x, size.y, size.z})},
               {"spacing", numbers(spacing)},
               {"axes", Json::array({numbers(orientation.axes[0]), numbers(orientation.axes[1]), numbers(orientation.axes[2])})},
               {"bytes", bytes.size()},
               {"type", int(type)},
               {"mapping", Json::array({scale, offset})},
               {"digest", DigestOf(bytes)}};
  if (volume.cells != nullptr) json["cells"] = DigestOf(EncodeMesh(*volume.cells));
  return json;
}

// What a case's volume is made or read from: cases of one source have one volume.
std::string SourceOf(const BenchCase& volume) {
  const auto* path = std::get_if<std::string>(&volume.volume);
  return path != nullptr ? CanonicalSource(*path) : MadeJson(volume).dump();
}

}  // namespace

VolumeInUse VolumeCache::Get(const BenchCase& volume) {
  std::string source = SourceOf(volume);
  if (const VolumeInUse* held = held_.Find(source)) return *held;
  std::shared_ptr<const Volume> loaded = OrThrow(LoadBenchVolume(volume));
  if (std::holds_alternative<std::string>(volume.volume)) {
    const Json identity = FileJson(source, *loaded);
    if (read_.emplace(source, identity).first->second != identity) {
      throw Failure(Status::InvalidArgument(fmt::format("'{}' has changed since this run began", source)));
    }
  }
  auto summary = std::make_shared<const VolumeSummary>(SummaryOf(*loaded));
  const std::size_t bytes = loaded->block.bytes.size();
  const VolumeInUse& held = held_.Put(std::move(source), {std::move(loaded), std::move(summary)}, bytes);
  held_.DropBeyond(budget_bytes_ + bytes);  // the budget is for those that are not in use
  return held;
}

Json VolumeCache::Identity(const BenchCase& volume) {
  if (Json made = MadeJson(volume); !made.is_null()) return made;
  const std::string source = SourceOf(volume);
  if (!read_.contains(source)) (void)Get(volume);
  return read_.at(source);
}

std::shared_ptr<const OccupancyGrid> VolumeCache::Occupied(const BenchCase& volume) {
  std::shared_ptr<const OccupancyGrid>& grid = occupied_[{Identity(volume).dump() + TransferJson(volume.transfer).dump(), volume.renderer}];
  if (grid != nullptr) return grid;
  const VolumeInUse in_use = Get(volume);
  const VolumeSummary& summary = *in_use.summary;
  if (Status status = CheckHasWhatIsDrawn(*volume.renderer, volume.dataset, summary); !status.ok()) throw Failure(std::move(status));
  const TransferFunction transfer = OrThrow(ResolveTransfer(volume.transfer, summary));
  grid = std::make_shared<const OccupancyGrid>(CountDrawn(*in_use.volume, summary, *volume.renderer, transfer));
  return grid;
}

Json ColumnsOf(const BenchCase& volume) {
  Json columns = {{"volume", volume.dataset}};
  if (const Json made = MadeJson(volume); !made.is_null()) {
    columns["n"] = made["size"];
    if (made.contains("occupancy")) columns["occupancy"] = made["occupancy"];
  }
  return columns;
}

std::vector<BenchCase> NamedVolumes(const std::string& option, const std::vector<std::string>& named, bool at_service) {
  std::vector<BenchCase> volumes;
  for (const std::string& text : named) {
    Result<BenchCase> parsed = ParseBenchCase(text, at_service);
    if (!parsed.ok()) throw Failure(Status(parsed.status().code(), option + ": " + parsed.status().message()));
    volumes.push_back(*std::move(parsed));
    BenchCase& volume = volumes.back();
    const std::string stem = volume.dataset;
    const auto is_taken = [&](const BenchCase& other) { return &other != &volume && other.dataset == volume.dataset; };
    for (int number = 2; std::ranges::any_of(volumes, is_taken); ++number) volume.dataset = fmt::format("{}-{}", stem, number);
  }
  return volumes;
}

std::vector<BenchCase> RealVolumes(const std::vector<std::string>& named) {
  std::vector<BenchCase> volumes = NamedVolumes("--volume", named);
  const BenchCase brain = BrainCase();
  std::error_code error;
  if (volumes.empty() && std::filesystem::exists(std::get<std::string>(brain.volume), error)) volumes.push_back(brain);
  return volumes;
}

}  // namespace slabstream
