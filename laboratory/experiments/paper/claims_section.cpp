// What the paper says about images of slabs and of subcubes (section 5.1), in both projections.
#include "laboratory/experiments/paper/setup.h"

namespace slabstream {
namespace {

std::vector<FrameCase> ClaimedFrames(const PaperSetup& setup) {
  std::vector<FrameCase> frames;
  for (const Projection projection : {Projection::kOrthographic, Projection::kPerspective}) {
    for (const char* decomposition : {"slab", "beam", "subcube"}) {
      for (const int p : setup.workers()) {
        if (p == 1 && decomposition != std::string_view("slab")) continue;  // the whole picture, to which p images are compared
        FrameCase& frame = frames.emplace_back(setup.Frame(Splatting(), setup.table_size(), p));
        frame.policy.decomposition = decomposition;
        frame.view.projection = projection;
      }
    }
  }
  return frames;
}

}  // namespace

std::vector<Trial> ClaimTrials(const PaperSetup& setup) { return setup.TrialsOf(ClaimedFrames(setup)); }

void AddClaims(const PaperSetup& setup, Results& results) {
  const MachineModel machine = setup.Machines(Splatting()).front();  // any: what is sent does not depend on it
  for (const FrameCase& frame : ClaimedFrames(setup)) {
    const MeasuredFrame measured = Recall(setup.context(), frame);
    Json of = ColumnsOf(frame, {{"part", "claims"}});
    const auto add = [&](const char* variant, const char* metric, double value, Origin origin) {
      of["variant"] = variant;
      results.Add(of, metric, value, origin);
    };
    double pixels = 0;
    for (const MeasuredFrame::Cost& box : measured.boxes) pixels += box.covered_pixels;
    add("pixels of all local images that are not empty", "count", pixels, Origin::kMeasured);
    add("without empty pixels", "image_bytes", Simulate(measured, machine).frames.front().image_bytes, Origin::kSimulated);
  }
}

}  // namespace slabstream
