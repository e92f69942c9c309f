// Owners: processes that hold the voxels of datasets in their own memory, as the coordinator knows them (common/wire/owner_messages.h).
//
// The owners of a field have numbers and boxes that tile its volume. Once all are there, the field's whole time is the least of the latest
// times that they have committed; then it is a dataset, whose source (data/owned/owned_source.h) has the voxels of a whole time. Owners are
// told which times may not be overwritten: those of sources that live, and while somebody looks the whole one and later ones. Owners that
// are ahead may have overwritten it before, so a time is shown once all have said that they hold it. Opening waits for that, for
// kOwnerWaits at most. Owners that wait for others for kOwnerWaits may go on until there is another whole time.
//
// An owner is lost when it leaves, when its connection ends, or when it is silent for kOwnerTimeout. Until another one takes its place, the
// field cannot be opened. When all are lost, the dataset goes.
//
// An owner that makes its boxes on demand may take any time for one: it answers as long as it says that it is making.
//
// For the service's thread. Sources that are open may outlive this; what they ask then fails.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/base/time.h"
#include "common/wire/any_message.h"
#include "coordinator/datasets/dataset_machine.h"
#include "coordinator/peer_token.h"
#include "data/owned/owned_source.h"

namespace slabstream {

inline constexpr Duration kOwnerHeartbeat = std::chrono::seconds(1), kOwnerTimeout = std::chrono::seconds(5);
inline constexpr Duration kOwnerLooked = std::chrono::seconds(10);   // how long somebody looks who has asked for a field
inline constexpr Duration kOwnerWaits = std::chrono::seconds(10);    // for slower ones, while somebody looks
inline constexpr Duration kOwnerAnswers = std::chrono::seconds(10);  // without any, what an owner is asked for fails
inline constexpr std::size_t kMostAskedOfOwner = 16;                 // requests that are out; others wait
inline constexpr std::size_t kMostFieldBoxes = 65536;                // of all owners of a field
inline constexpr std::size_t kMostFields = 64;

// At rest, with no source open, the last three are 0.
struct OwnerSizes {
  std::size_t fields = 0, owners = 0;
  std::size_t out = 0;      // requests to the owner that has most
  std::size_t waiting = 0;  // to all owners
  std::size_t uses = 0;     // sources that live, and what is kept of times before an owner left
};

class Owners {
 public:
  // What follows: messages to send, and events for the DatasetMachine, in order.
  struct News {
    std::vector<std::pair<PeerToken, CoordinatorToOwner>> messages;
    std::vector<OwnedData> datasets;
  };

  // `name_is_free`: as DatasetMachine::NameIsFree. `wake` is called from any thread: Tend has something to do.
  Owners(Epoch epoch, std::function<Status(const std::string&)> name_is_free, std::function<void()> wake);
  ~Owners();

  News Hear(PeerToken from, OwnerToCoordinator message, const Bytes& payload, Time now);
  News Gone(PeerToken peer, Time now);  // it could not be sent a message: its connection has ended
  // What time has brought, and other threads: at least every second, after each event, and when `wake` was called.
  News Tend(Time now);

  // What is shown of a field to somebody who asked for it at `since`. Nothing: it may be there when something has happened, and at the
  // latest at `since` + kOwnerWaits there is an error. DataSource::open waits for that. Unavailable: why it is not shown.
  std::optional<Result<OwnedVolume>> Open(const std::string& name, Missing missing, Time since, Time now);

  // Changes parameters, all or none; what to tell the owner comes with the next Tend. NotFound, InvalidArgument: there is nothing to steer,
  // no such parameter, or a value beyond its limits.
  Result<SimulationStatus> Steer(const SteerDataset& order);
  // Fills in what each dataset's simulation is at.
  void Describe(std::vector<DatasetStatus>& datasets) const;
  OwnerSizes sizes() const;

 private:
  struct State;
  const std::shared_ptr<State> state_;  // shared with sources
};

}  // namespace slabstream
