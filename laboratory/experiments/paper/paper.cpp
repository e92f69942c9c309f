#include <fmt/format.h>

#include "common/cli/add_option.h"
#include "laboratory/experiments/paper/setup.h"
#include "laboratory/measure/splat_loops.h"

namespace slabstream {

void DeclarePaper(const Command& app, OwnOptions& options) {
  AddParsedList(
      app, "--footprints", options.footprints,
      [](const std::string& option, const std::string& text) { return ParseInteger(option, text, kLeastDiameter, kMostDiameter); },
      fmt::format("Diameters of the footprints of figure 8b in pixels, each from {} to {}", kLeastDiameter, kMostDiameter))
      .Default("3,5,9,13,17,25");
  AddService(app, options.service)
      .Description(
          "Measure the frames of tables 2, 5 and 6 and figures 9 to 11 at the service at this endpoint, with its workers and its "
          "datasets class1-N; nothing else (bench/cluster --paper does so for all p)")
      .Default("none: boxes are rendered alone on this machine");
}

void RunPaper(ExperimentContext& context, Results& results) {
  const PaperSetup setup(context);
  if (context.options().own.at_service()) return RunPaperAtService(setup, results);
  std::vector<Trial> trials;
  for (auto* make : {TransformTrials, FootprintTrials, PointsTrials, GridTrials, FrameTrials, OccupancyTrials, ConstantsTrials,
                     ImprovedTrials, ClaimTrials, ValidationTrials}) {
    for (Trial& trial : make(setup)) trials.push_back(std::move(trial));
  }
  context.Run(std::move(trials));
  for (auto* add : {AddTransform, AddFootprint, AddPoints, AddGrids, AddFrames, AddOccupancy, AddModel, AddConstants, AddImproved,
                    AddClaims, AddValidation, AddPictures}) {
    add(setup, results);
  }
}

}  // namespace slabstream
