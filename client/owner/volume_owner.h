// VolumeOwner: a process that keeps its part of a field in its own memory and lets a service draw it.
//
//   1. Start names the field, this process's place among its owners, and its boxes.
//   2. For each time: Begin gives memory for the samples of all boxes; write them; Commit says that they are whole.
// The process goes on whether there is a service or not: it registers when one is there, and again after it was away. Only while pictures
// are made of a time, Begin waits rather than giving its memory away.
//
// An owner may make its boxes on demand (`make`). Then step 2 gives no samples: a box is made when a picture needs it, and kept within a
// budget.
//
// A thread of its own talks with the coordinator and sends voxels to hosts that cannot map this process's memory. Begin and Commit are for
// one thread.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "client/owner/box_maker.h"
#include "common/base/status.h"
#include "common/base/time.h"
#include "common/transport/context.h"
#include "common/transport/keys.h"
#include "common/volume/volume.h"
#include "common/wire/owners_structs.h"
#include "data/owned/owner_memory.h"

namespace slabstream {

struct VolumeOwnerOptions {
  std::string endpoint = {};      // for workers and owners; not used with a service file
  std::string service_file = {};  // owner.json of a service with keys; empty: it has none
  std::string dataset;            // common/frame/dataset_name.h
  std::uint32_t owner = 0;        // below `owners`, each once
  std::uint32_t owners = 1;       // that hold the field together, [1, 4096]
  // Of all fields of the dataset, on one grid and of one type: at most 64 names of at most 64 characters; none: it has one without a name.
  std::vector<std::string> fields = {};
  std::uint32_t field = 0;  // which of them this owner holds boxes of
  // Of the whole volume. The mapping is that of layout.samples; the type is filled in.
  VolumeDescription description;
  OwnerLayout layout;        // its size is filled in; 2 ... kMostOwnerSlots slots
  bool share_memory = true;  // else voxels travel
  // What whoever watches may change, of owner 0 of field 0 alone: at most 64, no name twice; names are identifiers of at most 64
  // characters.
  std::vector<SteeredParameter> parameters = {};
  // Not null: boxes are made on demand, as in all other owners of the field, and at most `made_bytes` of them are kept, and the last one.
  MakeBox make = nullptr;
  std::uint64_t made_bytes = 0;
};

class VolumeOwner {
 public:
  // InvalidArgument: an option, named with its limit. Errors of ReadServiceFile, OwnerMemory::Create and MappedOwner::Open. `context` must
  // outlive the owner. Whether the coordinator takes it, Begin tells.
  static Result<std::unique_ptr<VolumeOwner>> Start(Context& context, VolumeOwnerOptions options);
  ~VolumeOwner();  // leaves

  struct Slot {
    // Where layout.boxes say; what they held may still be there. Never those of the last commit, from which the next time is computed.
    std::span<std::byte> bytes;
    Duration waited = {};
    std::uint64_t freed = 0;  // nobody reads the arrays of this time any more; 0: none
  };
  // Unavailable: the times of all slots are still used after `timeout`; or the coordinator refuses the key. What the coordinator said, if
  // it has refused the registration: at once, or after 10 s if other owners are in the way, who may leave.
  Result<Slot> Begin(Duration timeout);
  // `simulated`: the simulation's own time, in its own unit. `arrays`: samples that already lie elsewhere in this process are read there,
  // and the slot takes no memory for them. For each box, it has the address of the first sample of what is held, or null: the sample is in
  // the slot. Arrays must not change until the slot is begun again or this ends. InvalidArgument: nothing was begun, `time` is not above
  // that of the last call, or arrays are neither none nor as many as boxes. Boxes that are made on demand have neither slots nor arrays.
  Status Commit(std::uint64_t time, double simulated, std::span<const std::byte* const> arrays = {});

  // The present value of each of the options' parameters, in that order. Any thread.
  std::vector<double> parameters() const;
  bool looked_at() const;  // somebody has asked for a picture within the last seconds

 private:
  struct Impl;
  explicit VolumeOwner(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace slabstream
