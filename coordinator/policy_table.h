// PolicyTable: what frames get whose policy leaves a choice ("auto"), and what was predicted of them.
//
// A choice is made once for a volume, transfer function, renderer, policy and set of workers, with the first frame that asks for it
// (ChoosePolicy), and its partition then stays whatever the view, so that turning the view moves no voxels. How images are combined moves
// none, so that is chosen anew for each kind of view. When it is first known what boxes cost, the choice is made once more: another
// partition must then be predicted to gain kRevisitGain. What rendering took corrects later predictions.
//
// The last few choices are kept. Those that no frame has asked for longest go first.
#pragma once

#include <list>
#include <memory>
#include <optional>
#include <span>

#include "common/planning/frame_plan.h"
#include "common/stats/report.h"
#include "common/volume/occupancy_grid.h"
#include "coordinator/layout_table.h"
#include "coordinator/plan_request.h"
#include "coordinator/tuning/choose_policy.h"

namespace slabstream {

struct ChosenPolicy {
  Policy policy;                              // leaves nothing open
  std::optional<FramePrediction> prediction;  // none: too much to simulate
  double render_scale = 1;                    // by which it was corrected (PolicyQuestion)
};

class PolicyTable {
 public:
  static constexpr std::size_t kMaxKept = 16;        // choices
  static constexpr std::size_t kMaxKinds = 16;       // of views, of each
  static constexpr double kRevisitGain = 0.1;        // share of a frame's latency
  static constexpr double kLeastWeight = 0.2;        // of a frame's render time, however many there were before it
  static constexpr int kMostFramesAPrediction = 64;  // it is made anew after 1, 2, 4 ... frames, and after as many as this again and again

  struct Request {
    const FrameRequest* frame = nullptr;       // whose policy has names that there are (CheckNames)
    const ClassifiedVolume* volume = nullptr;  // of the frame
    const VolumeSummary* summary = nullptr;
    std::shared_ptr<const OccupancyGrid> occupied;  // null: not counted
    std::uint32_t slots = 1;
    const MachineModel* machine = nullptr;
    const CostModel* cost = nullptr;
    LayoutTable* layouts = nullptr;  // that knows what boxes cost
  };
  // Errors as of ChoosePolicy.
  Result<ChosenPolicy> Find(const Request& request);

  // A finished frame. Nothing is learnt from one of which nothing was predicted.
  void Learn(const PlannedFrame& frame, std::span<const RankReport> reports);

 private:
  // Views of a kind look at the same slices at about the same size.
  struct Kind {
    Projection projection = Projection::kOrthographic;
    Axis traversal_axis = Axis::kX;
    int zoom_octave = 0;
    ImageSize size;
    friend bool operator==(const Kind&, const Kind&) = default;
  };
  struct Choice {
    Kind kind;
    ChosenPolicy chosen;
    int made_after = 0;  // frames
  };
  struct Key {
    ClassifiedVolume volume;
    Policy asked;
    std::uint32_t slots = 1;
    friend bool operator==(const Key&, const Key&) = default;
  };
  struct Entry {
    Key key;
    MachineModel machine;
    bool by_cost = false;     // chosen when costs were known
    double render_scale = 1;  // by how much longer rendering took than was predicted without it
    int frames_seen = 0;
    std::list<Choice> choices;  // by kind; asked for last first; the same but for `combine`
  };
  static Kind KindOf(const Request& request);
  Result<ChosenPolicy> Choose(const Request& request, Entry& entry, const Kind& kind, const Policy& open, const Policy* now);

  std::list<Entry> entries_;  // asked for last first
};

}  // namespace slabstream
