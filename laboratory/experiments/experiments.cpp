#include "laboratory/experiments/experiment.h"

namespace slabstream {

const std::vector<Experiment>& Experiments() {
  static const std::vector<Experiment> experiments = {
      {"paper", "every table and figure of Yagel and Machiraju, theirs beside ours", nullptr, nullptr, false, RunPaper, true},
      {"balance", "partitions, splits and assignments: who is idle, what travels, how long a frame takes, 2 to 1024 workers", RunBalance},
      {"combining", "combining schemes over picture sizes, active pixels, workers and links", nullptr, nullptr, false, RunCombining},
      {"streaming", "groups against efficiency, memory of a worker and the time to the first preview", nullptr, nullptr, false,
       RunStreaming},
      {"scaling", "strong and weak scaling of both pipelines", nullptr, nullptr, false, RunScaling},
      {"sweep", "your own: volumes, views, policies and workers named by a FILE.json (docs/experiments.md)", nullptr, CheckSweepFile, true,
       RunSweep},
  };
  return experiments;
}

}  // namespace slabstream
