// slabstream-laboratory: the commands `bench` and `experiment`. Users type them behind `slabstream`, which becomes this program, so it goes
// by that name.
#include <fmt/format.h>

#include <iostream>
#include <limits>
#include <memory>

#include "client/cli/command_line.h"
#include "client/cli/laboratory.h"
#include "client/cli/option_groups.h"
#include "client/movie/turntable.h"
#include "client/request/values.h"
#include "common/cli/add_option.h"
#include "common/cli/help_formatter.h"
#include "common/cli/program.h"
#include "common/renderers/registry.h"
#include "common/renderers/sampling_rate.h"
#include "laboratory/bench/bench.h"
#include "laboratory/experiments/experiment.h"
#include "laboratory/experiments/run_experiment.h"

namespace slabstream {
namespace {

Command Declared(const CommandLine& line, const LaboratoryCommand& command) {
  return line.app.AddCommand(std::string(command.name), std::string(command.purpose));
}

void DeclareBench(const CommandLine& line) {
  const Command sub = Declared(line, kBenchCommand);
  auto options = std::make_shared<BenchOptions>();
  options->command = line.typed;
  options->connection.local_workers = 1;
  sub.AddTexts("CASE", options->cases,
               "Standard cases (see --list; default: all), or volume files, as FILE or FILE:TRANSFER; each is rendered on "
               "turntables of both projections");
  sub.AddFlag("--list", options->list, "List the standard cases");
  AddInteger(sub, "--size", options->size, 1, kMaxBenchSize, "Pixels a side");
  AddInteger(sub, "--frames", options->frames, 1, kMaxTurntableFrames, "Views in a turn of each projection");
  AddInteger(sub, "--turns", options->turns, 1, kMaxTurns, "Turns of each projection");
  const Option workers = AddInteger(sub, "--workers", options->connection.local_workers, 1, kMaxLocalWorkers, "Workers in this process");
  AddThreads(sub, options->connection.local_threads, "Render threads of each worker");
  const Option endpoint = AddService(sub, options->connection.service).Excludes(workers).Default("");
  endpoint.Description(
      "Measure the service at this endpoint instead of one in this process; CASE is then a dataset, as NAME or NAME:TRANSFER");
  AddParsed(
      sub, "--renderer", options->renderer,
      [](const std::string& option, const std::string& text) -> Result<std::optional<const RendererKind*>> {
        const Result<std::size_t> index = ParseChoice(option, text, RendererNames());
        if (!index.ok()) return index.status();
        return std::optional(Renderers()[*index]);
      },
      "Render every case with this renderer instead of its own")
      .TypeName("NAME");
  const RendererParameter rate = SamplingRate();
  sub.AddOption(
         "--" + std::string(rate.name),
         [options, name = std::string(rate.name)](const std::string&, const std::vector<std::string>& texts) {
           options->parameters[name] = texts.back();
           return Status::Ok();
         },
         std::string(rate.purpose) + ", of every case; for renderers that take samples along rays")
      .Range({rate.least, rate.most})
      .TypeName("NUMBER")
      .Default("1 for spheres, otherwise the renderer's own");
  AddNumber(sub, "--termination", options->termination, {0, kMaxTermination},
            "Skip what lies behind material whose remaining transmittance is below this; for all cases");
  sub.AddOption(
         "--shape",
         [options](const std::string& option, const std::vector<std::string>& texts) {
           Result<ShapeChoice> shape = ParseShape(option, texts.back());
           if (shape.ok()) options->shapes = {*std::move(shape)};
           return shape.status();
         },
         "Show a mesh, lines or points beside the volume, as `slabstream render` does")
      .TypeName("SHAPE");
  sub.AddText("--json", options->json_path, "Write all figures and the machine as JSON").TypeName("FILE");
  sub.AddText("--pictures", options->pictures_directory, "Write the first view of each projection to DIR, after measuring").TypeName("DIR");
  sub.AddText("--export", options->export_directory, "Measure nothing; write volumes, transfer functions and views for other renderers")
      .TypeName("DIR")
      .Excludes(endpoint);
  SetHelpPage(sub, {.examples = {{"slabstream bench head.nii.gz", "How fast this machine renders a volume"}}});
  sub.OnTyped([options, &run = line.run] {
    if (!options->connection.service.text().empty()) options->connection.local_workers = 0;
    run = [options] { return RunBench(*options); };
  });
}

// The options of all experiments, which may stand before or after the experiment's name.
void AddCommonOptions(const Command& app, ExperimentOptions& options) {
  app.AddText("-o,--output", options.folder, "Folder for the results and all measurements; made if it does not exist").TypeName("DIR");
  app.AddFlag("--quick", options.quick, "Take minutes: fewer and smaller sizes, and fewer workers, with repeats enough to rank these");
  AddNumber(app, "--scale", options.scale, {kMinScale, 1}, "Scale the sides of spheres and pictures, to try things out");
  AddInteger(app, "--repeats", options.repeats, 1, kMaxRepeats, "Number of times that everything is measured")
      .Default(fmt::format("{}; with --quick {}", kRankingRepeats, kQuickRepeats));
  AddParsed(
      app, "--seed", options.seed,
      [](const std::string& option, const std::string& text) { return ParseInteger(option, text, 0, std::numeric_limits<int>::max()); },
      "Seed of the random order of the trials")
      .TypeName("N")
      .Default("1");
  AddRepeated(app, "--volume", options.volumes, "A sparse volume of your own beside the spheres, as FILE or FILE:TRANSFER")
      .TypeName("VOLUME");
  const Option resume = app.AddFlag(
      "--resume", [&options] { options.resume = Resume::kAnyBuild; }, "Continue the run in DIR even if another build or machine began it");
  app.AddFlag(
         "--fresh", [&options] { options.resume = Resume::kNever; }, "Start over: delete the contents of DIR")
      .Excludes(resume);
}

void DeclareExperiment(const CommandLine& line) {
  const Command sub = Declared(line, kExperimentCommand);
  sub.TakeCommand(false);
  auto options = std::make_shared<ExperimentOptions>();
  options->command = line.typed;
  sub.AddText("NAME", options->name).Group(kHidden);  // of no experiment: the others are subcommands
  sub.AddFlag("--list", options->list, "List the experiments");
  AddCommonOptions(sub, *options);
  for (const Experiment& experiment : Experiments()) {
    const Command one = sub.AddCommand(std::string(experiment.name), std::string(experiment.purpose));
    if (experiment.takes_file) one.AddText("FILE", options->sweep_file, "What to vary (JSON, docs/experiments.md)");
    if (experiment.declare != nullptr) experiment.declare(one, options->own);
    AddCommonOptions(one, *options);
    one.OnTyped([options, &experiment] { options->name = experiment.name; });
  }
  SetHelpPage(
      sub, {.examples = {{"slabstream experiment paper -o paper --quick", "The tables and figures of the paper on this machine, in short"},
                         {"slabstream experiment combining -o combining", "Schemes to combine images, compared"}}});
  sub.OnTyped([options, &run = line.run] {
    if (options->list) {
      run = [] {
        std::cout << ExperimentList();
        return Status::Ok();
      };
      return;
    }
    run = [options] {
      if (options->name.empty()) return Status::InvalidArgument("NAME is missing (--list names the experiments)");
      return RunExperiment(*options);
    };
  });
}

}  // namespace
}  // namespace slabstream

int main(int argc, char** argv) {
  using namespace slabstream;  // NOLINT(google-build-using-namespace): the program's own
  constexpr DeclareCommand kCommands[] = {DeclareBench, DeclareExperiment};
  return RunMain("slabstream", [&] { return RunCommandLine(argc, argv, kCommands); });
}
