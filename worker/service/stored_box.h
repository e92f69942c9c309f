// StoredBox: a padded box as the executor stores it. At first it holds the voxels and cells that have arrived. When all are there, it holds
// what renders need. Any thread may call it.
#pragma once

#include <cstddef>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "common/volume/filled_box.h"
#include "common/wire/payload.h"
#include "common/wire/voxel_messages.h"
#include "data/sources/held_voxels.h"
#include "data/sources/volume_source.h"
#include "worker/machine/worker_machine.h"
#include "worker/renderers/box_data.h"
#include "worker/service/arriving_cells.h"

namespace slabstream {

class StoredBox {
 public:
  struct Copy {
    std::shared_ptr<StoredBox> from;
    Box box;
  };

  // `stored`: its voxels are read in parts, so that nothing is known of them (OpenBox). `filled`: of such a box: voxels that neither copies
  // nor chunks bring.
  StoredBox(const BoxKey& key, std::vector<Copy> copies, bool stored, std::vector<FilledBox> filled = {});

  // For a box of stored voxels: where those of `box`, which lies in this one, must be written; nullopt: all are there.
  // Whoever writes there keeps this object.
  std::optional<BoxRoom> RoomFor(const Box& box);

  // Takes the box's voxels from `held`, without a copy. Not for voxels that are read in parts.
  void Hold(std::shared_ptr<const HeldVoxels> held);

  // DataLoss: the chunk does not fit this padded box.
  Status Store(const Chunk& chunk, const Bytes& payload);

  // Call when all chunks are stored. The first call copies the voxels that other padded boxes hold, and fills others. True: this call
  // copied some.
  bool Assemble();

  // The BoxData that a render of one client reads from and derives into. No other render uses it during the lease.
  class Lease {
   public:
    Lease(StoredBox& box, BoxData& data) : box_(box), data_(data) {}
    ~Lease() { box_.Return(data_); }
    Lease(const Lease&) = delete;
    Lease& operator=(const Lease&) = delete;
    BoxData& data() const { return data_; }

   private:
    StoredBox& box_;
    BoxData& data_;
  };
  // Call after Assemble.
  Lease Lend(ClientId client) { return {*this, DataFor(client)}; }

  // All voxels as one block. Call after Assemble.
  std::shared_ptr<const VoxelBlock> Block() { return Assembled()->Block().block; }

  // Memory, with what renders derived. Derived data counts as it was at the end of its last render.
  std::size_t bytes() const;

 private:
  // Derived data that was not lent during so many leases is dropped.
  static constexpr std::uint64_t kMostUnused = 16;
  struct Derived {
    explicit Derived(std::shared_ptr<BoxVoxels> voxels) : data(std::move(voxels)) {}
    BoxData data;
    ClientId client = 0;  // the client of the last render
    bool lent = false;
    std::uint64_t last_use = 0;  // how many leases there had been when it was returned
    std::size_t bytes = 0;
  };

  BrickedVoxels& Arriving();       // the first call makes room for the voxels
  PaddedVoxels& ArrivingStored();  // the stored voxels; the first call makes room for them
  // Part of the samples of `box`, as BrickedVoxels::Write.
  void Write(const Box& box, std::uint64_t begin, std::span<const std::byte> samples);
  void CopyFrom(const BoxVoxels& from, const Box& box);
  std::shared_ptr<BoxVoxels> Assembled();
  BoxData& DataFor(ClientId client);
  void Return(BoxData& data);

  const BoxKey key_;
  const bool stored_;
  mutable std::mutex mutex_;  // guards what follows
  std::vector<Copy> copies_;
  std::vector<FilledBox> filled_;
  std::optional<BrickedVoxels> arriving_;        // unless stored_
  std::optional<PaddedVoxels> arriving_stored_;  // if stored_
  std::shared_ptr<const HeldVoxels> held_;       // instead of arriving_ and copies_; null: voxels must come
  ArrivingCells cells_;
  std::vector<std::byte> unpacked_;    // a chunk's samples
  std::shared_ptr<BoxVoxels> voxels_;  // null: not all there
  std::list<Derived> derived_;
  std::uint64_t leases_ = 0;
};

}  // namespace slabstream
