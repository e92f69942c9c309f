// ModelWorker: what a simulated worker has in place of voxels and pixels. Images are symbolic; of its padded boxes it knows which chunks
// they hold. It checks that its machine uses both as an executor would have to demand it.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <tuple>
#include <vector>

#include "simulator/simulated_service.h"
#include "tests/simulator/faults.h"
#include "tests/simulator/model_cells.h"
#include "tests/simulator/tally.h"
#include "tests/support/symbolic_images.h"
#include "worker/machine/worker_machine.h"

namespace slabstream {

inline constexpr ScalarType kVoxelType = ScalarType::kFloat32;  // the type of the only volume
inline constexpr DatasetId kShapeDataset = 1000000;             // bytes of the only shape
inline constexpr ScalarType TypeOf(DatasetId dataset) { return dataset == kShapeDataset ? ScalarType::kUint8 : kVoxelType; }

struct WorkerSpeed {
  double render = 0, combine = 0, store = 0, finish = 0;  // seconds
  double large = 1;                                       // times as long renders a box of a large frame
};

class ModelWorker {
 public:
  // `faults` may change: what they say at the time counts.
  ModelWorker(Node node, WorkerConfig config, const WorkerSpeed& speed, const Faults& faults, Random& random,
              const SimulatedService& service, const ModelCells& cells, Tally& tally)
      : node_(node),
        config_(std::move(config)),
        speed_(speed),
        faults_(faults),
        random_(random),
        service_(service),
        cells_(cells),
        tally_(tally) {}

  void SlowDown(double slowness) { slowness_ = slowness; }
  void TakeMemory() { has_memory_ = false; }  // for large frames
  void Heal() { slowness_ = 1, has_memory_ = true; }

  // As Conditions::Begin.
  WorkCost Begin(Job& job);
  WorkerEvent Answer(Job& job);
  void Perform(const OpenBox& action);
  void Perform(const DropBox& action);
  void Perform(const ReleaseImage& action) { images_.Release(action.image); }
  void Perform(const StopProcess&);
  void OnRequest(const ChunkRequest& request);
  void CheckCredit();

  bool stopped() const { return stopped_; }
  std::size_t images() const { return images_.size(); }
  std::size_t boxes() const { return boxes_.size(); }

 private:
  struct Outstanding {
    std::uint64_t bytes = 0;
    Time requested;
  };
  using ChunkName = std::tuple<DatasetId, Box, std::uint32_t>;
  struct ModelBox {
    std::map<Box, std::set<std::uint32_t>> chunks;  // stored chunks of voxels, by box
    std::set<std::uint32_t> cell_chunks;            // stored
    std::vector<OpenBox::Copy> copied;
    bool rendered = false;
  };

  double Begin(Job& job, const StartRender& action);
  double Begin(Job& job, const StoreChunk& action);
  double Begin(Job& job, const StartCombine& action);
  double Begin(Job& job, const FindHidden& action);
  double Begin(Job& job, const SendPartial& action);
  double Begin(Job& job, const SendFrame& action);
  double Slowed(double seconds, double longest);
  bool LacksMemory(std::uint64_t pixels);
  RenderDone Rendered(const StartRender& render, bool cancelled);
  ChunkStored Stored(const StoreChunk& store);
  bool Complete(const BoxKey& key) const;

  const Node node_;
  const WorkerConfig config_;
  const WorkerSpeed speed_;
  const Faults& faults_;
  Random& random_;
  const SimulatedService& service_;
  const ModelCells& cells_;
  Tally& tally_;
  bool stopped_ = false;
  double slowness_ = 1;
  bool has_memory_ = true;

  SymbolicImages images_;
  struct Rendering {
    ClientId client = 0;
    BoxKey padded;
    double seconds = 0;
  };
  std::map<ImageHandle, Rendering> rendering_;   // begun and not ended, paused or not
  std::map<ImageHandle, OcclusionMask> hidden_;  // found, and not yet told
  std::map<BoxKey, ModelBox> boxes_;             // boxes that are open
  std::map<ChunkName, Outstanding> requested_;   // and not yet stored, as the credit counts
};

}  // namespace slabstream
