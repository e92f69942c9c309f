// RenderQueue: the ranks that this worker has yet to render, and those that it is rendering. The ranks of a client are rendered one after
// the other, in order of frame, group and rank. The next one is the first whose boxes are complete: its padded box, and those of the light
// volumes and of the other fields that the frame shows; and whose frame awaits no tiles. The clients take turns of at least kTurn. The next
// turn belongs to the client that has used least of this worker's time for rendering and combining (FairTurns). When a client's turn is
// over, its render pauses. The render goes on in the client's next turn. So a frame that takes seconds holds up nobody. And a frame of many
// boxes gets its share: turns that it misses while it waits for voxels or for other workers, it has later, up to kCredit.
//
// A render that is told to pause stops only between two of its pieces. A render that is cancelled ends soon, but not at once. So other
// renders run beside it for a moment. Renders of several clients, paused ones included, use the same padded box at the same time, as long
// as there is room for what each of them derives. While boxes take more than their room, no render begins beside others. Each job pins its
// boxes.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <tuple>
#include <vector>

#include "common/threads/fair_turns.h"
#include "worker/machine/box_fetcher.h"

namespace slabstream {

class RenderQueue {
 public:
  static constexpr Duration kTurn = std::chrono::milliseconds(10), kCredit = 20 * kTurn;

  // Both must outlive the queue.
  RenderQueue(BoxFetcher& boxes, ImageNames& names) : boxes_(boxes), names_(names) {}

  void Add(ClientId client, const GroupKey& key, Rank rank, const Placement& placement, const std::shared_ptr<const FrameSetup>& setup,
           const std::shared_ptr<const OcclusionMask>& hidden, Time now, WorkerActions& actions);
  void DropGroup(const GroupKey& key, Time now, WorkerActions& actions);  // its renders are cancelled
  // The frame's ranks wait for tiles of its shapes from these workers, until `until` at most.
  void AwaitTiles(FrameId frame, std::set<WorkerId> from, Time until);
  void TilesCame(FrameId frame, WorkerId from);
  void ForgetTiles(FrameId frame) { tiles_.erase(frame); }
  // Gives the turn to the client that it belongs to.
  void StartNext(Time now, WorkerActions& actions);
  // When to call StartNext although nothing else has happened. Time::max(): never.
  Time NextStart() const;
  // The client has used this much of the worker's time for something other than rendering.
  void Charge(ClientId client, Duration used) { turns_.Charge(client, used); }

  // Call when a render ends. Returns the executor's report with identities and fetch figures filled in, or nothing if the group was dropped
  // (the image is then released).
  std::optional<RankReport> Finish(const RenderDone& done, WorkerId worker, Time now, WorkerActions& actions);

  // The boxes of waiting jobs, a list for each client, none twice. The client that is next in turn comes first.
  struct WantedBoxes {
    std::vector<std::vector<BoxFetcher::Generation>> by_client;
    std::size_t of_next = 0;  // so many at the front are those of the first job: it needs all of them at a time
  };
  WantedBoxes BoxesInTurn() const;
  std::set<GroupKey> GroupsOn(BoxFetcher::Generation box) const;
  bool AnyPaused() const { return begun_.size() > (turn_ ? 1U : 0U); }
  std::size_t size() const { return waiting_.size() + begun_.size(); }

 private:
  struct Job {
    StartRender render;                         // without its image
    std::vector<BoxFetcher::Generation> boxes;  // of `render`, each acquired; the padded box is the last
    bool waited = false;                        // for voxels: its report tells of their fetch
  };
  struct Begun {
    Job job;
    bool dropped = false;
  };
  struct TurnNow {
    ClientId client = 0;
    Time begin;    // when the turn began
    Time charged;  // the time before this has been charged
  };
  using Waiting = std::map<std::tuple<ClientId, GroupKey, Rank>, Job>;

  struct Awaited {
    std::set<WorkerId> from;  // not empty
    Time until;
  };

  bool Complete(const Job& job) const;
  bool HasRoom(const Job& job) const;  // for what it derives, if others that have begun use its boxes
  void Release(const Job& job);
  bool Busy(ClientId client) const;
  bool OnlyTurns() const;                                 // nobody but the client whose turn it is has any job
  Waiting::const_iterator NextOf(ClientId client) const;  // its first job that can begin; end: none
  bool WantsTurn(ClientId client) const;
  std::set<ClientId> Clients() const;
  std::optional<ClientId> NextInTurn() const;  // never the client whose turn it is
  void ChargeTurn(Time now);
  void EndTurn(Time now);
  void Begin(ClientId client, Time now, WorkerActions& actions);

  BoxFetcher& boxes_;
  ImageNames& names_;
  Waiting waiting_;
  std::map<FrameId, Awaited> tiles_;
  std::map<ClientId, Begun> begun_;  // at most one of a client; all but that of the client whose turn it is are paused or dropped
  std::optional<TurnNow> turn_;
  FairTurns<ClientId> turns_{kCredit};
};

}  // namespace slabstream
