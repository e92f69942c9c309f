// VoxelServer: the coordinator's end of the voxels plane. Its own thread owns the ROUTER and answers chunk requests out of the loaded
// volumes.
//
// Of a source that is read in parts, it reads a chunk when somebody asks for it, kReadAtOnce chunks of a dataset at a time. Cells of a box
// are cut out, or read, box by box of a dataset. Other requests do not wait for either, so a store that does not answer holds up its own
// dataset alone.
//
// It keeps no state about workers: each request is the credit for one answer of at most kChunkBytes. A request that cannot be met is
// refused with a reason. One that comes while kMaxQueuedChunks answers wait for its sender to read them is dropped. Chunks go out packed,
// except over inproc: they are raw there, and those of a whole volume refer to its own memory.
#pragma once

#include <cstddef>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include "common/base/check.h"
#include "common/base/limited_log.h"
#include "common/base/lru_map.h"
#include "common/base/status.h"
#include "common/memory/bytes.h"
#include "common/mesh/mesh_part.h"
#include "common/transport/mailbox.h"
#include "common/transport/socket.h"
#include "common/volume/box.h"
#include "common/volume/bricks.h"
#include "common/volume/sample_types.h"
#include "common/wire/any_message.h"
#include "coordinator/service/fair_tasks.h"
#include "data/sources/held_voxels.h"
#include "data/sources/volume_source.h"

namespace slabstream {

inline constexpr int kMaxQueuedChunks = 64;  // several times what a worker's credit allows

class VoxelServer {
 public:
  // The voxels of a dataset: a whole volume, or bricks if they take much less memory. One of the two, or neither. And its cells.
  struct Samples {
    std::shared_ptr<const Volume> volume = nullptr;
    std::shared_ptr<const BrickedVoxels> bricks = nullptr;
    std::shared_ptr<const GridCells> cells = nullptr;     // the cells of an unstructured grid
    std::shared_ptr<const ExactSamples> exact = nullptr;  // the whole numbers that `volume` rounds
    // Instead of all that: a level of a source, of which nothing is held.
    struct InParts {
      std::shared_ptr<VolumeSource> source = nullptr;
      int level = 0;
      std::stop_token stop = {};  // of who reads it
      const VolumeDescription& description() const { return source->info().levels[std::size_t(level)].description; }
    } in_parts = {};
    std::shared_ptr<VolumeSource> read_from = nullptr;  // where `volume` was read from, if chunks tell what was read of it
    // What is known of these voxels alone, where their dataset has the range and histogram of several times.
    std::shared_ptr<const VolumeSummary> own = nullptr;
    std::optional<VolumeDescription> description = {};  // describes what is held; none: nobody can ask for its light volume

    bool any() const { return volume != nullptr || bricks != nullptr || in_parts.source != nullptr; }
    // What follows needs any().
    Box box() const {
      CHECK(any());
      if (in_parts.source != nullptr) return in_parts.description().geometry.bounds();
      return volume != nullptr ? volume->block.box : bricks->grid().box;
    }
    std::uint64_t bytes() const {
      if (in_parts.source != nullptr) return 0;
      const std::uint64_t of_cells = cells == nullptr ? 0 : cells->bytes(), of_exact = exact == nullptr ? 0 : exact->bytes.size();
      return of_cells + of_exact + (volume != nullptr ? volume->block.bytes.size() : bricks->bytes());
    }
    SampleTypes types() const {
      if (in_parts.source != nullptr) return in_parts.description().type;
      return {volume != nullptr ? volume->block.type : bricks->type(), cells != nullptr};
    }
    // Not in_parts.
    VoxelBricks view() const { return volume != nullptr ? VoxelBricks(volume->block) : VoxelBricks(*bricks); }
  };

  struct Place {
    std::string endpoint;  // bound
    SocketOptions socket = {};
  };
  static Result<std::unique_ptr<VoxelServer>> Start(Context& context, const Place& place, Epoch epoch, Codec codec = Codec::kRaw);
  ~VoxelServer();  // stops and joins

  const std::string& endpoint() const { return endpoint_; }

