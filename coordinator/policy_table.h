// PolicyTable: the choices made for open policies ("auto"), and what was predicted of their frames.
//
// Choosing takes long (ChoosePolicy), and no frame waits for it. A choice holds for one volume, transfer function, renderer, policy and set
// of workers. The first frames of these follow FirstPolicy, until a choice is made on another thread. The partition of that choice then
// stays for all views, so turning the view moves no voxels. A change of the scheme moves no voxels either, so the scheme is chosen anew for
// each kind of view. When costs are measured for the first time, the choice is made once more. It takes another partition only if this one
// is predicted to gain kRevisitGain. Measured render times correct later predictions.
//
// Find notes what is to be chosen, and Choose chooses. The table keeps the last few choices, and drops the least recently used ones first.
// Any thread may call it; nobody waits while a choice is made.
#pragma once

#include <list>
#include <mutex>
#include <optional>
#include <span>
#include <stop_token>

#include "common/planning/frame_plan.h"
#include "common/stats/report.h"
#include "coordinator/layout_table.h"
#include "coordinator/plan_request.h"
#include "coordinator/tuning/choose_policy.h"

namespace slabstream {

struct ChosenPolicy {
  ResolvedPolicy policy;
  bool chosen = true;                         // false: FirstPolicy, whose layout needs no count of voxels
  std::optional<FramePrediction> prediction;  // none: not chosen yet for such views, or too much to simulate
  double render_scale = 1;                    // correction of the prediction (PolicyQuestion)
};

class PolicyTable {
 public:
  static constexpr std::size_t kMaxKept = 16;        // choices
  static constexpr std::size_t kMaxKinds = 16;       // kinds of views, for each choice
  static constexpr double kRevisitGain = 0.1;        // share of a frame's latency
  static constexpr double kLeastWeight = 0.2;        // of a frame's render time, however many came before it
  static constexpr int kMostFramesAPrediction = 64;  // predictions are made anew after 1, 2, 4 ... frames, later after every so many

  // The policy for the frame of `request`, whose own policy leaves a choice. `machine` models the workers. Measured costs come from
  // `layouts`.
  ChosenPolicy Find(const PlanRequest& request, const MachineModel& machine, LayoutTable& layouts);

  // Whether Find has noted something to choose for a frame of this client.
  bool WantsChoice(PeerToken client);
  // Makes one such choice; does nothing if there is none. If it is told to stop, Find notes the choice again when a frame needs it.
  void Choose(PeerToken client, LayoutTable& layouts, const std::stop_token& stop);

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
    ResolvedPolicy holds;     // the policy of its frames, but for `combine`
    bool chosen = false;      // else it is FirstPolicy
    bool noted = false;       // a choice for it is noted, or being made
    bool by_cost = false;     // chosen when costs were known
    double render_scale = 1;  // measured render time / predicted without it
    int frames_seen = 0;
    std::list<Choice> choices;  // by kind; most recently used first; they differ only in `combine`
  };
  // What is to be chosen.
  struct Noted {
    PlanRequest request;
    Key key;
    MachineModel machine;
    Policy open;
    bool all = false;                   // not for this kind of view alone
    std::optional<ResolvedPolicy> now;  // as in PolicyQuestion
  };
  static Kind KindOf(const PlanRequest& request);
  static Key KeyOf(const PlanRequest& request);
  static std::optional<Noted> WhatLacks(const PlanRequest& request, const Entry& entry, const Choice* choice, bool knows_cost);
  std::list<Entry>::iterator EntryOf(const Noted& noted);  // end: the choice is of no use any more

  std::mutex mutex_;          // guards what follows
  std::list<Entry> entries_;  // most recently used first
  std::list<Noted> noted_;    // oldest first
};

}  // namespace slabstream
