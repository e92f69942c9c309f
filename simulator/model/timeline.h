// Timeline: what happened in a simulated run, second by second. It has the figures that the service reports for its own frames, so that the
// two can be compared. Virtual time begins at 0, when the first frame is asked for.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/combining/schedule.h"
#include "common/stats/report.h"

namespace slabstream {

enum class Lane : std::uint8_t { kRender = 0, kCombine = 1, kFinish = 2 };  // the threads of a worker

struct SimulatedSpan {
  std::uint32_t frame = 0, group = 0;
  std::uint32_t worker = 0;  // index: its place in SimulationResult::workers
  Lane lane = Lane::kRender;
  Rank rank = 0;                 // rank that is rendered or sent; 0 for other stages
  Stage stage = Stage::kRender;  // kRender, kEncode, kCombine (also accumulating and looking for hidden tiles) or kResolve (kFinish)
  double begin = 0, end = 0;     // seconds
};

// A message with pixels, or with the voxels that a box needs.
struct SimulatedMessage {
  enum class Kind : std::uint8_t { kPartial = 1, kGroupImage = 2, kVoxels = 3 };
  Kind kind = Kind::kPartial;
  std::uint32_t frame = 0, group = 0;
  std::uint32_t step = 0;          // the step of the schedule; kPartial only
  std::uint32_t from = 0, to = 0;  // indices of workers; `from` of kVoxels is the coordinator: the number of workers
  double pixels = 0;               // not empty
  double bytes = 0;
  double ready = 0, begin = 0, end = 0;  // handed over; first byte on its first wire; last byte there
};

struct SimulatedFrame {
  double submitted = 0, planned = 0;  // by the client; when the coordinator began to plan it
  double done = 0, received = 0;      // last byte at the coordinator; picture decoded at the client
  std::vector<double> groups_done;    // by group: when the coordinator knew, the time of a preview
  double latency() const { return received - submitted; }

  std::array<double, kStageCount> stage_seconds{};  // worker time, summed over workers
  double imbalance = 1;                             // most / mean render time of a worker, over all slots of the plan
  double idle_share = 0;                    // share of the workers' time from plan to last byte in which no thread works for this frame
  double image_bytes = 0, voxel_bytes = 0;  // sent
  std::uint64_t messages = 0;               // between workers
};

struct Timeline {
  std::uint32_t workers = 0;
  std::vector<SimulatedFrame> frames;  // by the order of the input
  std::vector<SimulatedSpan> spans;    // in order of end; empty unless asked for
  std::vector<SimulatedMessage> messages;
  double end = 0;  // the last picture is received

  double frames_per_second() const { return end > 0 ? double(frames.size()) / end : 0; }
};

}  // namespace slabstream
