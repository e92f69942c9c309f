// Tally: how often things happened over all worlds, so that a test can see that it tested something.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace slabstream {

enum class Count : std::size_t {
  kWorlds,
  kGrids,
  kRequests,
  kPictures,
  kRetriedPictures,
  kPreviews,
  kErrors,
  kErrorsOfDeadline,
  kErrorsOfMemory,
  kErrorsOfWorkers,
  kErrorsOfStores,
  kCancelled,
  kGivenUp,
  kRequestsAfterHealing,
  // what broke
  kLostMessages,
  kDoubledMessages,
  kDelayedMessages,
  kWorkersKilled,
  kPreemptions,
  kWorkersLeft,
  kWorkersWithoutMemory,
  kLargeFramesRefused,
  kSlowWorkers,
  kSlowRenders,
  kRendersBesideOthers,
  kCuts,
  kMessagesLostByCuts,
  kMessagesHeldByCuts,
  kWorkerPauses,
  kCoordinatorPauses,
  kSuspensions,
  kClockJumps,
  kCoordinatorRestarts,
  kVanishedClients,
  kFileChanges,
  kDataOrders,
  kVolumesSent,
  kHostileClients,
  kHostileClientMessages,
  kStrangers,
  kHostileWorkers,
  kHostileWorkersAdmitted,
  kGroupsOfHostileWorkers,
  kHostileWorkerMessages,
  kHostileImages,
  kWorldsInParts,
  kOwnReads,
  kSlowReads,
  kLostReads,
  kFailedReads,
  kBadBlocks,
  kReadsOfOtherFiles,
  // what came of it
  kAttempts,
  kRetired,
  kTroubles,
  kTroublesElsewhere,
  kComplaints,
  kHandedOver,
  kCachedFrames,
  kCellChunks,
  kMasks,
  kMasksOfRetries,
  kHiddenPixels,
  kHiddenBoxes,
  kFronts,
  kSharedPictures,
  kSharedPicturesRetried,
  kCountsOfVoxels,
  kMovedBoxes,
  kReadAnew,
  kFramesOfRetiredVoxels,
  kEnd
};

struct CountRule {
  std::string_view what;
  std::uint64_t least;  // in a thousand worlds
};

inline constexpr std::array<CountRule, std::size_t(Count::kEnd)> kCountRules{{
    {"worlds", 1000},
    {"worlds with a grid", 200},
    {"requests", 4000},
    {"pictures", 3000},
    {"pictures after more than one attempt", 300},
    {"previews", 1000},
    {"errors: other", 10},
    {"errors: deadline", 1},
    {"errors: memory", 5},
    {"errors: workers", 50},
    {"errors: stores", 20},
    {"cancelled", 50},
    {"given up by the client", 20},
    {"requests after healing", 1000},
    {"messages lost", 1000},
    {"messages doubled", 5000},
    {"messages delayed", 1000},
    {"workers killed", 500},
    {"preemptions of half of the workers", 50},
    {"workers told to leave", 250},
    {"workers without memory for large frames", 50},
    {"renderings and combinings refused for memory", 50},
    {"slow workers", 50},
    {"slow renderings", 100},
    {"renderings beside one of another client", 20},
    {"one-way cuts", 200},
    {"messages lost by cuts", 1000},
    {"messages held back by cuts", 800},
    {"pauses of workers", 100},
    {"pauses of the coordinator", 50},
    {"suspensions of everybody", 50},
    {"jumps of the coordinator's clock", 50},
    {"coordinator restarts", 50},
    {"vanished clients", 50},
    {"changes of the volume's file", 250},
    {"orders about datasets", 250},
    {"volumes sent by a client", 20},
    {"hostile clients", 50},
    {"messages of hostile clients", 1000},
    {"hostile strangers to workers' connections", 50},
    {"hostile workers", 50},
    {"hostile workers, admitted", 50},
    {"groups handed to hostile workers", 50},
    {"messages of hostile workers to the coordinator", 1000},
    {"messages of hostile workers to workers", 500},
    {"worlds with a volume that is read in parts", 150},
    {"reads by workers themselves", 2000},
    {"slow reads", 500},
    {"reads that never end", 30},
    {"reads that fail", 200},
    {"reads of damaged blocks", 100},
    {"reads of a file that has changed", 50},
    {"attempts after the first", 500},
    {"workers told to register again", 50},
    {"troubles that workers reported", 100},
    {"troubles that another worker might not have", 100},
    {"complaints about unreachable workers", 20},
    {"frames handed over without loss", 10},
    {"frames from cached voxels", 100},
    {"chunks of cells", 5000},
    {"groups with hidden tiles", 1000},
    {"groups with hidden tiles after the first attempt", 20},
    {"pixels without hidden boxes", 1000},
    {"boxes not rendered", 1000},
    {"boxes with something hidden before anything is drawn", 100},
    {"pictures in shares", 80},
    {"pictures in shares after the first attempt", 2},
    {"counts of occupied voxels", 250},
    {"boxes moved by balance", 50},
    {"loads after a change", 100},
    {"groups of frames whose file has changed since", 20},
}};

class Tally {
 public:
  void Add(Count count, std::uint64_t times = 1) { counts_[std::size_t(count)] += times; }
  std::uint64_t operator[](Count count) const { return counts_[std::size_t(count)]; }

  double virtual_seconds = 0;

 private:
  std::array<std::uint64_t, std::size_t(Count::kEnd)> counts_{};
};

}  // namespace slabstream
