#include "laboratory/experiments/subjects.h"

#include <algorithm>
#include <functional>
#include <iterator>
#include <utility>

#include "common/cli/add_option.h"
#include "common/wire/validate_request.h"
#include "laboratory/experiments/frame_case.h"

namespace slabstream {
namespace {

constexpr int kMostWorkers = 4096;

// `volumes(renderer)` under each renderer that the user named, or once under its own (null).
std::vector<BenchCase> UnderEach(const OwnOptions& own, const std::function<std::vector<BenchCase>(const RendererKind*)>& volumes) {
  std::vector<BenchCase> subjects;
  const auto add = [&](const RendererKind* renderer) {
    for (BenchCase& volume : volumes(renderer)) {
      if (renderer != nullptr) volume.renderer = renderer;
      if (!own.transfers.empty()) volume.transfer = own.transfers.front();
      subjects.push_back(std::move(volume));
    }
  };
  if (own.renderers.empty()) add(nullptr);
  for (const RendererKind* renderer : own.renderers) add(renderer);
  return subjects;
}

std::vector<std::string> NamedIn(const ExperimentOptions& options) {
  std::vector<std::string> named = options.own.cases;
  named.insert(named.end(), options.volumes.begin(), options.volumes.end());
  return named;
}

}  // namespace

void DeclareSubjects(const Command& app, OwnOptions& options, const std::string& workers) {
  app.AddTexts("VOLUME", options.cases,
               "Volumes instead of the standard ones: FILE, FILE:TRANSFER, a case of `slabstream bench --list`, or class1-SIZE, "
               "class2-SIZE or clusters-SIZE, which may end in -OCCUPANCY: clusters-512-0.02");
  AddParsedList(
      app, "--workers", options.workers,
      [](const std::string& option, const std::string& text) { return ParseInteger(option, text, 1, kMostWorkers); },
      "Numbers of workers (default: " + workers + ")");
  AddParsedList(
      app, "--renderer", options.renderers,
      [](const std::string& option, const std::string& text) -> Result<const RendererKind*> {
        const Result<std::size_t> index = ParseChoice(option, text, RendererNames());
        if (!index.ok()) return index.status();
        return Renderers()[*index];
      },
      "How voxels become a picture; every volume is rendered by each (default: splat)");
}

std::vector<BenchCase> SubjectsOf(const ExperimentOptions& options, int size) {
  return UnderEach(options.own, [&](const RendererKind* renderer) -> std::vector<BenchCase> {
    const std::vector<std::string> named = NamedIn(options);
    if (!options.own.cases.empty()) return NamedVolumes("VOLUME", named);
    const RendererKind* const kind = renderer != nullptr ? renderer : &DefaultRenderer();
    std::vector<BenchCase> volumes = {StandardClusters(size, kind)};
    if (!options.quick) volumes.push_back(StandardSphere(SphereClass::kHollow, size, kind));
    if (!options.quick || !named.empty()) std::ranges::move(RealVolumes(named), std::back_inserter(volumes));
    return volumes;
  });
}

std::vector<BenchCase> SubjectsAtService(const ExperimentOptions& options) {
  const std::vector<std::string> named = NamedIn(options);
  if (named.empty()) throw Failure(Status::InvalidArgument("VOLUME is missing: a dataset of the service, as NAME or NAME:TRANSFER"));
  return UnderEach(options.own, [&](const RendererKind*) { return NamedVolumes("VOLUME", named, true); });
}

void CheckSubjects(const std::vector<BenchCase>& subjects, const ViewParameters& view) {
  for (const BenchCase& volume : subjects) OrThrow(Validate(RequestOf({.volume = volume, .size = {1, 1}, .view = view, .policy = {}})));
}

}  // namespace slabstream
