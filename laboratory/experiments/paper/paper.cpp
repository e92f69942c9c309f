#include "laboratory/experiments/paper/setup.h"

namespace slabstream {
namespace {

constexpr int kRepeats = 5, kQuickRepeats = 1;

}  // namespace

void RunPaper(ExperimentContext& context, Results& results) {
  const PaperSetup setup(context);
  std::vector<Trial> trials;
  for (auto* make :
       {TransformTrials, FootprintTrials, PointsTrials, FrameTrials, OccupancyTrials, ImprovedTrials, ClaimTrials, ValidationTrials}) {
    for (Trial& trial : make(setup)) trials.push_back(std::move(trial));
  }
  context.Run(std::move(trials), kRepeats, kQuickRepeats);
  for (auto* add : {AddTransform, AddFootprint, AddPoints, AddFrames, AddOccupancy, AddModel, AddConstants, AddImproved, AddClaims,
                    AddValidation, AddPictures}) {
    add(setup, results);
  }
}

}  // namespace slabstream
