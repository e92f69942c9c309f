#include "laboratory/cli/laboratory_commands.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <iostream>
#include <limits>
#include <memory>

#include "client/cli/option_groups.h"
#include "client/movie/turntable.h"
#include "common/renderers/registry.h"
#include "common/renderers/sampling_rate.h"
#include "laboratory/bench/bench.h"
#include "laboratory/experiments/experiment.h"
#include "laboratory/experiments/run_experiment.h"
#include "laboratory/measure/replay.h"

namespace slabstream {
namespace {

void DeclareBench(const CommandLine& line) {
  CLI::App* sub = line.app.add_subcommand("bench", "Measure how fast this machine or a service renders");
  auto options = std::make_shared<BenchOptions>();
  options->command = line.typed;
  options->connection.local_workers = 1;
  sub->add_option("CASE", options->cases,
                  "Standard cases (see --list; default: all), or volume files, as FILE or FILE:TRANSFER; each is rendered on "
                  "turntables of both projections");
  sub->add_flag("--list", options->list, "List the standard cases");
  AddInteger(*sub, "--size", options->size, 1, kMaxBenchSize, "Pixels a side");
  AddInteger(*sub, "--frames", options->frames, 1, kMaxTurntableFrames, "Views in a turn of each projection");
  AddInteger(*sub, "--turns", options->turns, 1, kMaxTurns, "Turns of each projection");
  CLI::Option* workers = AddInteger(*sub, "--workers", options->connection.local_workers, 1, kMaxLocalWorkers, "Workers in this process");
  AddThreads(*sub, options->connection.local_threads, "Render threads of each worker");
  CLI::Option* endpoint = AddService(*sub, options->connection.service)->excludes(workers);
  endpoint->description(
      "Measure the service at this endpoint instead of one in this process; CASE is then a dataset, as NAME or NAME:TRANSFER");
  endpoint->default_str("");
  AddParsed(
      *sub, "--renderer", options->renderer,
      [](const std::string& option, const std::string& text) -> Result<std::optional<const RendererKind*>> {
        const Result<std::size_t> index = ParseChoice(option, text, RendererNames());
        if (!index.ok()) return index.status();
        return std::optional(Renderers()[*index]);
      },
      "Render every case with this renderer instead of its own")
      ->type_name("NAME");
  const RendererParameter rate = SamplingRate();
  NoteRange(sub->add_option_function<std::string>(
                "--" + std::string(rate.name),
                [options, name = std::string(rate.name)](const std::string& text) { options->parameters[name] = text; },
                std::string(rate.purpose) + ", of every case; for renderers that take samples along rays"),
            {rate.least, rate.most})
      ->type_name("NUMBER")
      ->default_str("1 for spheres, otherwise the renderer's own");
  sub->add_option("--json", options->json_path, "Write all figures and the machine as JSON")->type_name("FILE");
  sub->add_option("--pictures", options->pictures_directory, "Write the first view of each projection to DIR, after measuring")
      ->type_name("DIR");
  sub->add_option("--export", options->export_directory, "Measure nothing; write volumes, transfer functions and views for other renderers")
      ->type_name("DIR")
      ->excludes(endpoint);
  sub->callback([options, &run = line.run] {
    if (!options->connection.service.text().empty()) options->connection.local_workers = 0;
    run = [options] { return RunBench(*options); };
  });
}

void DeclareReplay(CLI::App& experiment, std::function<Status()>& run) {
  CLI::App* sub = experiment.add_subcommand("replay", "Simulate recorded frames again, under another policy or on another machine");
  auto options = std::make_shared<ReplayOptions>();
  sub->add_option("FILE", options->trace_path, "A trace that --trace of render or turntable has written")->required();
  sub->add_option("--with", options->changes,
                  "What to change: combine=SCHEME (as --combine takes it), link=NAME or link=NAME:MICROSECONDS,GBIT, workers=N; may be "
                  "repeated. Links" +
                      Explained(LinkPresets()))
      ->type_name("KEY=VALUE")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  sub->callback([options, &run] { run = [options] { return RunReplay(*options, std::cout); }; });
}

// The options of all experiments, which may stand before or after the experiment's name.
void AddCommonOptions(CLI::App& app, ExperimentOptions& options) {
  app.add_option("-o,--output", options.folder, "Folder for the results and all measurements; made if it does not exist")->type_name("DIR");
  app.add_flag("--quick", options.quick, "Take minutes: fewer and smaller sizes, and fewer workers, with repeats enough to rank these");
  AddNumber(app, "--scale", options.scale, {kMinScale, 1}, "Scale the sides of spheres and pictures, to try things out");
  AddInteger(app, "--repeats", options.repeats, 1, kMaxRepeats, "Number of times that everything is measured")
      ->default_str(fmt::format("{}; with --quick {}", kRankingRepeats, kQuickRepeats));
  AddParsed(
      app, "--seed", options.seed,
      [](const std::string& option, const std::string& text) { return ParseInteger(option, text, 0, std::numeric_limits<int>::max()); },
      "Seed of the random order of the trials")
      ->type_name("N")
      ->default_str("1");
  AddRepeated(app, "--volume", options.volumes, "A sparse volume of your own beside the spheres, as FILE or FILE:TRANSFER")
      ->type_name("VOLUME");
  CLI::Option* resume = app.add_flag_callback(
      "--resume", [&options] { options.resume = Resume::kAnyBuild; }, "Continue the run in DIR even if another build or machine began it");
  app.add_flag_callback(
         "--fresh", [&options] { options.resume = Resume::kNever; }, "Start over: delete the contents of DIR")
      ->excludes(resume);
}

void DeclareExperiment(const CommandLine& line) {
  CLI::App* sub = line.app.add_subcommand("experiment", "Compare ways of dividing, combining and streaming, and write the results");
  sub->require_subcommand(0, 1);
  auto options = std::make_shared<ExperimentOptions>();
  options->command = line.typed;
  sub->add_option("NAME", options->name)->group(kHidden);  // of no experiment: the others are subcommands
  sub->add_flag("--list", options->list, "List the experiments");
  AddCommonOptions(*sub, *options);
  for (const Experiment& experiment : Experiments()) {
    CLI::App* one = sub->add_subcommand(std::string(experiment.name), std::string(experiment.purpose));
    if (experiment.takes_file) one->add_option("FILE", options->sweep_file, "What to vary (JSON, docs/experiments.md)");
    if (experiment.declare != nullptr) experiment.declare(*one, options->own);
    AddCommonOptions(*one, *options);
    one->callback([options, &experiment] { options->name = experiment.name; });
  }
  DeclareReplay(*sub, line.run);
  sub->callback([options, &run = line.run] {
    if (run) return;  // replay
    if (options->list) {
      run = [] {
        std::cout << ExperimentList();
        return Status::Ok();
      };
      return;
    }
    if (options->name.empty()) throw CLI::ValidationError("NAME is missing (--list names the experiments)");
    run = [options] { return RunExperiment(*options); };
  });
}

}  // namespace

std::span<const DeclareCommand> LaboratoryCommands() {
  static constexpr DeclareCommand kCommands[] = {DeclareBench, DeclareExperiment};
  return kCommands;
}

}  // namespace slabstream
