// PolicyTable: the choices made for open policies ("auto"), and what was predicted of their frames.
//
// A choice is made once for a volume, transfer function, renderer, policy and set of workers, with the first frame that asks for it
// (ChoosePolicy). Its partition then stays for all views, so turning the view moves no voxels. Combining moves none, so the scheme
// is chosen anew for each kind of view. When costs are first measured, the choice is made once more: another partition must then be
// predicted to gain kRevisitGain. Measured render times correct later predictions.
//
// The last few choices are kept. The least recently used go first.
#pragma once

#include <list>
#include <optional>
#include <span>

#include "common/planning/frame_plan.h"
#include "common/stats/report.h"
#include "coordinator/layout_table.h"
#include "coordinator/plan_request.h"
#include "coordinator/tuning/choose_policy.h"

namespace slabstream {

struct ChosenPolicy {
  ResolvedPolicy policy;
  std::optional<FramePrediction> prediction;  // none: too much to simulate
  double render_scale = 1;                    // correction of the prediction (PolicyQuestion)
};

class PolicyTable {
 public:
  static constexpr std::size_t kMaxKept = 16;        // choices
  static constexpr std::size_t kMaxKinds = 16;       // kinds of views, for each choice
  static constexpr double kRevisitGain = 0.1;        // share of a frame's latency
  static constexpr double kLeastWeight = 0.2;        // of a frame's render time, however many came before it
  static constexpr int kMostFramesAPrediction = 64;  // it is made anew after 1, 2, 4 ... frames, later after every so many

  // The policy for the frame of `request`, which leaves a choice. `machine`: of its workers. `layouts`: the source of measured costs.
  ChosenPolicy Find(const PlanRequest& request, const FrameSetup& setup, const MachineModel& machine, LayoutTable& layouts);

  // Learns from a finished frame, if it had a prediction.
  void Learn(const PlannedFrame& frame, std::span<const RankReport> reports);

 private:
  // Views of a kind look at the same slices at about the same size, rendered alike.
  struct Kind {
    Projection projection = Projection::kOrthographic;
    Axis traversal_axis = Axis::kX;
    int zoom_octave = 0;
    ImageSize size;
    ParameterTexts parameters;
    friend bool operator==(const Kind&, const Kind&) = default;
  };
  struct Choice {
    Kind kind;
    ChosenPolicy chosen;
    int made_after = 0;  // frames
  };
  struct Key {
    ClassifiedVolume volume;
    Policy asked;  // settled (SettledPolicy)
    std::uint32_t slots = 1;
    friend bool operator==(const Key&, const Key&) = default;
  };
  struct Entry {
    Key key;
    MachineModel machine;
    bool by_cost = false;     // chosen when costs were known
    double render_scale = 1;  // measured render time / predicted without it
    int frames_seen = 0;
    std::list<Choice> choices;  // by kind; most recently used first; they differ only in `combine`
  };
  static Kind KindOf(const PlanRequest& request);
  static Key KeyOf(const PlanRequest& request);
  static ChosenPolicy Choose(const PlanRequest& request, const FrameSetup& setup, LayoutTable& layouts, Entry& entry, const Policy& open,
                             const ResolvedPolicy* now);

  std::list<Entry> entries_;  // most recently used first
};

}  // namespace slabstream
