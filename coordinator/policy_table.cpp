#include "coordinator/policy_table.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <utility>

#include "common/planning/policy_names.h"
#include "common/renderers/registry.h"
#include "coordinator/learning_table.h"

namespace slabstream {
namespace {

constexpr double kLeastFactor = 0.1, kMostFactor = 10;  // limits of measured / predicted render time of one frame

// Render time of the busiest worker.
double RenderSeconds(std::span<const RankReport> reports) {
  std::map<std::uint32_t, std::int64_t> by_worker;
  std::int64_t most = 0;
  for (const RankReport& report : reports) {
    most = std::max(most, by_worker[report.worker] += LastingRenderNs(report));
  }
  return 1e-9 * double(most);
}

}  // namespace

PolicyTable::Kind PolicyTable::KindOf(const PlanRequest& request) {
  const FrameRequest& frame = request.resolved->frame;
  return {.projection = frame.view.projection,
          .traversal_axis = MakeCamera(frame.view, frame.size, request.resolved->summary->description.geometry).traversal_axis,
          .zoom_octave = std::ilogb(frame.view.zoom),
          .size = frame.size,
          .parameters = frame.parameters};
}

PolicyTable::Key PolicyTable::KeyOf(const PlanRequest& request) {
  return {request.resolved->volume, request.resolved->frame.policy, std::uint32_t(request.roster.slots.size())};
}

ChosenPolicy PolicyTable::Choose(const PlanRequest& request, const FrameSetup& setup, LayoutTable& layouts, Entry& entry,
                                 const Policy& open, const ResolvedPolicy* now) {
  const std::optional<WorkField> cost = entry.by_cost ? layouts.KnownCost(request.resolved->volume) : std::nullopt;
  const PolicyChoice choice = ChoosePolicy({.open = &open,
                                            .resolved = request.resolved.get(),
                                            .setup = &setup,
                                            .known = {.occupied = request.occupied.get(), .cost = cost ? &*cost : nullptr},
                                            .slots = entry.key.slots,
                                            .machine = &entry.machine,
                                            .render_scale = entry.render_scale,
                                            .now = now,
                                            .least_gain = kRevisitGain});
  const ChosenPolicy chosen{choice.policy, choice.prediction, entry.render_scale};
  const Kind kind = KindOf(request);
  entry.choices.remove_if([&](const Choice& same) { return same.kind == kind; });
  entry.choices.push_front({kind, chosen, entry.frames_seen});
  KeepFirst(entry.choices, kMaxKinds);
  return chosen;
}

ChosenPolicy PolicyTable::Find(const PlanRequest& request, const FrameSetup& setup, const MachineModel& machine, LayoutTable& layouts) {
  Key key = KeyOf(request);
  const auto found = std::ranges::find(entries_, key, &Entry::key);
  if (found == entries_.end() || found->machine != machine) {
    if (found != entries_.end()) entries_.erase(found);
    Entry entry{.key = std::move(key), .machine = machine};
    entry.by_cost = layouts.KnowsCost(request.resolved->volume);
    ChosenPolicy chosen = Choose(request, setup, layouts, entry, entry.key.asked, nullptr);
    entries_.push_front(std::move(entry));
    KeepFirst(entries_, kMaxKept);
    return chosen;
  }
  entries_.splice(entries_.begin(), entries_, found);
  Entry& entry = entries_.front();
  const ResolvedPolicy holds = entry.choices.front().chosen.policy;
  if (!entry.by_cost && layouts.KnowsCost(request.resolved->volume)) {
    entry.by_cost = true;
    entry.render_scale = 1;  // costs are seconds now
    entry.frames_seen = 0;
    ChosenPolicy chosen = Choose(request, setup, layouts, entry, entry.key.asked, &holds);
    KeepFirst(entry.choices, 1);
    return chosen;
  }
  const auto choice = std::ranges::find(entry.choices, KindOf(request), &Choice::kind);
  if (choice == entry.choices.end()) {
    Policy open = AskFor(holds);
    open.combine = entry.key.asked.combine;
    return Choose(request, setup, layouts, entry, open, nullptr);
  }
  const int seen = entry.frames_seen;
  const int due =
      seen < kMostFramesAPrediction ? int(std::bit_floor(unsigned(seen))) : seen / kMostFramesAPrediction * kMostFramesAPrediction;
  if (choice->made_after < due) return Choose(request, setup, layouts, entry, AskFor(choice->chosen.policy), nullptr);
  entry.choices.splice(entry.choices.begin(), entry.choices, choice);
  return choice->chosen;
}

void PolicyTable::Learn(const PlannedFrame& frame, std::span<const RankReport> reports) {
  if (!frame.prediction || frame.prediction->render_seconds <= 0) return;
  const auto entry = std::ranges::find(entries_, KeyOf(frame.asked), &Entry::key);
  const double seconds = RenderSeconds(reports);
  if (entry == entries_.end() || seconds <= 0) return;
  const double weight = std::max(kLeastWeight, 1.0 / ++entry->frames_seen);
  const double factor = std::clamp(seconds / frame.prediction->render_seconds, kLeastFactor, kMostFactor);
  entry->render_scale += weight * (frame.render_scale * factor - entry->render_scale);
}

}  // namespace slabstream
