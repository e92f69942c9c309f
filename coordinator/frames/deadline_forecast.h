// DeadlineForecast: whether frames can be ready within their deadlines. If clients ask for more than the workers can do, frames that all
// run at a time would all be late. So a frame begins only if it and those that run are expected in time.
//
// Workers share their time equally among the clients whose frames run (RenderQueue), so a frame that runs beside those of n - 1 other
// clients gets an n-th of it (processor sharing; L. Kleinrock, 1967). The cost of a frame is the time that it gets: what it would take
// alone. Frames of one kind are expected to cost what the cheaper one of the latest two did, since the other one may have waited for its
// voxels. A frame that was late has cost more than was measured, so its kind is expected to cost four times that. That is a guess, by which
// frames wait; what was measured is known, and by it requests are refused. A kind that is not known yet costs nothing: its frames always
// begin. So do those of a client that is alone. Pure; one thread.
#pragma once

#include <cstdint>
#include <map>
#include <unordered_map>
#include <vector>

#include "common/base/time.h"
#include "common/wire/ids.h"
#include "coordinator/peer_token.h"

namespace slabstream {

// Frames of one dataset, renderer and size.
using FrameKind = std::uint64_t;

class DeadlineForecast {
 public:
  struct Frame {
    PeerToken client = 0;
    FrameKind kind = 0;
    Time deadline;
    Duration used{};  // by its client, before this frame (FairTurns)
  };

  void Begin(FrameId id, const Frame& frame, Time now);
  enum class Ended { kDone, kLate, kGivenUp };
  void End(FrameId id, Ended how, Time now);

  // Whether `frame` would be in time if it began now, and would make no frame of another client late. Frames of clients that have used more
  // of the service than its client may become late: nobody keeps others out by deadlines.
  bool MayBegin(const Frame& frame, Time now) const;

  Duration Expected(FrameKind kind) const;  // its cost; zero: not known
  Duration Least(FrameKind kind) const;     // that as far as it was measured: of late frames it was no guess
  Duration Left(Time now) const;            // what the running frames still cost at least

  static constexpr std::size_t kMostKinds = 1024;  // beyond, all are forgotten

 private:
  struct Running {
    Frame frame;
    Duration begun{};  // Shared() when the frame began
  };
  struct Remaining {
    const Frame* frame = nullptr;
    Duration cost{};
  };

  // What each client whose frames run has got since the start.
  Duration Shared(Time now) const;
  void Count(Time now);  // clients_ is about to change
  using CostOf = Duration (DeadlineForecast::*)(FrameKind) const;
  std::vector<Remaining> Remainders(Time now, CostOf cost) const;

  std::map<FrameId, Running> running_;
  std::map<PeerToken, std::size_t> clients_;  // with so many running frames
  std::map<PeerToken, Duration> idle_since_;  // Shared() when the client's last frame ended: a client's frames run one after the other
  Duration shared_{};
  Time counted_;  // up to when shared_ is
  struct Costs {
    Duration latest{}, before{}, least{};
  };
  std::unordered_map<FrameKind, Costs> costs_;
};

}  // namespace slabstream
