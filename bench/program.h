// The parts that the programs of this folder share: a command line that explains itself like that of `slabstream`, and the volumes and
// views that they are given.
#pragma once

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "client/cli/option_groups.h"
#include "common/cli/add_option.h"
#include "common/cli/program.h"
#include "common/planning/frame_plan.h"
#include "common/renderers/registry.h"
#include "common/volume/occupancy_grid.h"
#include "laboratory/bench/bench_cases.h"

namespace slabstream {

// The program `name`: parses the command line and runs `run`; returns the exit status. For main alone.
int BenchMain(int argc, const char* const* argv, const std::string& name, const std::string& description,
              const std::function<void(const Command&)>& add_options, const std::function<Status()>& run);

// The same with `add_options(app, options)`, which adds the options of the command line, and `run(options)`.
template <class Options>
int BenchMain(int argc, const char* const* argv, const std::string& name, const std::string& description,
              void (*add_options)(const Command& app, Options& options), Status (*run)(const Options& options)) {
  Options options;
  return BenchMain(
      argc, argv, name, description, [&](const Command& app) { add_options(app, options); }, [&] { return run(options); });
}

// A list in one argument: "A,B". `parse` as in AddParsed.
template <class T, class Parse>
Option AddList(const Command& app, const std::string& name, std::vector<T>& target, Parse parse, const std::string& help,
               char separator = ',') {
  const std::string standard = fmt::format("{}", fmt::join(target, std::string(1, separator)));
  return AddParsedList(app, name, target, std::move(parse), help, separator).Default(standard);
}

// For AddList: integers in [min, max].
template <class T = int>
auto Integers(int min, int max) {
  return [min, max](const std::string& option, const std::string& text) -> Result<T> {
    const Result<int> number = ParseInteger(option, text, min, max);
    return number.ok() ? Result<T>(T(*number)) : Result<T>(number.status());
  };
}

// The names in a list such as Decompositions().
template <class Entries>
std::vector<std::string_view> NameList(const Entries& entries) {
  std::vector<std::string_view> names;
  for (const auto& entry : entries) names.push_back(entry.name);
  return names;
}

// --renderer. Null stays if it is not given.
Option AddRenderer(const Command& app, const RendererKind*& target, const std::string& help = "How voxels become a picture");

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
void AddSubjectOptions(const Command& app, SubjectOptions& options);

// `text`: as ParseBenchCase takes it, or "sphere1:N[:PRESET]" or "sphere2:N[:PRESET]", one of the paper's classes. Errors also of
// LoadBenchVolume, ResolveRequest and MakeFrameSetup.
Result<Subject> LoadSubject(const SubjectOptions& options, const std::string& text);

}  // namespace slabstream
