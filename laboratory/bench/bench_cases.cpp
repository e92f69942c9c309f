#include "laboratory/bench/bench_cases.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <regex>
#include <utility>

#include "client/cli/input_volume.h"
#include "client/request/volume_argument.h"
#include "common/base/did_you_mean.h"
#include "common/renderers/sampling_rate.h"
#include "data/open/open_source.h"

namespace slabstream {
namespace {

constexpr double kHollowOccupancy = 0.05, kFilledOccupancy = 0.40;

// From half way to the values of occupied voxels (128 ... 255) on, everything is as opaque and coloured as those: renderers that
// interpolate before they classify then show the same surface, without a dark rim. Values rise along x, and the hue with them, so that a
// mirrored picture is noticed.
TransferFunction SphereTransfer(double opacity) {
  constexpr Rgb kWarm = {0.90F, 0.72F, 0.55F}, kCool = {0.65F, 0.72F, 0.85F};
  return {{{0, kWarm}, {128, kWarm}, {255, kCool}}, {{0, 0}, {64, opacity}, {255, opacity}}};
}

// A soft surface that is solid within a few voxels, in the colours of tissue.
TransferFunction BrainTransfer() {
  return {{{0, {0.30F, 0.16F, 0.12F}}, {60, {0.62F, 0.38F, 0.30F}}, {120, {0.86F, 0.68F, 0.58F}}, {255, {1, 0.97F, 0.92F}}},
          {{0, 0}, {40, 0}, {90, 0.35}, {255, 0.6}}};
}

double StandardOccupancy(SphereClass sphere_class) { return sphere_class == SphereClass::kHollow ? kHollowOccupancy : kFilledOccupancy; }

// "class1-256"; an occupancy other than the standard one is part of the name.
std::string SphereName(const SphereRequest& sphere) {
  const std::string name = fmt::format("class{}-{}", int(sphere.sphere_class), sphere.size);
  return sphere.occupancy == StandardOccupancy(sphere.sphere_class) ? name : fmt::format("{}-{:g}", name, sphere.occupancy);
}

std::string ClusterName(const ClusterRequest& clusters) {
  const ClusterRequest standard{.size = clusters.size};
  std::string name = fmt::format("clusters-{}", clusters.size);
  if (clusters.occupancy != standard.occupancy) name += fmt::format("-{:g}", clusters.occupancy);
  if (clusters.balls != standard.balls) name += fmt::format("-of-{}", clusters.balls);
  if (clusters.seed != standard.seed) name += fmt::format("-seed-{}", clusters.seed);
  return clusters.time == standard.time ? name : name + fmt::format("-at-{:g}", clusters.time);
}

// "volumes/head.nii.gz" is "head", as in the catalogue of a service.
std::string Stem(const std::string& path) {
  const std::filesystem::path name = std::filesystem::path(path).lexically_normal().filename();
  const bool two_endings = name.extension() == ".gz" || name.stem().extension() == ".ome";  // .nii.gz, .ome.zarr
  const std::filesystem::path stem = two_endings ? name.stem().stem() : name.stem();
  return stem.empty() ? "volume" : stem.string();
}

bool SamplesAlongRays(const RendererKind& renderer) {
  return std::ranges::any_of(renderer.parameters(), [](const RendererParameter& each) { return each.name == SamplingRate().name; });
}

std::string CaseName(const RendererKind& renderer, const std::string& dataset) {
  return &renderer == &DefaultRenderer() ? dataset : std::string(renderer.name()) + "-" + dataset;
}

// One sample a voxel length, as other programs take by default.
ParameterTexts StandardParameters(const RendererKind& renderer) {
  return SamplesAlongRays(renderer) ? ParameterTexts{{std::string(SamplingRate().name), "1"}} : ParameterTexts{};
}

BenchCase MadeHere(const RendererKind* renderer, std::variant<SphereRequest, ClusterRequest, GridRequest, std::string> volume,
                   const std::string& dataset, const std::string& what, double opacity) {
  const bool points = HasDepth(renderer->format());
  return {.name = CaseName(*renderer, dataset) + (opacity == kOpaqueSphere && !points ? "-opaque" : ""),
          .purpose = fmt::format("{}, opacity {:g} a voxel, {}", what, opacity, renderer->title()),
          .dataset = dataset,
          .volume = std::move(volume),
          .renderer = renderer,
          .transfer = {SphereTransfer(opacity)},
          .opacity = opacity,
          .parameters = StandardParameters(*renderer)};
}

// "class1-300", "clusters-512-0.02". Nothing: the text is no such name.
std::optional<BenchCase> ParseMadeHere(const std::string& text) {
  static const std::regex kName("(class1|class2|clusters)-([0-9]{1,5})(-(0\\.[0-9]{1,6}))?");
  std::smatch parts;
  if (!std::regex_match(text, parts, kName)) return std::nullopt;
  const int size = std::stoi(parts[2]);
  if (parts[1] == "clusters") {
    ClusterRequest clusters{.size = size};
    if (parts[4].matched) clusters.occupancy = std::stod(parts[4]);
    return ClusterCase(clusters, kTranslucentSphere);
  }
  const SphereClass sphere_class = parts[1] == "class1" ? SphereClass::kHollow : SphereClass::kFilled;
  return SphereCase({sphere_class, size, parts[4].matched ? std::stod(parts[4]) : StandardOccupancy(sphere_class)}, kTranslucentSphere);
}

}  // namespace

TransferFunction HalfShown(double opacity) {
  TransferFunction transfer = SphereTransfer(opacity);
  transfer.opacities = {{0, 0}, {191, 0}, {192, opacity}, {255, opacity}};
  return transfer;
}

BenchCase StandardSphere(SphereClass sphere_class, int size, const RendererKind* renderer) {
  return SphereCase({sphere_class, size, StandardOccupancy(sphere_class)},
                    HasDepth(renderer->format()) ? kOpaqueSphere : kTranslucentSphere, renderer);
}

BenchCase SphereCase(const SphereRequest& sphere, double opacity, const RendererKind* renderer) {
  const bool hollow = sphere.sphere_class == SphereClass::kHollow;
  const std::string what =
      fmt::format("{} sphere, {} voxels a side, {:g} % occupied", hollow ? "hollow" : "filled", sphere.size, sphere.occupancy * 100);
  return MadeHere(renderer, sphere, SphereName(sphere), what, opacity);
}

BenchCase ClusterCase(const ClusterRequest& clusters, double opacity, const RendererKind* renderer) {
  const std::string what =
      fmt::format("{} balls, {} voxels a side, {:g} % occupied", clusters.balls, clusters.size, clusters.occupancy * 100);
  return MadeHere(renderer, clusters, ClusterName(clusters), what, opacity);
}

BenchCase GridCase(const GridRequest& grid) {
  const std::string dataset = fmt::format("grid-{}-of-{}", grid.size, grid.cells);
  return MadeHere(FindRenderer("slice"), grid, dataset, fmt::format("a ball in a grid of {0} x {0} x {0} hexahedra", grid.cells),
                  kTranslucentSphere);
}

BenchCase StandardClusters(int size, const RendererKind* renderer) {
  return ClusterCase({.size = size}, HasDepth(renderer->format()) ? kOpaqueSphere : kTranslucentSphere, renderer);
}

BenchCase BrainCase(const RendererKind* renderer) {
  return {.name = CaseName(*renderer, "brain"),
          .purpose = fmt::format("the MRI brain of Debian's package mricron-data, {}", renderer->title()),
          .dataset = "brain",
          .volume = std::string("/usr/share/mricron/templates/ch2better.nii.gz"),
          .renderer = renderer,
          .transfer = {BrainTransfer()},
          .parameters = StandardParameters(*renderer)};
}

const std::vector<BenchCase>& StandardBenchCases() {
  static const std::vector<BenchCase> cases = {
      StandardSphere(SphereClass::kHollow, 256),
      StandardSphere(SphereClass::kFilled, 256),
      SphereCase({SphereClass::kHollow, 256, kHollowOccupancy}, kOpaqueSphere),
      SphereCase({SphereClass::kFilled, 256, kFilledOccupancy}, kOpaqueSphere),
      StandardSphere(SphereClass::kHollow, 512),
      StandardSphere(SphereClass::kHollow, 256, FindRenderer("zbuffer")),
      StandardSphere(SphereClass::kHollow, 256, FindRenderer("raycast")),
      StandardSphere(SphereClass::kFilled, 256, FindRenderer("raycast")),
      StandardSphere(SphereClass::kHollow, 256, FindRenderer("shear")),
      StandardSphere(SphereClass::kFilled, 256, FindRenderer("shear")),
      StandardSphere(SphereClass::kHollow, 256, FindRenderer("mip")),
      StandardSphere(SphereClass::kFilled, 256, FindRenderer("mip")),
      SphereCase({SphereClass::kHollow, 256, kHollowOccupancy}, kOpaqueSphere, FindRenderer("raycast")),
      SphereCase({SphereClass::kFilled, 256, kFilledOccupancy}, kOpaqueSphere, FindRenderer("raycast")),
      BrainCase(FindRenderer("raycast")),
      BrainCase(),
  };
  return cases;
}

Result<BenchCase> ParseBenchCase(const std::string& text, bool at_service) {
  for (const BenchCase& standard : StandardBenchCases()) {
    if (standard.name == text) return standard;
  }
  if (std::optional<BenchCase> made = ParseMadeHere(text)) return *std::move(made);
  Result<VolumeArgument> argument = ParseVolumeArgument("CASE", text, !at_service);
  if (!argument.ok()) return argument.status();
  BenchCase bench_case;
  bench_case.volume = argument->volume;
  bench_case.dataset = argument->volume;
  if (!at_service) {
    const Result<SourceText> source = ParseSourceText(argument->volume);
    if (!source.ok()) return Status(source.status().code(), "CASE " + source.status().message());
    const Status known = CheckVolume(source->path, source->options);
    if (known.code() == StatusCode::kNotFound) {
      return Status::NotFound(fmt::format("CASE '{}' is neither a file nor a standard case (--list names them){}", text,
                                          DidYouMean(text, StandardBenchCases())));
    }
    if (!known.ok()) return Status(known.code(), "CASE " + known.message());
    bench_case.dataset = Stem(source->path);
  }
  bench_case.name = bench_case.dataset + "-" + (argument->transfer ? Stem(argument->transfer_text) : "auto");
  if (argument->transfer) bench_case.transfer.choice = *std::move(argument->transfer);
  return bench_case;
}

std::optional<int> SideOf(const BenchCase& bench_case) {
  if (const auto* sphere = std::get_if<SphereRequest>(&bench_case.volume)) return sphere->size;
  if (const auto* clusters = std::get_if<ClusterRequest>(&bench_case.volume)) return clusters->size;
  if (const auto* grid = std::get_if<GridRequest>(&bench_case.volume)) return grid->size;
  return std::nullopt;
}

Result<std::shared_ptr<const Volume>> LoadBenchVolume(const BenchCase& bench_case) {
  if (const auto* path = std::get_if<std::string>(&bench_case.volume)) {
    Result<LoadedVolume> loaded = ReadInputVolume(*path);
    if (!loaded.ok()) return loaded.status();
    return std::move(loaded->volume);
  }
  const auto make = [&]() -> Result<Volume> {
    if (const auto* sphere = std::get_if<SphereRequest>(&bench_case.volume)) return MakeSphere(*sphere);
    if (const auto* clusters = std::get_if<ClusterRequest>(&bench_case.volume)) return MakeClusters(*clusters);
    return MakeBallGrid(std::get<GridRequest>(bench_case.volume));
  };
  Result<Volume> made = make();
  if (!made.ok()) return made.status();
  return std::make_shared<const Volume>(*std::move(made));
}

ViewParameters BenchView(Projection projection, int index, int frames) {
  return {.projection = projection,
          .azimuth_degrees = 360.0 * index / frames,
          .elevation_degrees = kBenchElevationDegrees,
          .zoom = kBenchZoom,
          .fov_degrees = kBenchFovDegrees};
}

FrameRequest BenchRequest(const BenchCase& bench_case, const ViewParameters& view, ImageSize size) {
  FrameRequest request;
  request.dataset = bench_case.dataset;
  request.renderer = bench_case.renderer->name();
  request.size = size;
  request.view = view;
  request.transfer = bench_case.transfer;
  request.parameters = bench_case.parameters;
  // As other programs draw the cells of grids, whom bench/against_vtk compares with.
  if (bench_case.renderer->Can(Ability::kCells)) request.shading.model = ShadingModel::kNone;
  return request;
}

}  // namespace slabstream
