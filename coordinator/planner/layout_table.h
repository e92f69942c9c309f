// LayoutTable: the layouts that frames are planned with, and the costs learnt from their render times.
//
// A layout is made once for a volume, transfer function, renderer, policy and number of slots, and stays for all views. Two things
// change it. If boxes are split by cost, it is made anew once, when costs are first known. And it changes between frames when the policy's
// balance says so (common/planning/balances.h). Another number of slots (a worker has joined, a vacancy was given up) has another layout;
// learnt costs hold for all of them. Changes are made when a frame has taught them; frames that begin meanwhile take what is there.
//
// The last few layouts and costs are kept. The least recently used go first.
//
// Any thread may call it. Layouts are made while nobody waits: of two that are made at a time for the same, the first one stays.
#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <stop_token>
#include <vector>

#include "common/base/lru_map.h"
#include "common/planning/classified_volume.h"
#include "common/planning/frame_noise.h"
#include "common/planning/frame_plan.h"
#include "common/planning/layout.h"
#include "common/planning/measured_cost.h"
#include "common/stats/report.h"
#include "common/volume/occupancy_grid.h"

namespace slabstream {

class LayoutTable {
 public:
  static constexpr std::size_t kMaxKept = 16;   // layouts
  static constexpr std::size_t kMaxLearnt = 4;  // costs: two thirds of an OccupancyGrid each
  // the least weight of a frame, however many came before it: older ones fade by a fifth a frame
  static constexpr double kLeastWeight = 0.2;

  struct Request {
    const ResolvedPolicy* policy = nullptr;
    const ClassifiedVolume* volume = nullptr;  // the frame's volume
    const VolumeSummary* summary = nullptr;
    std::shared_ptr<const OccupancyGrid> occupied;  // null: the policy does not need it
    std::uint32_t slots = 1;
    std::vector<std::uint64_t> hosts = {};  // LayoutRequest::hosts
    std::int64_t box_bytes_target = kBoxBytesTarget;
    // The levels that the frame draws (ResolvedRequest::map and coarser).
    std::shared_ptr<const LevelMap> map = {};
    std::span<const CoarserVolume> coarser = {};
    std::stop_token stop = {};  // told to stop, Find returns soon
  };
  // The layout to plan the frame with; null: it was stopped.
  std::shared_ptr<const Layout> Find(const Request& request);
  // Whether FindMade may find one, for some box_bytes_target.
  bool HasMade(const Request& request);
  // That layout if it is made; null: ask Find. Needs policy, volume, slots, hosts, box_bytes_target and map alone, and does not wait for
  // other threads.
  std::shared_ptr<const Layout> FindMade(const Request& request);

  // Learns from a finished frame of this request, which has occupied voxels; then the layout changes if it should.
  void Learn(const Request& request, const FramePlan& plan, std::span<const RankReport> reports);

 private:
  struct Key {
    ClassifiedVolume volume;
    ResolvedPolicy policy;
    std::uint32_t slots = 1;
    std::vector<std::uint64_t> hosts = {};
    std::int64_t box_bytes_target = kBoxBytesTarget;
    LevelMap map = {};  // with one level: the whole volume
    friend bool operator==(const Key&, const Key&) = default;
  };
  // Combining moves no box, so policies that differ in that alone share a layout.
  static Key KeyOf(const Request& request);
  struct Entry {
    std::shared_ptr<const Layout> layout;
    bool by_cost = false;         // made when costs were known
    int frames_seen = 0;          // frames of this layout
    std::vector<double> seconds;  // by box, over these frames; newer ones count more; 0: not rendered yet
    double lost = 0;              // LostSeconds of these frames
    double lost_at_look = 0;      // `lost` when a change was weighed last
  };
  struct Learnt {
    MeasuredCost cost;
    FrameNoise noise = {};
    MoveSeconds move = {};
  };
  std::shared_ptr<const Layout> FindEarlier(const Key& key) const;     // under the lock: of another look at the same volume; null: none
  std::optional<WorkField> KnownCost(const ClassifiedVolume& volume);  // measured, in seconds; nothing: no cost is known
  // Returns whether the frame was of the present layout.
  bool LearnCosts(const Request& request, const Key& key, const FramePlan& plan, std::span<const RankReport> reports);
  // Weighs whether the layout should change, and changes it. For requests with occupied voxels.
  void ChangeLayout(const Request& request, const Key& key);
  // The result points at both.
  static LayoutRequest MakingOf(const Request& request, const std::optional<WorkField>& cost);

  std::mutex mutex_;  // guards what follows
  LruMap<Key, Entry> entries_;
  LruMap<ClassifiedVolume, Learnt> learnt_;
};

}  // namespace slabstream
