#include <fmt/format.h>

#include <iterator>

#include "laboratory/experiments/paper/setup.h"

namespace slabstream {
namespace {

constexpr int kRepeats = 5, kQuickRepeats = 1;

void Append(std::vector<Trial>& trials, std::vector<Trial> more) {
  trials.insert(trials.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
}

}  // namespace

Result<Report> RunPaper(ExperimentContext& context) {
  const PaperSetup setup(context);
  std::vector<Trial> trials;
  for (auto* make : {TransformTrials, FootprintTrials, FrameTrials, ImprovedTrials}) Append(trials, make(setup));
  if (Status status = context.Run(WithoutDoubles(std::move(trials)), context.quick() ? kQuickRepeats : kRepeats); !status.ok())
    return status;

  Report report;
  report.title = "Data-parallel volume rendering, measured again";
  report.summary =
      "Yagel and Machiraju divided volumes into slabs, rendered each on a processor of its own and combined the images. Every table and "
      "figure "
      "of their paper, with the same N, p, k and C, on today's processors: measured where this machine can (kernels, each slab rendered "
      "alone, one and "
      "two workers), simulated from the measured costs of the slabs elsewhere, and theirs beside it. Times of this machine and of theirs "
      "are "
      "thirty years apart; shapes, shares, speed-ups and efficiencies are what to compare.";
  for (auto* make : {TransformSection, FootprintSection, ConstantsSection, CombiningSection}) {
    if (Status status = report.Add(make(setup)); !status.ok()) return status;
  }
  for (const RendererKind* renderer : {Splatting(), ZBuffer()}) {
    if (Status status = report.Add(PipelineSection(setup, renderer)); !status.ok()) return status;
  }
  for (auto* make : {ImprovedSection, ValidationSection, PicturesSection}) {
    if (Status status = report.Add(make(setup)); !status.ok()) return status;
  }
  return report;
}

}  // namespace slabstream
