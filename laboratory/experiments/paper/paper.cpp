#include <fmt/format.h>

#include "laboratory/experiments/paper/setup.h"

namespace slabstream {
namespace {

constexpr int kRepeats = 5, kQuickRepeats = 1;

}  // namespace

Report RunPaper(ExperimentContext& context) {
  const PaperSetup setup(context);
  std::vector<Trial> trials;
  for (auto* make : {TransformTrials, FootprintTrials, FrameTrials, ImprovedTrials}) {
    for (Trial& trial : make(setup)) trials.push_back(std::move(trial));
  }
  context.Run(std::move(trials), kRepeats, kQuickRepeats);

  Report report;
  report.title = "Data-parallel volume rendering, measured again";
  report.summary =
      "Yagel and Machiraju divided volumes into slabs, rendered each on a processor of its own and combined the images. Every table and "
      "figure of their paper, with the same N and p, on today's processors: measured where this machine can (kernels, each slab rendered "
      "alone, one and "
      "two workers), simulated from the measured costs of the slabs elsewhere, and theirs beside it. Times of this machine and of theirs "
      "are "
      "thirty years apart; shapes, shares, speed-ups and efficiencies are what to compare.";
  for (auto* make : {TransformSection, FootprintSection, ConstantsSection, CombiningSection}) {
    report.sections.push_back(make(setup));
  }
  for (const RendererKind* renderer : {Splatting(), ZBuffer()}) {
    report.sections.push_back(PipelineSection(setup, renderer));
  }
  for (auto* make : {ImprovedSection, ValidationSection, PicturesSection}) {
    report.sections.push_back(make(setup));
  }
  return report;
}

}  // namespace slabstream
