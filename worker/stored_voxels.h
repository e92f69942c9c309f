// StoredVoxels: reads voxels from the files that hold them, where this process sees the same files as the coordinator, straight to where a
// padded box stores them. It finds out by looking: until a source is open and known to be the same one, and wherever it is not, the
// coordinator is asked.
//
// One thread uses an object of this class.
#pragma once

#include <functional>
#include <memory>

#include "worker/stored_box.h"
#include "worker/worker_machine.h"

namespace slabstream {

class StoredVoxels {
 public:
  // `deliver`: called on any thread, never once this is destroyed.
  explicit StoredVoxels(std::function<void(WorkerEvent)> deliver);
  ~StoredVoxels();
  StoredVoxels(const StoredVoxels&) = delete;
  StoredVoxels& operator=(const StoredVoxels&) = delete;

  // Begins to read a piece of stored voxels into the padded box, unless that is under way: ChunkStored or ChunkRefused will come. False:
  // the coordinator must be asked.
  bool Read(const SendChunkRequest& wanted, const std::shared_ptr<StoredBox>& padded);

 private:
  struct Shared;  // with reads that outlive this
  const std::shared_ptr<Shared> shared_;
};

}  // namespace slabstream
