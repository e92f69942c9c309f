// What the machine sends to a planner and gets from it: values that are safe to hand to another thread.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <stop_token>
#include <vector>

#include "common/planning/frame_plan.h"
#include "common/planning/frame_window.h"
#include "common/planning/levels.h"
#include "common/planning/worker_memory.h"
#include "common/stats/report.h"
#include "common/volume/occupancy_grid.h"
#include "coordinator/peer_token.h"

namespace slabstream {

using PlanId = std::uint64_t;  // never given twice; 0: none

struct PlanRequest {
  PlanId plan = 0;
  PeerToken client = 0;
  std::shared_ptr<const ResolvedRequest> resolved;  // never null; every plan of a request has the same one
  std::shared_ptr<const OccupancyGrid> occupied;    // of its volume; null: the policy does not need it (NeedsOccupancy)
  Roster roster;                                    // the frame's team; it has a worker
  std::vector<std::uint64_t> hosts = {};            // by slot: the worker's Register::memory_scope; empty: nobody owns the volume's voxels
  Turn turn;
  std::uint64_t share_pixels = 0;        // ClientTakes::share_pixels
  std::uint64_t worker_memory = 0;       // bytes: the least limit of the workers that stay; 0: none has stated one
  std::uint64_t own_memory = 0;          // bytes: the coordinator's limit; 0: none
  std::vector<WorkerLimit> limits = {};  // the limits of all workers, and of those that are leaving
  // For a dataset with several levels: what the client asked for, its levels, and the level that `resolved` is of.
  // Null: the dataset has one level.
  std::shared_ptr<const FrameRequest> frame = nullptr;
  std::shared_ptr<const VolumeLevels> levels = nullptr;
  int level = 0;
  std::stop_token stop = {};  // told to stop: nobody wants the plan any more
};

struct PlannedFrame {
  PlanRequest asked;
  FramePlan plan = {};
  Result<int> fit = kMostInWindow;  // FramesThatFit
  // If the frame does not fit: the finest of the coarser levels that does. If the dataset has one level: the level that
  // slabstream convert would make.
  std::optional<int> level_that_fits = {};

  bool teaches() const { return asked.occupied != nullptr; }  // render times help to plan coming frames
};

// A finished frame: how it was planned and how long its boxes took to render, for the planner to learn from.
struct FrameMeasured {
  std::shared_ptr<const PlannedFrame> frame;
  std::vector<RankReport> reports;
};

}  // namespace slabstream
