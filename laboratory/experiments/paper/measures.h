// The paper's measures of a frame.
#pragma once

#include <array>

#include "laboratory/experiments/frame_case.h"
#include "laboratory/experiments/paper/setup.h"

namespace slabstream {

// Times until one worker holds the combined image, on `machine` (PaperSetup::Machine): without making a picture and sending it to a client.
// Images are sent whole, as in the paper, or without their empty pixels, as in Slabstream.
enum class Images { kWhole, kWithoutEmpty };
struct PaperFrame {
  double seconds = 0;
  Origin origin = Origin::kMeasured;                // one worker combines nothing: its time is that of its slab
  double render_seconds = 0;                        // of the worker with the longest render time
  double combine_seconds = 0;                       // the rest
  std::array<double, kStageCount> stage_seconds{};  // of that worker; they sum to render_seconds
};
PaperFrame CountAsPaper(const PaperSetup& setup, const FrameCase& frame, const MachineModel& machine, Images images = Images::kWhole);

}  // namespace slabstream
