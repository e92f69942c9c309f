// Experiments: `slabstream experiment NAME -o DIR` runs one. Each is one file and one line in Experiments(). An experiment lists the trials
// that it needs (trials.h), has them run, and adds their numbers to the results (results/results.h). The rest is the same for all
// (run_experiment.cpp): folder, resumption, progress, provenance, files. All of this throws Failure (failure.h).
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "client/cli/options.h"
#include "common/cli/command.h"
#include "common/frame/frame_request.h"
#include "laboratory/experiments/trials.h"
#include "laboratory/experiments/volumes.h"
#include "laboratory/results/results.h"

namespace slabstream {

// What an experiment lets the user choose besides the options of all. Empty: its own choice. An experiment that does not offer an option
// (Experiment::declare) leaves it empty.
struct OwnOptions {
  std::vector<std::string> cases;  // volumes instead of the standard ones, as ParseBenchCase takes them
  std::vector<int> workers;        // numbers of workers
  std::vector<const RendererKind*> renderers;
  std::vector<std::string> paths;         // paths of walks, by name
  std::vector<std::string> methods;       // methods of balance or of combining, by name
  std::vector<int> footprints;            // diameters of footprints, pixels
  std::vector<TransferChoice> transfers;  // two: the transfer function changes from one to the other in the middle of a path
  ServiceChoice service;                  // a running service whose frames are measured, instead of this machine
  bool at_service() const { return !service.endpoint.empty() || !service.file.empty(); }
};

struct ExperimentOptions {
  std::string name;
  std::string sweep_file;  // the file of `sweep`; else empty
  std::string folder;
  bool quick = false;  // fewer and smaller sizes, fewer workers
  double scale = 1;    // [kMinScale, 1]: of the sides of spheres and pictures
  std::uint64_t seed = 1;
  int repeats = 0;  // [1, kMaxRepeats]; 0: kRankingRepeats, of a quick run kQuickRepeats
  Resume resume = Resume::kSame;
  std::vector<std::string> volumes;  // FILE[:TRANSFER], beside or instead of the standard ones
  bool list = false;
  std::string command;  // as it was typed
  OwnOptions own;
};
inline constexpr int kMaxRepeats = 1000, kLeastScaledSide = 8;
// Enough to rank 1638 comparisons of a section of a page: 2 * 2^-16 <= 0.05 / 1638 (python/slabstream_lab/ranking.py). By default no
// section has more.
inline constexpr int kRankingRepeats = 16;
// Enough for the 435 comparisons that a quick run has at most in a section (partitions).
inline constexpr int kQuickRepeats = 15;
inline constexpr double kMinScale = 0.05;

// A sphere's side or a picture's under --scale, at least kLeastScaledSide.
int Scaled(const ExperimentOptions& options, int side);

// The environment of an experiment.
class ExperimentContext {
 public:
  ExperimentContext(ExperimentOptions options, TrialLog log, std::function<bool()> interrupted, VolumeCache volumes = VolumeCache());

  const ExperimentOptions& options() const { return options_; }
  bool quick() const { return options_.quick; }
  int Scaled(int side) const { return slabstream::Scaled(options_, side); }
  VolumeCache& volumes() { return volumes_; }

  // Runs the trials that the log does not hold yet, each once (Distinct), and repeats them.
  void Run(std::vector<Trial> trials);
  const TrialLog& log() const { return log_; }
  int repeats() const { return repeats_; }  // repeats of the last Run
  bool interrupted() const { return interrupted_ && interrupted_(); }

 private:
  ExperimentOptions options_;
  TrialLog log_;
  std::function<bool()> interrupted_;
  VolumeCache volumes_;
  int repeats_ = 1;
};

struct Experiment {
  std::string_view name;
  std::string_view purpose;  // one line for --list
  void (*run)(ExperimentContext&, Results&);
  void (*declare)(const Command&, OwnOptions&) = nullptr;  // adds the options that it alone has; null: none
  // Checks the options before a folder is made; null: the checks common to all experiments suffice.
  void (*check)(const ExperimentOptions&) = nullptr;
  bool takes_file = false;  // ExperimentOptions::sweep_file
  // The datasets that it needs of a service (OwnOptions::at_service); null: it measures no service. Throws Failure.
  std::vector<BenchCase> (*served)(const ExperimentOptions&) = nullptr;
};

// The only list.
const std::vector<Experiment>& Experiments();

void RunPaper(ExperimentContext& context, Results& results);
void DeclarePaper(const Command& app, OwnOptions& options);
std::vector<BenchCase> PaperVolumes(const ExperimentOptions& options);
void RunPartitions(ExperimentContext& context, Results& results);
void CheckPartitions(const ExperimentOptions& options);
void DeclarePartitions(const Command& app, OwnOptions& options);
void RunBalance(ExperimentContext& context, Results& results);
void CheckBalance(const ExperimentOptions& options);
void DeclareBalance(const Command& app, OwnOptions& options);
void DeclareCombining(const Command& app, OwnOptions& options);
void RunCombining(ExperimentContext& context, Results& results);
void RunStreaming(ExperimentContext& context, Results& results);
void RunScaling(ExperimentContext& context, Results& results);
void RunSweep(ExperimentContext& context, Results& results);
void CheckSweepFile(const ExperimentOptions& options);
void DeclareSweep(const Command& app, OwnOptions& options);
std::vector<BenchCase> SweepVolumes(const ExperimentOptions& options);

}  // namespace slabstream
