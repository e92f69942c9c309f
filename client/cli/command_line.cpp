#include "client/cli/command_line.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <functional>
#include <iostream>
#include <limits>
#include <string>
#include <string_view>
#include <thread>

#include "client/cli/commands.h"
#include "client/cli/cores.h"
#include "client/cli/files.h"
#include "client/cli/option_groups.h"
#include "laboratory/experiments/run_experiment.h"
#include "laboratory/measure/replay.h"
#include "common/base/log.h"
#include "common/kernels/simd_target.h"
#include "common/planning/policy_names.h"
#include "common/transport/endpoint.h"
#include "coordinator/tuning/service_machine.h"

namespace slabstream {
namespace {

constexpr int kExitInterrupted = 130;  // 128 + SIGINT, as shells count

// Every option's value, in one place that outlives the parse.
struct AllOptions {
  RenderOptions render;
  TurntableOptions turntable;
  BenchOptions bench;
  ExperimentOptions experiment;
  ReplayOptions replay;
  InfoOptions info;
  SphereOptions sphere;
  UpOptions up;
  DownOptions down;
  StatusOptions status;
};

using Command = std::function<Status()>;

void DeclareRender(CLI::App& app, RenderOptions& options, Command& command) {
  CLI::App* sub = app.add_subcommand("render", "Render one picture of a volume");
  AddFrameOptions(*sub, options.frame);
  sub->add_option("-o,--output", options.output, "The picture: .png or .exr")->required()->type_name("FILE");
  sub->add_flag("--previews", options.frame.request.previews, "Write the picture anew after each group, nearest first (see --groups)");
  sub->callback([&] { command = [&] { return RunRender(options); }; });
}

void DeclareTurntable(CLI::App& app, TurntableOptions& options, Command& command) {
  CLI::App* sub = app.add_subcommand("turntable", "Render a full turn about the volume's z axis, frame after frame");
  AddFrameOptions(*sub, options.frame);
  AddParsed(
      *sub, "-o,--output", options.output,
      [](const std::string& option, const std::string& text) { return FramePattern::Parse(option, text); },
      "The pictures: a name with a place for the number, such as 'frame_%04d.png'")
      ->required()
      ->type_name("PATTERN");
  AddInteger(*sub, "--frames", options.frames, 1, kMaxTurntableFrames, "How many")->required();
  AddInteger(*sub, "--turns", options.turns, 1, kMaxTurns, "Turns of the table that they are spread over");
  AddInteger(*sub, "--in-flight", options.in_flight, 1, kMaxInFlight, "Frames that are asked for at the same time");
  sub->callback([&] { command = [&] { return RunTurntable(options); }; });
}

void DeclareBench(CLI::App& app, BenchOptions& options, Command& command) {
  CLI::App* sub = app.add_subcommand("bench", "Measure the standard cases, or volumes of your own, on turntables of both projections");
  options.connection.local_workers = 1;
  sub->add_option("CASE", options.cases, "Standard cases (see --list; default: all), or volumes: FILE[:PRESET|:FILE.json]");
  sub->add_flag("--list", options.list, "Tell which standard cases there are");
  AddInteger(*sub, "--size", options.size, 1, kMaxBenchSize, "Pixels a side");
  AddInteger(*sub, "--frames", options.frames, 1, kMaxTurntableFrames, "Views of a turn of each projection");
  AddInteger(*sub, "--turns", options.turns, 1, kMaxTurns, "Turns of each projection");
  CLI::Option* workers = AddInteger(*sub, "--workers", options.connection.local_workers, 1, kMaxLocalWorkers, "Workers in this process");
  AddThreads(*sub, options.connection.local_threads, "Render threads of each worker");
  CLI::Option* endpoint = AddEndpoint(*sub, options.connection.endpoint)->excludes(workers);
  endpoint->description("Instead of one in this process, measure the service there; CASE is then NAME[:PRESET|:FILE.json] of a dataset");
  AddParsed(
      *sub, "--renderer", options.renderer,
      [](const std::string& option, const std::string& text) -> Result<std::optional<RendererKind>> {
        const Result<std::size_t> index = ParseChoice(option, text, std::array<std::string_view, 2>{"splat", "zbuffer"});
        if (!index.ok()) return index.status();
        return std::optional(*index == 0 ? RendererKind::kSplat : RendererKind::kZBuffer);
      },
      "Instead of that of each case")
      ->type_name("splat|zbuffer");
  sub->add_option("--json", options.json_path, "Write all figures and the machine as JSON")->type_name("FILE");
  sub->add_option("--pictures", options.pictures_directory, "Write the first view of each projection there, after the measuring")
      ->type_name("DIR");
  sub->add_option("--export", options.export_directory, "Measure nothing: write volumes, transfer functions and views for other renderers")
      ->type_name("DIR")
      ->excludes(endpoint);
  sub->callback([&] {
    if (!options.connection.endpoint.empty()) options.connection.local_workers = 0;
    command = [&] { return RunBench(options); };
  });
}

std::string LinkList() {
  std::string list;
  for (const LinkPreset& preset : LinkPresets()) list += fmt::format("  {:10} {}\n", preset.name, preset.purpose);
  return list;
}

void DeclareReplay(CLI::App& experiment, ReplayOptions& options, Command& command) {
  CLI::App* sub = experiment.add_subcommand("replay", "What another policy or machine would have made of frames that were recorded");
  sub->add_option("FILE", options.trace_path, "Written by --trace of render or turntable")->required();
  sub->add_option("--with", options.changes,
                  "What is to be different: combine=SCHEME (as --combine), link=NAME[:MICROSECONDS,GBIT], workers=N; may be given several "
                  "times.\nLinks:\n" +
                      LinkList())
      ->type_name("KEY=VALUE")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  sub->callback([&options, &command] { command = [&options] { return RunReplay(options, std::cout); }; });
}

void DeclareExperiment(CLI::App& app, ExperimentOptions& options, ReplayOptions& replay, Command& command) {
  CLI::App* sub = app.add_subcommand("experiment", "Compare ways of dividing, combining and streaming, and write a report");
  sub->add_option("NAME", options.name, "Which one:\n" + ExperimentList());
  sub->add_option("FILE", options.sweep_file, "Of sweep: what to vary (JSON, docs/experiments.md)");
  CLI::Option* output =
      sub->add_option("-o,--output", options.folder, "The report and all that was measured; made if need be")->type_name("DIR");
  sub->add_flag("--quick", options.quick, "A tenth of the time: fewer sizes, workers and repeats");
  AddNumber(*sub, "--scale", options.scale, {kMinScale, 1}, "Of the sides of spheres and pictures, to try things out");
  AddInteger(*sub, "--repeats", options.repeats, 1, kMaxRepeats, "Of every measurement (default: the experiment's own)");
  AddParsed(
      *sub, "--seed", options.seed,
      [](const std::string& option, const std::string& text) { return ParseInteger(option, text, 0, std::numeric_limits<int>::max()); },
      "Of the order of the trials")
      ->default_str("1");
  sub->add_option("--volume", options.volumes, "A sparse volume of your own, FILE[:PRESET|:FILE.json]; may be given several times")
      ->type_name("FILE")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  CLI::Option* resume = sub->add_flag_callback(
      "--resume", [&options] { options.resume = Resume::kAnyBuild; }, "Continue what DIR holds even if another build or machine began it");
  sub->add_flag_callback(
         "--fresh", [&options] { options.resume = Resume::kNever; }, "Forget what DIR holds")
      ->excludes(resume);
  sub->add_flag("--list", options.list, "Tell which experiments there are");
  DeclareReplay(*sub, replay, command);
  sub->callback([&options, &command, output, sub] {
    if (!sub->get_subcommands().empty()) return;
    if (options.list) {
      command = [] {
        std::cout << ExperimentList();
        return Status::Ok();
      };
      return;
    }
    if (options.name.empty()) throw CLI::ValidationError("NAME is missing (--list names the experiments)");
    if (output->count() == 0) throw CLI::RequiredError("--output");
    command = [&options] { return RunExperiment(options); };
  });
}

void DeclareInfo(CLI::App& app, InfoOptions& options, Command& command) {
  CLI::App* sub = app.add_subcommand("info", "Tell what a volume file holds");
  sub->add_option("SOURCE", options.path, "A volume file")->required();
  AddTransferOptions(*sub, options.transfer);
  sub->add_flag("--json", options.json, "As JSON");
  sub->callback([&] { command = [&] { return RunInfo(options); }; });
}

void DeclareSphere(CLI::App& app, SphereOptions& options, Command& command) {
  CLI::App* sub = app.add_subcommand("sphere", "Make one of the two test volumes of Yagel and Machiraju");
  AddParsed(
      *sub, "--class", options.request.sphere_class,
      [](const std::string& option, const std::string& text) -> Result<SphereClass> {
        const Result<int> number = ParseInteger(option, text, 1, 2);
        if (!number.ok()) return number.status();
        return SphereClass(*number);
      },
      "1: hollow, 2: filled")
      ->required()
      ->type_name("1|2");
  AddInteger(*sub, "--size", options.request.size, 2, 4096, "Voxels a side")->required();
  AddNumber(*sub, "--occupancy", options.request.occupancy, {0, 1, true}, "Share of voxels that are not empty");
  sub->add_option("-o,--output", options.output, "The volume: .nrrd, .mhd or .mha")->required()->type_name("FILE");
  sub->callback([&] { command = [&] { return RunSphere(options); }; });
}

void DeclareUp(CLI::App& app, UpOptions& options, Command& command) {
  CLI::App* sub = app.add_subcommand("up", "Start a coordinator and workers on this machine");
  options.workers = std::min(CoreCount(), kMaxUpWorkers);
  options.listen = "tcp://127.0.0.1:7420";
  AddInteger(*sub, "--workers", options.workers, 1, kMaxUpWorkers, "Worker processes (default: one a core)");
  AddThreads(*sub, options.threads, "Render threads of each worker");
  sub->add_option("--data", options.data, "Volumes to serve: NAME=PATH, or a directory whose files are named after themselves")
      ->type_name("NAME=PATH|DIR")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  AddParsed(
      *sub, "--listen", options.listen,
      [](const std::string& option, const std::string& text) -> Result<std::string> {
        const Result<Endpoint> endpoint = ParseEndpoint(text, true);
        if (!endpoint.ok()) return Status::InvalidArgument(option + " " + endpoint.status().message());
        return text;
      },
      "Where clients reach the service; tcp://127.0.0.1:* takes any free port")
      ->type_name("ENDPOINT")
      ->default_str(options.listen);
  sub->add_flag(
         "--compress{on}", options.compress,
         "Pack images with zstd: =auto (default) between workers where the link is slower than that, =on also pictures for clients behind "
         "a slow tunnel, =off never")
      ->check(CLI::IsMember({"auto", "on", "off"}));
  AddParsed(
      *sub, "--link", options.link,
      [](const std::string& option, const std::string& text) -> Result<std::string> {
        const Result<LinkModel> link = ParseLink(option, text);
        if (!link.ok()) return link.status();
        return text;
      },
      fmt::format("Between workers that join from other hosts, for policies that are '{}'\n{}", kAutomatic, LinkList()))
      ->type_name("NAME[:MICROSECONDS,GBIT]")
      ->default_str(kDefaultLink);
  sub->add_flag("--detach", options.detach, "Return when the service is ready; `slabstream down` ends it");
  sub->callback([&] { command = [&] { return RunUp(options); }; });
}

void DeclareDown(CLI::App& app, DownOptions& options, Command& command) {
  CLI::App* sub = app.add_subcommand("down", "End a service that `up` started");
  AddEndpoint(*sub, options.endpoint);
  sub->callback([&] { command = [&] { return RunDown(options); }; });
}

void DeclareStatus(CLI::App& app, StatusOptions& options, Command& command) {
  CLI::App* sub = app.add_subcommand("status", "Tell what a service does: workers, datasets, frames");
  AddEndpoint(*sub, options.endpoint);
  sub->add_flag("--json", options.json, "As JSON");
  sub->callback([&] { command = [&] { return RunStatus(options); }; });
}

int ExitStatus(const Status& status) {
  switch (status.code()) {
    case StatusCode::kOk: return 0;
    case StatusCode::kInvalidArgument:
    case StatusCode::kNotFound: return 2;
    case StatusCode::kCancelled: return kExitInterrupted;
    default: return 1;
  }
}

std::string SubcommandNames(const CLI::App& app) {
  std::string names;
  for (const CLI::App* sub : app.get_subcommands(nullptr)) names += (names.empty() ? "" : ", ") + sub->get_name();
  return names;
}

int Complain(const std::string& who, std::string message, int exit_status) {
  std::replace(message.begin(), message.end(), '\n', ' ');
  std::cerr << who << ": " << message << std::endl;
  return exit_status;
}

}  // namespace

int RunCommandLine(int argc, const char* const* argv) {
  CLI::App app("Slabstream renders volumes on CPUs, by any number of worker processes.", "slabstream");
  AllOptions options;
  Command command;
  options.bench.command = options.experiment.command = fmt::format("{}", fmt::join(argv, argv + argc, " "));
  DeclareRender(app, options.render, command);
  DeclareTurntable(app, options.turntable, command);
  DeclareBench(app, options.bench, command);
  DeclareExperiment(app, options.experiment, options.replay, command);
  DeclareInfo(app, options.info, command);
  DeclareSphere(app, options.sphere, command);
  DeclareUp(app, options.up, command);
  DeclareDown(app, options.down, command);
  DeclareStatus(app, options.status, command);

  const auto name = [&app] {
    const auto used = app.get_subcommands();
    return used.empty() ? std::string("slabstream") : "slabstream " + used.front()->get_name();
  };
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    return Complain(name(), error.what(), 2);
  }
  if (!command) return Complain("slabstream", "a subcommand is needed: " + SubcommandNames(app), 2);

  InitLog(name(), LogLevel::kWarning);
  Status status = LimitSimdTargetByEnvironment();
  if (status.ok()) status = command();
  return status.ok() ? 0 : Complain(name(), status.message(), ExitStatus(status));
}

}  // namespace slabstream
