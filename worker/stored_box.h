// StoredBox: a padded box as the executor stores it: its voxels and cells while they arrive, then what renders need. Any thread may call
// it.
#pragma once

#include <array>
#include <cstddef>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "common/wire/payload.h"
#include "common/wire/voxel_messages.h"
#include "worker/arriving_cells.h"
#include "worker/renderers/box_data.h"
#include "worker/worker_machine.h"

namespace slabstream {

class StoredBox {
 public:
  struct Copy {
    std::shared_ptr<StoredBox> from;
    Box box;
  };

  StoredBox(const BoxKey& key, std::vector<Copy> copies) : key_(key), copies_(std::move(copies)) {}

  // DataLoss: it does not fit this padded box.
  Status Store(const Chunk& chunk, const Bytes& payload);

  // When all chunks are stored. The first call copies the voxels that other padded boxes hold, and says so: true.
  bool Assemble();

  // What a render of this client renders from, and derives: no other render uses it meanwhile.
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
  // After Assemble.
  Lease Lend(ClientId client) { return {*this, DataFor(client)}; }

  // Memory, with what was derived; as of the end of each render.
  std::size_t bytes() const;

 private:
  // Those that were not lent for so many renders are dropped.
  static constexpr std::uint64_t kMostUnused = 16;
  struct Derived {
    explicit Derived(std::shared_ptr<BoxVoxels> voxels) : data(std::move(voxels)) {}
    BoxData data;
    ClientId client = 0;  // of the last render
    bool lent = false;
    std::uint64_t last_use = 0;  // when it was returned: leases until then
    std::size_t bytes = 0;
  };

  BrickedVoxels& Arriving(Layer layer);  // the first call makes room for them
  std::shared_ptr<BoxVoxels> Assembled();
  BoxData& DataFor(ClientId client);
  void Return(BoxData& data);

  const BoxKey key_;
  mutable std::mutex mutex_;  // guards what follows
  std::vector<Copy> copies_;
  std::array<std::optional<BrickedVoxels>, kLayers.size()> arriving_;  // by layer
  ArrivingCells cells_;
  std::vector<std::byte> unpacked_;    // a chunk's samples
  std::shared_ptr<BoxVoxels> voxels_;  // null: not all there
  std::list<Derived> derived_;
  std::uint64_t leases_ = 0;
};

}  // namespace slabstream
