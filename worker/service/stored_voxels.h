// StoredVoxels: reads chunks of voxels from the files that hold them, if this process sees the same files as the coordinator. It finds that
// out by opening them. Until a source is open and known to be the same one, the coordinator must be asked. A place that it does not see, or
// cannot read any more, is tried again after kLookAgain. The last kMostPlaces stay open.
//
// One thread uses an object of this class. What it reads comes back through the mailbox as if the coordinator had sent it.
#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>

#include "common/base/time.h"
#include "worker/machine/worker_machine.h"
#include "worker/service/stored_box.h"

namespace slabstream {

class StoredVoxels {
 public:
  static constexpr Duration kLookAgain = std::chrono::seconds(10);
  static constexpr std::size_t kMostPlaces = 16;  // sources in one version each

  // `deliver`: called on any thread, never once this is destroyed.
  explicit StoredVoxels(std::function<void(WorkerEvent)> deliver);
  ~StoredVoxels();
  StoredVoxels(const StoredVoxels&) = delete;
  StoredVoxels& operator=(const StoredVoxels&) = delete;

  // Begins to read a piece of stored voxels into the padded box, unless that is under way: ChunkStored or ChunkRefused will come. False:
  // the coordinator must be asked; `in_place` of the request then tells whether to have the voxels made is enough.
  bool Read(SendChunkRequest& wanted, const std::shared_ptr<StoredBox>& padded, Time now);

 private:
  struct Shared;  // with reads that outlive this
  const std::shared_ptr<Shared> shared_;
};

}  // namespace slabstream
