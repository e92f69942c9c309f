#include "laboratory/cli/laboratory_commands.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <iostream>
#include <limits>
#include <memory>
#include <set>
#include <string_view>

#include "client/cli/option_groups.h"
#include "common/renderers/registry.h"
#include "laboratory/bench/bench.h"
#include "laboratory/experiments/run_experiment.h"
#include "laboratory/measure/replay.h"
#include "laboratory/measure/splat_loops.h"

namespace slabstream {
namespace {

void DeclareBench(const CommandLine& line) {
  CLI::App* sub = line.app.add_subcommand("bench", "Measure how fast this machine or a service renders");
  auto options = std::make_shared<BenchOptions>();
  options->command = line.typed;
  options->connection.local_workers = 1;
  sub->add_option(
      "CASE", options->cases,
      "Standard cases (--list shows them; all if none is named), or volume files, as FILE or FILE:TRANSFER; each is rendered on "
      "turntables of both projections");
  sub->add_flag("--list", options->list, "List the standard cases");
  AddInteger(*sub, "--size", options->size, 1, kMaxBenchSize, "Pixels a side");
  AddInteger(*sub, "--frames", options->frames, 1, kMaxTurntableFrames, "Views in a turn of each projection");
  AddInteger(*sub, "--turns", options->turns, 1, kMaxTurns, "Turns of each projection");
  CLI::Option* workers = AddInteger(*sub, "--workers", options->connection.local_workers, 1, kMaxLocalWorkers, "Workers in this process");
  AddThreads(*sub, options->connection.local_threads, "Render threads of each worker");
  CLI::Option* endpoint = AddEndpoint(*sub, options->connection.endpoint)->excludes(workers);
  endpoint->description("Measure the service there instead of one in this process; CASE is then a dataset, as NAME or NAME:TRANSFER");
  endpoint->default_str("");
  AddParsed(
      *sub, "--renderer", options->renderer,
      [](const std::string& option, const std::string& text) -> Result<std::optional<const RendererKind*>> {
        const Result<std::size_t> index = ParseChoice(option, text, RendererNames());
        if (!index.ok()) return index.status();
        return std::optional(Renderers()[*index]);
      },
      "Render every case by this renderer instead of its own")
      ->type_name("NAME");
  sub->add_option("--json", options->json_path, "Write all figures and the machine as JSON")->type_name("FILE");
  sub->add_option("--pictures", options->pictures_directory, "Write the first view of each projection there, after the measuring")
      ->type_name("DIR");
  sub->add_option("--export", options->export_directory, "Measure nothing; write volumes, transfer functions and views for other renderers")
      ->type_name("DIR")
      ->excludes(endpoint);
  sub->callback([options, &run = line.run] {
    if (!options->connection.endpoint.empty()) options->connection.local_workers = 0;
    run = [options] { return RunBench(*options); };
  });
}

void DeclareReplay(CLI::App& experiment, std::function<Status()>& run) {
  CLI::App* sub = experiment.add_subcommand("replay", "Simulate recorded frames again, under another policy or on another machine");
  auto options = std::make_shared<ReplayOptions>();
  sub->add_option("FILE", options->trace_path, "What --trace of render or turntable has written")->required();
  sub->add_option("--with", options->changes,
                  "What is different: combine=SCHEME (as --combine takes it), link=NAME or link=NAME:MICROSECONDS,GBIT, workers=N; may be "
                  "repeated. Links" +
                      Explained(LinkPresets()))
      ->type_name("KEY=VALUE")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  sub->callback([options, &run] { run = [options] { return RunReplay(*options, std::cout); }; });
}

// "3,5,7", ascending and each once in the result.
Result<std::vector<int>> ParseFootprints(const std::string& option, const std::string& text) {
  std::set<int> widths;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const Result<int> width = ParseInteger(option, text.substr(begin, end - begin), kMinFootprint, kMaxFootprint);
    if (!width.ok()) return width.status();
    widths.insert(*width);
    begin = end + 1;
  }
  return std::vector(widths.begin(), widths.end());
}

void DeclareExperiment(const CommandLine& line) {
  CLI::App* sub = line.app.add_subcommand("experiment", "Compare ways of dividing, combining and streaming, and write a report");
  auto options = std::make_shared<ExperimentOptions>();
  options->command = line.typed;
  sub->add_option("NAME", options->name, "Which one\n" + ExperimentList());
  sub->add_option("FILE", options->sweep_file, "For sweep: what to vary (JSON, docs/experiments.md)");
  CLI::Option* output =
      sub->add_option("-o,--output", options->folder, "Folder for the report and all measurements; made if it does not exist")
          ->type_name("DIR");
  sub->add_flag("--quick", options->quick, "Take a tenth of the time: fewer sizes, workers and repeats");
  AddNumber(*sub, "--scale", options->scale, {kMinScale, 1}, "Scale the sides of spheres and pictures, to try things out");
  AddInteger(*sub, "--repeats", options->repeats, 1, kMaxRepeats, "How often everything is measured")->default_str("the experiment's own");
  AddParsed(
      *sub, "--seed", options->seed,
      [](const std::string& option, const std::string& text) { return ParseInteger(option, text, 0, std::numeric_limits<int>::max()); },
      "Seed of the random order of the trials")
      ->type_name("N")
      ->default_str("1");
  AddParsed(*sub, "--footprints", options->footprints, ParseFootprints,
            fmt::format("For paper: diameters of the footprints of figure 8b in pixels, each from {} to {}, such as 3,5,7", kMinFootprint,
                        kMaxFootprint))
      ->type_name("K,...")
      ->default_str("3,5,9,13,17,25");
  AddRepeated(*sub, "--volume", options->volumes, "A sparse volume of your own, as FILE or FILE:TRANSFER")->type_name("VOLUME");
  CLI::Option* resume = sub->add_flag_callback(
      "--resume", [options] { options->resume = Resume::kAnyBuild; }, "Continue what DIR holds even if another build or machine began it");
  sub->add_flag_callback(
         "--fresh", [options] { options->resume = Resume::kNever; }, "Begin again: delete what DIR holds")
      ->excludes(resume);
  sub->add_flag("--list", options->list, "List the experiments");
  DeclareReplay(*sub, line.run);
  sub->callback([options, &run = line.run, output, sub] {
    if (!sub->get_subcommands().empty()) return;
    if (options->list) {
      run = [] {
        std::cout << ExperimentList();
        return Status::Ok();
      };
      return;
    }
    if (options->name.empty()) throw CLI::ValidationError("NAME is missing (--list names the experiments)");
    if (output->count() == 0) throw CLI::RequiredError("--output");
    run = [options] { return RunExperiment(*options); };
  });
}

}  // namespace

std::span<const DeclareCommand> LaboratoryCommands() {
  static constexpr DeclareCommand kCommands[] = {DeclareBench, DeclareExperiment};
  return kCommands;
}

}  // namespace slabstream
