#include <fmt/format.h>

#include "common/cli/add_option.h"
#include "laboratory/experiments/paper/setup.h"
#include "laboratory/measure/splat_loops.h"

namespace slabstream {

void DeclarePaper(CLI::App& app, OwnOptions& options) {
  AddParsedList(
      app, "--footprints", options.footprints,
      [](const std::string& option, const std::string& text) { return ParseInteger(option, text, kMinFootprint, kMaxFootprint); },
      fmt::format("Diameters of the footprints of figure 8b in pixels, each from {} to {}", kMinFootprint, kMaxFootprint))
      ->default_str("3,5,9,13,17,25");
}

void RunPaper(ExperimentContext& context, Results& results) {
  const PaperSetup setup(context);
  std::vector<Trial> trials;
  for (auto* make : {TransformTrials, FootprintTrials, PointsTrials, FrameTrials, OccupancyTrials, ConstantsTrials, ImprovedTrials,
                     ClaimTrials, ValidationTrials}) {
    for (Trial& trial : make(setup)) trials.push_back(std::move(trial));
  }
  context.Run(std::move(trials));
  for (auto* add : {AddTransform, AddFootprint, AddPoints, AddFrames, AddOccupancy, AddModel, AddConstants, AddImproved, AddClaims,
                    AddValidation, AddPictures}) {
    add(setup, results);
  }
}

}  // namespace slabstream
