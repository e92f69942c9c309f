// The parts that the programs of this folder share: a command line that explains itself like that of `slabstream`, and the volumes and
// views that they are given.
#pragma once

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "client/cli/option_groups.h"
#include "common/planning/frame_plan.h"
#include "common/renderers/registry.h"
#include "common/volume/occupancy_grid.h"
#include "laboratory/bench/bench_cases.h"

namespace slabstream {

// Parses the command line and runs; returns the exit status. For main alone.
int RunProgram(CLI::App& app, int argc, const char* const* argv, const std::function<Status()>& run);

// A list in one argument: "A,B". CLI11 checks each entry.
template <class T>
CLI::Option* AddList(CLI::App& app, const std::string& name, std::vector<T>& target, const CLI::Validator& check, const std::string& help,
                     char delimiter = ',') {
  return app.add_option(name, target, help)
      ->delimiter(delimiter)
      ->check(check.description(""))
      ->type_name("LIST")
      ->default_str(fmt::format("{}", fmt::join(target, std::string(1, delimiter))));
}

// The names in a list such as Decompositions().
template <class Entries>
std::vector<std::string> NamesOf(const Entries& entries) {
  std::vector<std::string> names;
  for (const auto& entry : entries) names.emplace_back(entry.name);
  return names;
}

// --renderer. Null stays if it is not given.
CLI::Option* AddRenderer(CLI::App& app, const RendererKind*& target, const std::string& help = "How voxels become a picture");

// A volume under a transfer function, and a view of it.
struct Subject {
  std::string name;
  std::shared_ptr<const Volume> volume;
  std::shared_ptr<const VolumeSummary> summary;
  std::shared_ptr<const OccupancyGrid> occupied;
  FrameRequest request;
  FrameSetup setup;  // the request's setup
};

struct SubjectOptions {
  std::vector<std::string> volumes;
  const RendererKind* renderer = &DefaultRenderer();
  int size = 512;  // pixels a side
  double azimuth = 30, elevation = 20, zoom = 1;
};
void AddSubjectOptions(CLI::App& app, SubjectOptions& options);

// `text`: as ParseBenchCase takes it, or "sphere1:N[:PRESET]" or "sphere2:N[:PRESET]", one of the paper's classes. Errors also of
// LoadBenchVolume, ResolveRequest and MakeFrameSetup.
Result<Subject> LoadSubject(const SubjectOptions& options, const std::string& text);

}  // namespace slabstream
