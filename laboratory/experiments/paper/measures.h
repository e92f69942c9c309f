// What the paper counts of a frame.
#pragma once

#include <array>

#include "laboratory/experiments/frame_case.h"
#include "laboratory/experiments/paper/setup.h"

namespace slabstream {

// Until the combined image lies at one worker, on `machine` (PaperSetup::Machine): without the making of a picture and its way to a client.
// Images are whole ones, as the paper sent them, or with their empty pixels left out, as Slabstream sends them.
enum class Images { kWhole, kWithoutEmpty };
struct PaperFrame {
  double seconds = 0;
  Origin origin = Origin::kMeasured;                // one worker combines nothing: its time is that of its slab
  double render_seconds = 0;                        // of the worker that renders longest
  double combine_seconds = 0;                       // the rest
  std::array<double, kStageCount> stage_seconds{};  // of that worker; they sum to render_seconds
};
Result<PaperFrame> CountAsPaper(const PaperSetup& setup, const FrameCase& frame, const MachineModel& machine,
                                Images images = Images::kWhole);

}  // namespace slabstream