  // From any thread. The same id means the same voxels. They are served until they are withdrawn. So is the light volume of samples that
  // are held (LightVolumeOf), which is made when it is first asked for.
  void Publish(DatasetId dataset, Samples samples);
  void Withdraw(DatasetId dataset);                               // from any thread; requests for it are refused from now on
  Samples Find(DatasetId dataset);                                // from any thread; neither: not published
  std::shared_ptr<const HeldVoxels> FindHeld(DatasetId dataset);  // from any thread, as FindHeldVoxels
  // From any thread: as Socket::EndConnections, soon.
  void EndConnections(const std::string& user);

 private:
  VoxelServer(Socket socket, std::string endpoint, Epoch epoch, Codec codec);
  void Run(const std::stop_token& stop);
  std::vector<std::string> TakeUnwanted();
  void Answer(const Incoming& incoming);
  std::shared_ptr<const LazyVolume> FindLight(DatasetId light);  // null: it is the light volume of no dataset
  // Reads the next voxels that must be read first; Reply follows when they are there.
  void ReadNext(DatasetId dataset);
  void Reply(const std::string& identity, const ChunkRequest& request, Result<std::pair<Chunk, Bytes>> answer);
  Bytes Cut(const Samples& samples, const Box& box, const ChunkPart& part);
  static Status Check(const ChunkRequest& request, const Samples& samples);  // why it cannot be met, or ok

  struct Asked {
    std::string identity;
    ChunkRequest request;
    Samples::InParts from = {};

    bool IsSame(const Asked& other) const { return identity == other.identity && request == other.request; }
  };
  struct ReadDone {
    std::shared_ptr<const Asked> asked;
    Result<std::pair<Chunk, Bytes>> answer;
  };
  struct Made {
    Asked asked;
    Status status;
  };
  // Of a source that is made on demand: has the voxels made, and then replies or reads them.
  void MakeFirst(Asked asked);
  void OnMade(Made made);
  // The cells of a box, which is not empty, as EncodeMesh makes them.
  struct CellsCut {
    std::shared_ptr<const GridCells> of;
    Box box;
    Result<Bytes> bytes;
  };
  // Replies if the cells of the box are at hand, or else once they are.
  void AnswerCells(Asked asked, std::shared_ptr<const GridCells> cells);
  void ReplyCells(const Asked& asked, const Bytes& cells);
  void OnCut(CellsCut cut);

  static constexpr std::size_t kReadAtOnce = 32;  // chunks of a dataset, which are in memory until they are sent
  struct Reads {                                  // the reads of a dataset
    std::vector<Asked> awaits_making;             // no two the same
    std::deque<Asked> waiting;                    // no two the same
    std::size_t begun = 0;                        // and not ended
  };

  // Bytes of cells, or half of what the process can still take; those that were cut last stay in any case.
  static constexpr std::size_t kMostKept = std::size_t{256} << 20;
  struct KeptCells {
    std::weak_ptr<const GridCells> of;  // a dataset that is gone takes no memory
    Bytes bytes;
  };

  const std::string endpoint_;
  const Epoch epoch_;
  const Codec codec_;
  std::mutex mutex_;
  std::map<DatasetId, Samples> samples_;                                  // guarded by mutex_
  std::map<DatasetId, std::shared_ptr<const LazyVolume>> light_volumes_;  // of samples that are held, by LightVolumeOf; guarded by mutex_
  std::vector<std::string> unwanted_;                                     // users whose connections are to end; guarded by mutex_
  LruMap<std::pair<const GridCells*, Box>, KeptCells> kept_cells_;        // a box is asked for chunk by chunk; the thread's
  std::map<std::pair<const GridCells*, Box>, std::vector<Asked>> awaits_cells_;  // that are being cut, no two the same; the thread's
  FairTasks cuts_{2};                                                            // by dataset, so that one box of each is cut at a time
  LimitedLog complaints_;                                                        // the thread's
  std::map<DatasetId, Reads> reads_;                                             // the thread's
  using Done = std::variant<ReadDone, Made, CellsCut>;
  const std::shared_ptr<Mailbox<Done>> read_ = std::make_shared<Mailbox<Done>>();  // reads and cuts may outlive this
  Socket socket_;                                                                  // the thread's
  std::jthread thread_;                                                            // last member
};

}  // namespace slabstream
