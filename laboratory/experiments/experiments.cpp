#include "laboratory/experiments/experiment.h"
#include "laboratory/experiments/subjects.h"

namespace slabstream {

const std::vector<Experiment>& Experiments() {
  static const std::vector<Experiment> experiments = {
      {"paper", "every table and figure of Yagel and Machiraju, the paper's beside ours", RunPaper, DeclarePaper, nullptr, false,
       PaperVolumes},
      {"partitions", "ways to divide sparse volumes and to combine their images, for one view: which is best, and how good the default is",
       RunPartitions, DeclarePartitions, CheckPartitions},
      {"balance", "ways to keep workers evenly loaded while a view, a look, a volume or a worker changes", RunBalance, DeclareBalance,
       CheckBalance, false, SubjectsAtService},
      {"combining", "combining schemes over picture sizes, active pixels, workers and links", RunCombining, DeclareCombining},
      {"streaming", "groups against efficiency, memory of a worker and the time to the first preview", RunStreaming},
      {"scaling", "strong and weak scaling of both pipelines", RunScaling},
      {"sweep", "your own: volumes, views, policies and workers named by a FILE.json (docs/experiments.md)", RunSweep, DeclareSweep,
       CheckSweepFile, true, SweepVolumes},
  };
  return experiments;
}

}  // namespace slabstream
