// StepOrder: which steps of a schedule may be taken next at some of its ranks: those of one worker, or all of them.
//
// A step may be taken at a rank when the rank is rendered and all its earlier steps on the same pixels are taken.
// Nothing may be combined for the rank meanwhile, unless the step receives: the caller combines in the order of the
// steps. So the same images meet in any order of arrival, and steps of disjoint pixels do not wait for each other. If
// several steps may be taken at a rank, those that send come first: others wait for what they send, and nobody else for
// what it combines. For each step the object counts what it still waits for, so an event costs no scan over the open
// steps. Memory grows with the steps of its own ranks.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "common/base/index_set.h"
#include "common/combining/named_schedule.h"

namespace slabstream {

class StepOrder {
 public:
  // `ranks`: the ranks here, ascending, all below the schedule's number of ranks.
  StepOrder(SharedSchedule schedule, std::vector<Rank> ranks);

  const IndexedSchedule& schedule() const { return *schedule_; }
  const std::vector<Rank>& ranks() const { return numbers_; }

  // The functions below take ranks that are here.
  void OnRendered(Rank rank);
  void OnCombineStarted(Rank rank) { ++At(rank).combining; }
  void OnCombined(Rank rank);
  // A turn is the part of a rank that is here in a step: [0, turn_count()).
  std::uint32_t turn_count() const { return std::uint32_t(turns_.size()); }
  // The receiver's turn if the step goes from a rank elsewhere to one here, and not all of its pixels have been taken.
  std::optional<std::uint32_t> Awaited(std::uint32_t step) const;
  // `pixels` have come from a rank that is not here. The turn is that of an Awaited step, which has not had these pixels yet.
  void OnArrived(std::uint32_t turn, std::uint64_t pixels);

  // kReceive: all pixels that have arrived and are not taken yet. It comes again if more arrive. kMove: between two ranks that are here.
  enum class Kind : std::uint8_t { kSend, kReceive, kMove };
  struct Taken {
    Kind kind = Kind::kSend;
    std::uint32_t step = 0;
    std::uint32_t turn = 0;  // kMove: one of the two
    Rank rank = 0;           // the turn's rank
    bool last = true;        // false: more of the step's pixels are to arrive
  };
  // A step that may be taken now; it counts as taken. None: wait for the next event.
  std::optional<Taken> TakeNext();

  bool Rendered(Rank rank) const { return At(rank).rendered; }
  bool HasOpenSteps(Rank rank) const { return At(rank).open_steps > 0; }
  // Rendered, all steps taken, and nothing is being combined.
  bool Done(Rank rank) const { return At(rank).free() && At(rank).open_steps == 0; }

 private:
  static constexpr std::uint32_t kElsewhere = ~std::uint32_t{0};

  struct Turn {  // half a cache line: there may be millions, and each is looked at when the others have filled the caches
    std::uint32_t step = 0;
    std::uint32_t rank = 0;                   // index into ranks_
    std::uint32_t partner = kElsewhere;       // the other rank's turn, if that rank is here too
    std::uint32_t first_waiter = kElsewhere;  // the only turn that waits for this one; of many, their place in waiters_
    std::uint32_t waits : 28 = 0;             // number of earlier turns of the rank to wait for
    bool many_waiters : 1 = false;            // wait for this one
    bool sends : 1 = false;                   // or it receives
    bool untaken : 1 = false;                 // some pixels have arrived and are not taken
    bool taken : 1 = false;
    std::uint64_t missing = 0;  // pixels of a step from elsewhere that have not arrived
  };
  struct RankState {
    Rank number = 0;
    std::uint32_t first_turn = 0, turn_end = 0;
    std::uint32_t open_steps = 0;
    std::uint32_t combining = 0;
    bool rendered = false;
    bool free() const { return rendered && combining == 0; }
  };

  std::optional<std::uint32_t> FindRank(Rank rank) const;
  // The part of the step's sender or receiver in it, if that rank is here.
  std::optional<std::uint32_t> FindSending(std::uint32_t step) const;
  std::optional<std::uint32_t> FindReceiving(std::uint32_t step) const;
  RankState& At(Rank rank);
  const RankState& At(Rank rank) const;
  const Step& StepOf(const Turn& turn) const { return schedule_->steps()[turn.step]; }
  void FindWaits();
  void Offer(std::uint32_t turn);
  void Close(std::uint32_t turn);

  SharedSchedule schedule_;
  std::vector<Rank> numbers_;
  std::vector<RankState> ranks_;        // by numbers_; most lookups touch only these
  std::vector<Turn> turns_;             // rank by rank, each in order of steps
  std::vector<std::uint32_t> waiters_;  // who waits for turns with many waiters: their number, then they
  IndexSet sendable_;                   // turns that send elsewhere and wait only for their rank to be free
  IndexSet possible_;                   // other turns that wait only for their ranks to be free
  IndexSet changed_;                    // ranks at which a turn may have become possible
};

}  // namespace slabstream
