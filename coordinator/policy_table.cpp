#include "coordinator/policy_table.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <utility>

#include "common/planning/policy_names.h"
#include "common/renderers/registry.h"
#include "common/threads/guarded.h"
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

// What should be chosen for this frame, if anything. `choice`: of its kind of view; null: there is none.
std::optional<PolicyTable::Noted> PolicyTable::WhatLacks(const PlanRequest& request, const Entry& entry, const Choice* choice,
                                                         bool knows_cost) {
  Noted noted{.request = request, .key = entry.key, .machine = entry.machine, .open = entry.key.asked};
  if (!entry.chosen) {
    // It chooses by counted voxels, if these make a difference.
    noted.all = true;
    return request.occupied != nullptr || !NeedsOccupancy(entry.key.asked) ? std::optional(noted) : std::nullopt;
  }
  if (!entry.by_cost && knows_cost) {
    noted.all = true;
    noted.now = entry.holds;
    return noted;
  }
  if (choice == nullptr) {
    noted.open = AskFor(entry.holds);
    noted.open.combine = entry.key.asked.combine;
    return noted;
  }
  const int seen = entry.frames_seen;
  const int due =
      seen < kMostFramesAPrediction ? int(std::bit_floor(unsigned(seen))) : seen / kMostFramesAPrediction * kMostFramesAPrediction;
  if (choice->made_after >= due) return std::nullopt;
  noted.open = AskFor(choice->chosen.policy);
  return noted;
}

ChosenPolicy PolicyTable::Find(const PlanRequest& request, const MachineModel& machine, LayoutTable& layouts) {
  const bool knows_cost = layouts.KnowsCost(request.resolved->volume);
  const std::lock_guard lock(mutex_);
  Key key = KeyOf(request);
  auto entry = std::ranges::find(entries_, key, &Entry::key);
  if (entry == entries_.end()) {
    ResolvedPolicy first = ResolvePolicy(FirstPolicy(key.asked, key.slots), request.resolved->summary->description.geometry);
    entries_.push_front({.key = std::move(key), .machine = machine, .holds = std::move(first)});
    KeepFirst(entries_, kMaxKept);
    entry = entries_.begin();
  }
  entries_.splice(entries_.begin(), entries_, entry);
  if (entry->machine != machine) {  // what holds stays until there is another choice
    entry->machine = machine;
    entry->chosen = entry->noted = false;
    entry->choices.clear();
  }
  const auto choice = std::ranges::find(entry->choices, KindOf(request), &Choice::kind);
  const bool known = choice != entry->choices.end();
  if (!entry->noted) {
    if (std::optional<Noted> lacks = WhatLacks(request, *entry, known ? &*choice : nullptr, knows_cost)) {
      noted_.push_back(*std::move(lacks));
      entry->noted = true;
    }
  }
  if (!known) return ChosenPolicy{.policy = entry->holds, .chosen = entry->chosen, .prediction = {}};
  entry->choices.splice(entry->choices.begin(), entry->choices, choice);
  return choice->chosen;
}

bool PolicyTable::WantsChoice(PeerToken client) {
  const std::lock_guard lock(mutex_);
  return std::ranges::any_of(noted_, [client](const Noted& noted) { return noted.request.client == client; });
}

std::list<PolicyTable::Entry>::iterator PolicyTable::EntryOf(const Noted& noted) {
  const auto entry = std::ranges::find(entries_, noted.key, &Entry::key);
  return entry != entries_.end() && entry->machine == noted.machine ? entry : entries_.end();
}

void PolicyTable::Choose(PeerToken client, LayoutTable& layouts, const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  const auto first = std::ranges::find_if(noted_, [client](const Noted& each) { return each.request.client == client; });
  if (first == noted_.end()) return;
  const Noted noted = std::move(*first);
  noted_.erase(first);
  auto entry = EntryOf(noted);
  if (entry == entries_.end()) return;
  const bool anew = noted.all && layouts.KnowsCost(noted.request.resolved->volume) && !entry->by_cost;
  const bool by_cost = entry->by_cost || anew;
  const double render_scale = anew ? 1 : entry->render_scale;  // costs are seconds now
  lock.unlock();

  const std::optional<WorkField> cost = by_cost ? layouts.KnownCost(noted.request.resolved->volume) : std::nullopt;
  const Result<PolicyChoice> choice = Guarded("choosing a policy", [&]() -> Result<PolicyChoice> {
    const Result<FrameSetup> setup = MakeFrameSetup(*noted.request.resolved);
    if (!setup.ok()) return setup.status();
    return ChoosePolicy({.open = &noted.open,
                         .resolved = noted.request.resolved.get(),
                         .setup = &*setup,
                         .known = {.occupied = noted.request.occupied.get(), .cost = cost ? &*cost : nullptr},
                         .slots = noted.key.slots,
                         .machine = &noted.machine,
                         .render_scale = render_scale,
                         .now = noted.now ? &*noted.now : nullptr,
                         .least_gain = kRevisitGain,
                         .stop = stop});
  });
  lock.lock();
  entry = EntryOf(noted);
  if (entry == entries_.end()) return;
  entry->noted = false;
  if (stop.stop_requested() || !choice.ok()) return;  // what fails here fails the frame, too
  if (anew) {
    entry->frames_seen = 0;
    entry->render_scale = 1;
  }
  if (noted.all) {
    entry->choices.clear();
    entry->holds = choice->policy;
    entry->by_cost = by_cost;
    entry->chosen = true;
  }
  const Kind kind = KindOf(noted.request);
  entry->choices.remove_if([&](const Choice& same) { return same.kind == kind; });
  entry->choices.push_front({kind, {choice->policy, true, choice->prediction, render_scale}, entry->frames_seen});
  KeepFirst(entry->choices, kMaxKinds);
}

void PolicyTable::Learn(const PlannedFrame& frame, std::span<const RankReport> reports) {
  if (!frame.prediction || frame.prediction->render_seconds <= 0) return;
  const std::lock_guard lock(mutex_);
  const auto entry = std::ranges::find(entries_, KeyOf(frame.asked), &Entry::key);
  const double seconds = RenderSeconds(reports);
  if (entry == entries_.end() || seconds <= 0) return;
  // A frame that was planned before the last choice tells nothing about its prediction.
  const auto is_its = [&](const Choice& choice) { return choice.chosen.prediction == frame.prediction; };
  if (std::ranges::none_of(entry->choices, is_its)) return;
  const double weight = std::max(kLeastWeight, 1.0 / ++entry->frames_seen);
  const double factor = std::clamp(seconds / frame.prediction->render_seconds, kLeastFactor, kMostFactor);
  entry->render_scale += weight * (frame.render_scale * factor - entry->render_scale);
}

}  // namespace slabstream
