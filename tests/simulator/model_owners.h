// ModelOwners: in some worlds the voxels of the dataset lie in processes that own them. The coordinator's end is Owners and theirs
// OwnerMachine, as in the service. A voxel says by its value which life of which owner gave it, and at which time.
//
// Owners commit times at their own pace. They stand still, vanish, leave, and come again as another life or over another connection; they
// answer late or never, and lie about sizes, epochs and boxes; strangers register with sizes or boxes that do not fit. Clients steer. What
// is checked:
//
//   every voxel that a source gives is of the source's time, and of the life of the owner that holds it; or it is 0 and the source says so
//   no used time is overwritten while a source of it lives, unless its owner and the coordinator have lost each other since
//   no owner is asked for more at a time than kMostAskedOfOwner, nor for voxels that it has not
//   what is steered lies within limits, and what is refused changes nothing
//   errors name the dataset
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/owner/owner_machine.h"
#include "coordinator/datasets/dataset_machine.h"
#include "coordinator/service/owners.h"
#include "data/sources/read_context.h"
#include "simulator/simulated_service.h"
#include "tests/simulator/faults.h"
#include "tests/simulator/network.h"
#include "tests/simulator/tally.h"

namespace slabstream {

class ModelOwners {
 public:
  using TellDatasets = std::function<void(DatasetEvent)>;  // now

  // `volume`: its geometry is that of the field; summaries of loaded times are made after it. `faults` may change: what they say at the
  // time counts. All outlive the object.
  ModelOwners(SimulatedService& service, Random& random, const Faults& faults, FaultyNetwork& network, const VolumeSummary& volume,
              Tally& tally, TellDatasets tell);

  // ---- what the coordinator has done by other threads
  void StartCoordinator(Epoch epoch, std::function<Status(const std::string&)> name_is_free);
  void StopCoordinator();
  void Load(const LoadDataset& action);  // -> DatasetLoaded or DatasetFailed
  void Unload(DatasetId dataset);
  void Read(const ChunkRequest& request, std::function<void(const VoxelsToWorker&)> answer);  // of a dataset that is loaded

  // ---- what happens in the world
  void PlanTroubles(Duration span);
  void Heal();
  void LeaveAll();

  // ---- what must hold
  bool calm() const { return calm_ && orderly_; }  // owners do what they should, and no word of theirs is lost
  // A picture of this dataset, which says what it lacks.
  void CheckPicture(DatasetId dataset, Missing wanted, const std::string& missing) const;
  void CheckRecovered();
  OwnerSizes sizes() const { return owners_->sizes(); }

 private:
  struct Process {
    OwnerMachine machine;
    bool alive = true, stranger = false;
    int end = 0;             // its connection's
    bool told_dead = false;  // the sockets notice its end
    double step = 0;         // seconds, about
    double stalled = 0;      // until then it begins no time
    double held = 0;         // until then it stands still
    double known_since = 0;  // to the coordinator
    double alarm = -1;
    std::uint64_t time = 0;                                 // the last one that it has committed, or that it begins after
    std::optional<std::uint32_t> begun = {};                // a slot
    std::array<std::uint64_t, kMostOwnerSlots> times = {};  // by slot; 0: none
  };
  // What is open.
  struct Source {
    std::shared_ptr<VolumeSource> source;
    std::vector<float> voxels;  // as they should be
    bool has_holes = false;     // voxels of nobody
  };
  struct Use {
    std::weak_ptr<const void> source;
    std::uint64_t time = 0;
    std::vector<std::uint64_t> incarnations;
    double since = 0;
  };
  struct Opening {
    LoadDataset action;
    Time since;
  };
  struct Done {
    std::uint64_t read = 0;
    Result<Bytes> samples;
  };
  struct Inbox {  // filled by the thread that decodes
    std::mutex mutex;
    std::vector<Done> done;
  };
  using Ended = std::function<void(const Result<Bytes>&)>;

  // ---- owners
  RegisterOwner Registration(std::uint32_t number);
  void Spawn(const RegisterOwner& as, bool stranger);
  void Connect(Process& process);  // anew
  void SpawnStranger();
  void Supervise();  // a process that has ended is started again
  Process* LivingOwner(std::uint32_t number);
  Process* SomeOwner();
  void End(Process& process, bool silently);
  std::uint64_t Slowest() const;
  void AtProcess(Process& process, double when, std::function<void()> what);
  void Say(Process& process);
  void Hear(Process& process, const CoordinatorToOwner& message);
  void Answer(Process& process, const ChunkRequest& request);
  void Send(Process& process, const OwnerToCoordinator& message, const Bytes& payload);
  void TryBegin(Process& process);
  void Commit(Process& process);
  void CheckOverwritten(const Process& process, std::uint64_t time) const;
  void Steer();

  // ---- the coordinator
  void AtCoordinator(double when, std::function<void()> what);
  void Follow(Owners::News news);
  void PlanTend(double when);  // or earlier
  void Tend();
  void TryOpen();
  bool TryOpen(const Opening& opening);
  std::function<void(Result<Bytes>)> BeginRead(Ended ended);  // what to call from any thread when it ends
  void TakeReads();
  void Loaded(const LoadDataset& action, const std::shared_ptr<Source>& opened, const Result<Bytes>& samples);
  std::shared_ptr<Source> Opened(OwnedVolume volume);
  static void CheckSamples(const Source& source, const Box& box, std::uint64_t begin, const Bytes& samples);

  SimulatedService& service_;
  Random& random_;
  const Faults& faults_;
  FaultyNetwork& network_;
  const VolumeSummary& volume_;
  Tally& tally_;
  const TellDatasets tell_;

  const bool calm_, orderly_;  // orderly: no message is lost, doubled or reordered
  const std::uint32_t count_;  // owners
  const std::uint64_t drift_;  // times that an owner may be ahead of the slowest one
  bool healed_ = false, left_ = false;
  std::vector<std::vector<Box>> boxes_;  // by owner
  std::deque<Process> processes_;        // that there are or were
  std::map<int, Process*> by_end_;
  int last_end_ = 0;

  std::uint64_t generation_ = 0;  // of the coordinator
  Epoch epoch_ = 0;
  std::atomic<bool> woken_ = false;
  std::unique_ptr<Owners> owners_;
  double tend_at_ = -1;
  std::vector<Opening> openings_;
  std::map<DatasetId, std::shared_ptr<Source>> sources_;
  std::vector<Use> uses_;
  std::map<std::string, double> first_opened_;  // by OwnedField::Text
  const SourceContext context_;
  const std::shared_ptr<Inbox> inbox_ = std::make_shared<Inbox>();
  std::map<std::uint64_t, Ended> reads_;
  std::uint64_t last_read_ = 0;
};

}  // namespace slabstream
