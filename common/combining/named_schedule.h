// Schedules by name. Plans and messages carry a ScheduleName; whoever needs the steps derives them from it. The same name and pixels give
// the same steps in the same order everywhere, so a message can refer to a step by its index.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/combining/schedule.h"

namespace slabstream {

inline constexpr std::size_t kMaxShares = 64;

struct ScheduleName {
  std::string scheme;  // as --combine spells it, for example "radix-k:4x4"
  Rank ranks = 0;      // [0, kMaxRanks]; 0: a group without images, which needs no scheme
  // Schedule's roots: 1 ... kMaxShares, each below `ranks`, 0 if there are none. If there are several shares, all of
  // them together have at most kMaxSteps ranks.
  std::vector<Rank> roots = {0};
  // The first ranks of runs, ascending from 0. The ranks of a run are of one worker. It combines their images at the first of them, which
  // then takes part in the scheme for all; roots are such ranks. Empty: each rank is a run.
  std::vector<Rank> runs = {};
  friend bool operator==(const ScheduleName&, const ScheduleName&) = default;
};

// One past the last rank of a run, by its place in `name.runs`.
inline Rank EndOfRun(const ScheduleName& name, std::size_t run) { return run + 1 < name.runs.size() ? name.runs[run + 1] : name.ranks; }

// What the scheme does among runs: a schedule whose ranks are the runs of `name`.
ScheduleName AmongRuns(const ScheduleName& name);

// InvalidArgument: an unknown scheme, wrong arguments, too many ranks, no root or too many, a root that is no rank or not the first one of
// its run, or runs that are out of order.
Status CheckScheduleName(const ScheduleName& name);

// A schedule and, for each rank, the steps that it sends or receives. Immutable.
class IndexedSchedule {
 public:
  // Every step goes from one rank below schedule.ranks to another one.
  explicit IndexedSchedule(Schedule schedule);

  const Schedule& schedule() const { return schedule_; }
  const std::vector<Step>& steps() const { return schedule_.steps; }
  // Indices into steps(), ascending.
  std::span<const std::uint32_t> StepsOf(Rank rank) const {
    return std::span(by_rank_).subspan(first_of_rank_[rank], first_of_rank_[rank + 1] - first_of_rank_[rank]);
  }
  // Where the step stands in StepsOf its sender and its receiver.
  std::uint32_t PlaceAtSender(std::uint32_t step) const { return places_[step].sender; }
  std::uint32_t PlaceAtReceiver(std::uint32_t step) const { return places_[step].receiver; }

 private:
  struct Places {
    std::uint32_t sender = 0, receiver = 0;
  };
  Schedule schedule_;
  std::vector<std::uint32_t> by_rank_, first_of_rank_;
  std::vector<Places> places_;  // by step
};

using SharedSchedule = std::shared_ptr<const IndexedSchedule>;

// The schedule of that name over all pixels of a frame. Errors: as CheckScheduleName. Groups and frames repeat names, and a process may
// hold many workers, so recent schedules are kept and shared: at most 64 of them and kMaxSteps steps, but always the latest one. Any thread
// may call.
Result<SharedSchedule> DeriveSchedule(const ScheduleName& name, PixelRange frame);

}  // namespace slabstream
