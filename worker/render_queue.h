// RenderQueue: the ranks that this worker has yet to render, and those that it renders. The ranks of a client are rendered one after the
// other, in order of frame, group and rank; the first one with a complete padded box is next. The clients take turns of at least kTurn: the
// next turn belongs to the client that has used least of this worker's time (FairTurns), for rendering and combining. The render of a
// client whose turn is over pauses, and goes on in its next turn. So a frame that takes seconds holds up nobody.
//
// A render that pauses stops only between two of its pieces, and one that is cancelled only soon, so others run beside it for a moment.
// Renders of several clients use the same padded box at a time, paused ones included, as long as there is room for what each of them
// derives. Each job pins its padded box.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "common/base/fair_turns.h"
#include "worker/box_fetcher.h"

namespace slabstream {

class RenderQueue {
 public:
  static constexpr Duration kTurn = std::chrono::milliseconds(10);

  // Both must outlive the queue.
  RenderQueue(BoxFetcher& boxes, ImageNames& names) : boxes_(boxes), names_(names) {}

  void Add(ClientId client, const GroupKey& key, Rank rank, const Placement& placement, const std::shared_ptr<const FrameSetup>& setup,
           const std::shared_ptr<const OcclusionMask>& hidden, Time now, WorkerActions& actions);
  void DropGroup(const GroupKey& key, Time now, WorkerActions& actions);  // its renders are cancelled
  // Gives the turn to the client that it belongs to.
  void StartNext(Time now, WorkerActions& actions);
  // When StartNext may change something by itself; Time::max(): never.
  Time NextTurn() const;
  // The client has used so much of this worker's time otherwise.
  void Charge(ClientId client, Duration used) { turns_.Charge(client, used); }

  // Call when a render ends. Returns the executor's report with identities and fetch figures filled in, or nothing if the group was dropped
  // (the image is then released).
  std::optional<RankReport> Finish(const RenderDone& done, WorkerId worker, Time now, WorkerActions& actions);

  // Of waiting jobs, by client, the next one in turn first.
  std::vector<std::vector<BoxFetcher::Generation>> BoxesInTurn() const;
  std::set<GroupKey> GroupsOn(BoxFetcher::Generation padded) const;
  bool AnyPaused() const { return begun_.size() > (turn_ ? 1U : 0U); }
  std::size_t size() const { return waiting_.size() + begun_.size(); }

 private:
  struct Job {
    Placement placement;
    std::shared_ptr<const FrameSetup> setup;
    std::shared_ptr<const OcclusionMask> hidden;
    BoxFetcher::Generation padded = 0;
    bool waited = false;  // for voxels: their fetch is reported with it
  };
  struct Begun {
    GroupKey key;
    Rank rank = 0;
    Job job;
    ImageHandle image = 0;
    bool dropped = false;
  };
  struct TurnNow {
    ClientId client = 0;
    Time begin;    // of the turn
    Time charged;  // what it took before is
  };
  using Waiting = std::map<std::tuple<ClientId, GroupKey, Rank>, Job>;

  bool Busy(ClientId client) const;
  bool OnlyTurns() const;                                 // nobody but the client whose turn it is has any job
  Waiting::const_iterator NextOf(ClientId client) const;  // that can begin; end: none
  bool WantsTurn(ClientId client) const;
  std::set<ClientId> Clients() const;
  std::optional<ClientId> NextInTurn() const;  // but for the client whose turn it is
  void ChargeTurn(Time now);
  void EndTurn(Time now);
  void Begin(ClientId client, Time now, WorkerActions& actions);

  BoxFetcher& boxes_;
  ImageNames& names_;
  Waiting waiting_;
  std::map<ClientId, Begun> begun_;  // one of a client; all are paused or dropped but that of the client whose turn it is
  std::optional<TurnNow> turn_;
  FairTurns<ClientId> turns_;
};

}  // namespace slabstream
