// OwnerMachine: what an owner of voxels says to the coordinator, and which of its slots it may give away, as a pure state machine.
//
// The executor sends what Say returns, in order: after it has given the machine messages, after Commit, and at NextWake. Between Begin and
// Commit of a slot the simulation writes its samples. The executor answers ChunkRequests of the machine's epoch.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/base/status.h"
#include "common/base/time.h"
#include "common/wire/owner_messages.h"
#include "data/owned/owner_memory.h"

namespace slabstream {

class OwnerMachine {
 public:
  // `slots`: 2 ... kMostOwnerSlots.
  OwnerMachine(RegisterOwner as, std::uint32_t slots) : registration_(std::move(as)), slots_(slots) {}

  void Hear(CoordinatorToOwner message, Time now);
  void Refuse(Status why) { refused_ = std::move(why); }
  // Nothing more once it is refused. `making`: OwnerPing::making.
  std::vector<OwnerToCoordinator> Say(Time now, bool making = false);
  Time NextWake() const { return next_send_; }  // or earlier

  // Of the oldest time that nobody uses. Never that of the latest one: the simulation may compute the next time from it.
  std::optional<std::uint32_t> FreeSlot() const;
  std::uint64_t Begin(std::uint32_t slot);  // the time that it held; 0: none
  void Commit(std::uint32_t slot, std::uint64_t time, double simulated);

  const RegisterOwner& registration() const { return registration_; }  // its parameters have their present values
  Epoch epoch() const { return epoch_; }                               // 0: the coordinator does not know this owner
  Duration heartbeat() const { return heartbeat_; }
  std::uint64_t latest() const { return latest_; }  // time; 0: none yet
  bool looked_at() const { return looked_at_; }
  const Status& refused() const { return refused_; }  // not ok: this is the end

 private:
  static constexpr Duration kRegisterAgain = std::chrono::seconds(1);
  static constexpr Duration kOthersLeave = std::chrono::seconds(10);  // what an owner before this one needs to be lost

  void Forget();  // the coordinator: nobody uses a time any more

  RegisterOwner registration_;
  const std::uint32_t slots_;
  std::array<std::uint64_t, kMostOwnerSlots> times_ = {};  // 0: none
  std::uint64_t latest_ = 0, gone_ = 0;                    // gone: the latest time that was overwritten
  double simulated_ = 0;
  std::vector<std::uint64_t> used_;  // ascending
  std::uint64_t hold_ = 0;           // of the last OwnerPong
  bool looked_at_ = false;
  Status refused_;
  std::optional<Time> refused_since_;  // with Unavailable, and not taken since
  Epoch epoch_ = 0;
  Time heard_, next_send_ = {};
  Duration heartbeat_ = kRegisterAgain, timeout_ = {};
  std::uint64_t told_ = 0;  // time
};

}  // namespace slabstream
