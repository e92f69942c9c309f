#include "laboratory/experiments/run_experiment.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <iostream>

#include "client/cli/interrupt.h"
#include "commit.h"
#include "common/base/did_you_mean.h"
#include "common/base/find_named.h"
#include "common/base/version.h"
#include "common/files/files.h"
#include "common/transport/socket.h"
#include "laboratory/bench/bench_machine.h"
#include "laboratory/experiments/request_json.h"
#include "laboratory/experiments/service_frames.h"
#include "laboratory/experiments/sweep_file.h"
#include "laboratory/measure/other_load.h"

namespace slabstream {
namespace {

Json ReferenceLoopKey() { return {{"what", "reference loop"}}; }

// Everything that decides the set of trials.
Json Parameters(const Experiment& experiment, const ExperimentOptions& options, VolumeCache& cache) {
  Json parameters = {{"seed", options.seed},   {"repeats", options.repeats}, {"quick", options.quick},
                     {"scale", options.scale}, {"volumes", options.volumes}, {"sweep", Json()}};
  if (!options.sweep_file.empty()) {
    parameters["sweep"] = OrThrow(Json::Parse(OrThrow(ReadTextFile(options.sweep_file, kMaxSweepBytes))));
  }
  const auto& [cases, workers, renderers, paths, methods, footprints, transfers, service] = options.own;
  parameters["own"] = {{"cases", cases},     {"workers", workers},       {"renderers", Json::array()}, {"paths", paths},
                       {"methods", methods}, {"footprints", footprints}, {"transfers", Json::array()}};
  for (const RendererKind* renderer : renderers) parameters["own"]["renderers"].push_back(renderer->name());
  for (const TransferChoice& transfer : transfers) parameters["own"]["transfers"].push_back(TransferJson(transfer));
  if (options.own.at_service()) {
    const std::vector<BenchCase> volumes = experiment.served(options);
    parameters["service"] = DescribeService(service, volumes);
    for (const BenchCase& volume : volumes) parameters["contents"].push_back(TransferJson(volume.transfer));
    return parameters;
  }
  // Texts that name files do not say what is in them.
  std::vector<BenchCase> named = options.sweep_file.empty() ? RealVolumes(options.volumes) : OrThrow(ReadSweep(options.sweep_file)).volumes;
  std::ranges::move(NamedVolumes("VOLUME", cases), std::back_inserter(named));
  parameters["contents"] = Json::array();
  for (const BenchCase& volume : named) {
    parameters["contents"].push_back({{"volume", cache.Identity(volume)}, {"transfer", TransferJson(volume.transfer)}});
  }
  return parameters;
}

std::string NowUtc() {
  const std::time_t now = std::time(nullptr);
  return fmt::format("{:%Y-%m-%d %H:%M} UTC", fmt::gmtime(now));
}

// How the run went: what results are worth.
void AddConduct(Results& results, const TrialLog& log) {
  std::vector<double> loads = log.other_loads();
  if (!loads.empty()) {
    const auto [least, most] = std::ranges::minmax(loads);
    const int count = int(loads.size());
    results.Add({{"part", "conduct"}}, "other_load", Estimate{MedianOf(std::move(loads)).median, least, most, 1, count}, Origin::kMeasured);
  }
  const std::vector<double> loops = ValuesOf(log, ReferenceLoopKey(), "seconds");
  const auto [fastest, slowest] = std::ranges::minmax(loops);
  results.Add({{"part", "conduct"}}, "drift",
              Estimate{loops.back() / loops.front(), fastest / loops.front(), slowest / loops.front(), 1, int(loops.size())},
              Origin::kMeasured);
}

// What the results do not say about the run, for the page: run.json.
Json RunJson(const ExperimentContext& context, const MachineInfo& machine) {
  const ExperimentOptions& options = context.options();
  return {{"experiment", options.name},
          {"version", Version()},
          {"commit", SLABSTREAM_COMMIT},
          {"command", options.command},
          {"machine",
           {{"cpu", machine.cpu},
            {"cores", machine.cores},
            {"simd", machine.simd},
            {"flags", machine.flags},
            {"kernel", machine.kernel},
            {"governor", machine.governor},
            {"compiler", machine.compiler},
            {"load", machine.load}}},
          {"seed", options.seed},
          {"repeats", context.repeats()},
          {"quick", options.quick},
          {"scale", options.scale},
          {"date", NowUtc()}};
}

void Find(const Experiment& experiment, ExperimentContext& context, const MachineInfo& machine, const std::string& machine_text) {
  const std::string& folder = context.options().folder;
  Results results({std::string(experiment.name), SLABSTREAM_COMMIT, machine_text});
  experiment.run(context, results);
  if (context.interrupted()) throw Failure(Status::Cancelled("interrupted while results were made; the same command continues"));
  AddConduct(results, context.log());
  OrThrow(results.Write(folder));
  OrThrow(WriteTextFile(folder + "/run.json", RunJson(context, machine).dump(1) + "\n"));
  std::cout << fmt::format("wrote {0} values to {1}/results.csv and results.jsonl\nslabstream-lab {1} draws them\n", results.rows().size(),
                           folder);
}

void Run(const ExperimentOptions& options) {
  const Experiment* experiment = FindNamed(Experiments(), options.name);
  if (experiment == nullptr) {
    throw Failure(Status::NotFound(
        fmt::format("NAME '{}' is no experiment (--list names them){}", options.name, DidYouMean(options.name, Experiments()))));
  }
  if (experiment->takes_file && options.sweep_file.empty())
    throw Failure(Status::InvalidArgument(fmt::format("experiment '{}' needs a FILE", options.name)));
  if (options.folder.empty()) throw Failure(Status::InvalidArgument("-o (--output) is missing: the folder for the results"));
  const MachineInfo machine = DescribeMachine();
  const std::string machine_text = fmt::format("{}, {} cores, {}", machine.cpu, machine.cores, machine.simd);
  if (experiment->check != nullptr) experiment->check(options);
  VolumeCache volumes;
  const Json parameters = Parameters(*experiment, options, volumes);
  TrialLog log = OrThrow(TrialLog::Open(options.folder, {options.name, parameters, SLABSTREAM_COMMIT, machine_text}, options.resume));
  if (log.size() > 0) std::cout << fmt::format("continues with {} trials that are done\n", log.size()) << std::flush;

  Wakeup wakeup;
  const InterruptGuard interrupt(wakeup);
  ExperimentContext context(
      options, std::move(log), [&interrupt] { return interrupt.interrupted(); }, std::move(volumes));
  Find(*experiment, context, machine, machine_text);
}

}  // namespace

ExperimentContext::ExperimentContext(ExperimentOptions options, TrialLog log, std::function<bool()> interrupted, VolumeCache volumes)
    : options_(std::move(options)), log_(std::move(log)), interrupted_(std::move(interrupted)), volumes_(std::move(volumes)) {}

int Scaled(const ExperimentOptions& options, int side) { return std::max(kLeastScaledSide, int(std::lround(side * options.scale))); }

void ExperimentContext::Run(std::vector<Trial> trials) {
  repeats_ = options_.repeats > 0 ? options_.repeats : quick() ? kQuickRepeats : kRankingRepeats;
  trials = Distinct(std::move(trials));
  std::cout << fmt::format("{} kinds of trials, repeats: {}\n", trials.size(), repeats_) << std::flush;
  // Before and after: a machine that became slower shows.
  const auto time_reference_loop = [this] {
    OrThrow(log_.Append(ReferenceLoopKey(), int(log_.All(ReferenceLoopKey()).size()), {{"seconds", ReferenceLoopSeconds()}}));
  };
  time_reference_loop();
  RunTrials(trials, {options_.seed, repeats_, true, interrupted_}, log_);
  time_reference_loop();
}

std::string ExperimentList() {
  std::string list;
  for (const Experiment& experiment : Experiments()) list += fmt::format("{:<10} {}\n", experiment.name, experiment.purpose);
  return list;
}

Status RunExperiment(const ExperimentOptions& options) {
  try {
    Run(options);
  } catch (const Failure& failure) {
    return failure.status();
  }
  return Status::Ok();
}

}  // namespace slabstream
