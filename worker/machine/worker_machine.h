// WorkerMachine: all decisions of a worker, as a pure state machine: (event, now) -> actions. It reads no clock, owns no socket, touches no
// pixel and no voxel: images have handles, payloads are opaque Bytes. The service (worker/service/service.h) and the simulator of the tests
// run it.
//
// States:  unregistered --Welcome--> registered --silence, Retire--> unregistered
// Unregistering drops everything but cached padded boxes. Dropped work cannot be continued, so the worker registers again under the next
// incarnation number: to the coordinator it is a new worker. It says which slot it had, so that it gets the boxes again whose voxels it
// holds, also from another coordinator: the names of datasets outlive coordinators.
//
// Leaving (LeaveRequested): it says so in each heartbeat and goes on with what it has, until the coordinator stops it, or until `drain` is
// over, or until it is no longer registered.
//
// A group on this worker:
//   GroupAssignment   fetch the voxels of its boxes that no cached padded box holds (chunk requests within the byte credit); a box that is
//                     entirely hidden or outside the picture needs none: its rank holds an empty image at once
//   box complete      ranks are rendered: those of a client one after the other, groups in order of frame and group. The clients take
//                     turns, also in the midst of a rank (RenderQueue)
//   RenderDone        the rank holds its image; its steps of the schedule run in order of rounds: a send goes as soon as everything before
//                     it is in, a receive waits for its PartialImage; ranks of this same worker combine without a message
//   shapes            workers draw tiles of them for each other (common/planning/tile_plan.h): each draws its own as soon as it has the
//                     shapes, and its ranks wait for those of others, but not for long
//   root is complete  the group image goes to the display worker. It accumulates groups front to back (early ones wait), reports GroupDone
//                     (with the tiles hidden by then), sends a preview if wanted (FrameAccumulator), and after the last group the frame
// PartialImages that arrive before their assignment or before the Welcome are kept, within a byte limit and for some time; those of
// finished frames and older attempts are dropped. A second copy of any message changes nothing.
//
// The executor must: run StartRender, StartCombine, FindHidden, DrawTiles and StoreChunk on other threads and answer each with exactly one
// event; run StartCombine, FindHidden, SendPartial and SendFrame of a client in the order given, and not let those of another one wait for
// them; drop messages of the images plane that come with another key than their sender's (FindPeer); call Step(Tick) no later than
// NextWake(). If it calls late, the machine assumes that its own process was held up (stopped), and gives the coordinator as much more
// time: messages not read meanwhile do not mean that the coordinator was silent.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "common/base/rare.h"
#include "common/base/time.h"
#include "common/base/web_traffic.h"
#include "common/kernels/combine.h"
#include "common/memory/bytes.h"
#include "common/wire/any_message.h"
#include "worker/machine/link_rates.h"

namespace slabstream {

using ImageHandle = std::uint64_t;  // named by the machine, before the image exists; never reused; 0: none
class ImageNames {
 public:
  ImageHandle Next() { return ++last_; }

 private:
  ImageHandle last_ = 0;
};

// One box of voxels (halo included) of one dataset, as it is cached.
struct BoxKey {
  DatasetId dataset = 0;
  Box box;
  SampleTypes types;
  std::uint64_t generation = 0;  // named by the machine, never reused: a padded box that is dropped and opened again gets a new one
  friend bool operator==(const BoxKey&, const BoxKey&) = default;
  friend auto operator<=>(const BoxKey&, const BoxKey&) = default;
};

// The user's choice. kAuto: pack partial images if it pays. kOn: pack all partial images between processes, and pictures for clients. kOff:
// pack nothing.
enum class LinkCompression : std::uint8_t { kAuto, kOn, kOff };

struct WorkerConfig {
  Incarnation incarnation = 0;  // random, not 0: of the first registration; later registrations count up from it
  std::uint32_t pid = 0;
  std::string host;
  std::string images_endpoint;
  std::string images_key;          // Register::images_key
  std::uint64_t memory_scope = 0;  // Register::memory_scope
  bool lends_memory = false;       // Register::lends_memory
  LinkCompression compression = LinkCompression::kAuto;
  std::uint32_t threads = 1;                           // render threads, reported to the coordinator
  std::uint64_t memory_bytes = 0;                      // limit of the process (common/planning/worker_memory.h); 0: none. As in Register
  std::uint64_t cache_bytes = std::uint64_t{1} << 40;  // padded boxes not needed by a current group are dropped, oldest first, above this,
                                                       // and above what images leave of memory_bytes
  std::uint64_t credit_bytes = std::uint64_t{16} << 20;  // chunk bytes requested and not yet stored
  Duration register_interval = std::chrono::seconds(1);
  Duration chunk_timeout = std::chrono::seconds(3);            // then a chunk is asked for again
  int chunk_attempts = 10;                                     // then WorkerTrouble
  Duration preview_interval = std::chrono::milliseconds(100);  // from one preview of a frame to the next, at least
  Duration drain = std::chrono::seconds(30);                   // from LeaveRequested to the end; 0: at once
  std::uint64_t early_image_bytes = std::uint64_t{1} << 30;    // payloads of PartialImages kept before their assignment; then WorkerTrouble
  Duration early_image_patience = std::chrono::seconds(10);    // so long they are kept, at least
  Duration tile_patience = std::chrono::seconds(1);            // then a rank is rendered without the tiles of other workers
  // What this process reads from web servers, unless others tell of it; null: nothing.
  std::function<std::vector<WebTraffic>()> web_traffic = nullptr;
  // What the process may take for images, those that it has included (common/memory/large_buffers.h), beside all else that it holds. Null:
  // nobody measures it, and the formula alone counts.
  std::function<std::int64_t()> spare_for_images = nullptr;
};

// The pixels of a PartialImage: runs, or another process' memory.
struct IncomingImage {
  RunImageHeader header;
  Rare<SharedImage> shared;
  Rare<PackedRuns> packed;
  Bytes payload;
};

// ---- events
using MessageToWorker = Merged<CoordinatorToWorker, VoxelsToWorker, WorkerToWorker>;
struct MessageReceived {
  MessageToWorker message;
  Bytes payload;
};  // from any plane; payload lengths are already checked, runs are checked when they are combined
// Instead of it: of a shared image whose memory cannot be opened here.
struct ImageUnreadable {
  PartialImage image;
};
struct ChunkStored {
  BoxKey padded;
  Box box;                  // the chunk's box
  std::uint32_t chunk = 0;  // the chunk's number in that box
  Status status;
  std::uint64_t stored_bytes = 0;  // VolumeSource::TakeStoredBytes, of voxels that this worker has read itself
};
struct RenderDone {
  GroupKey key;
  Rank rank = 0;
  ImageHandle image = 0;
  Status status;
  RankReport report;
  std::uint64_t box_bytes = 0;
  std::vector<std::uint64_t> field_bytes = {};  // by StartRender::fields; those of none mean nothing
};
struct CombineDone {
  GroupKey key;
  ImageHandle image = 0;
  Status status;
  Span span;
};
struct HiddenFound {
  GroupKey key;
  ImageHandle image = 0;
  OcclusionMask hidden;
};
struct TilesDrawn {
  GroupKey key;
  Span span;
};
// A SendPartial or SendFrame failed.
struct SendFailed {
  GroupKey key;
  Status status;
};
// A SendPartial whose delivery is timed is about to be sent.
struct PartialSent {
  WorkerId to = 0;
  std::uint64_t acknowledge = 0;  // the number in the message
  std::size_t bytes = 0;          // bytes of the payload
};
// Images cannot be sent to this worker, or the connection broke, so that those that were sent may be lost.
struct PeerUnreachable {
  WorkerId worker = 0;
};
// This host has another address: images come to this endpoint now.
struct Moved {
  std::string images_endpoint;
};
struct LeaveRequested {};  // SIGTERM: take no new work, end when the old is done
struct StopRequested {};   // end now
struct Tick {};
using WorkerEvent = std::variant<MessageReceived, ImageUnreadable, ChunkStored, RenderDone, CombineDone, HiddenFound, TilesDrawn,
                                 SendFailed, PartialSent, PeerUnreachable, Moved, LeaveRequested, StopRequested, Tick>;

// ---- actions
struct SendControl {
  WorkerToCoordinator message;
};
// To the coordinator, unless this worker reads the voxels itself, straight to where the padded box stores them; then only ChunkStored
// comes. `request.in_place`: if voxels must be made first and this worker can read them then, it may ask for that; a chunk of
// 0 bytes tells.
struct SendChunkRequest {
  BoxKey padded;
  ChunkRequest request;
  std::shared_ptr<const StoredAt> stored = nullptr;  // where the voxels are; null: the coordinator holds them
};
struct ConnectVoxels {
  std::string endpoint;
};  // on Welcome
// Makes room for the padded box's voxels. Voxels that other padded boxes hold are copied before the first render; those padded boxes are
// complete, and open until that render is done. What is filled has its sample; chunks of boxes inside the padded box bring the rest.
struct OpenBox {
  struct Copy {
    BoxKey from;
    Box box;
  };
  BoxKey padded;
  std::vector<Copy> copies;
  bool stored = false;                 // the voxels are read in parts: nothing is known of them
  std::vector<FilledBox> filled = {};  // if it is read in parts: voxels that neither copies nor chunks bring
};
struct StoreChunk {
  BoxKey padded;
  Chunk chunk;
  Bytes payload;
};  // unpack, check the digest -> ChunkStored
struct DropBox {
  BoxKey padded;
};
// Renders a picture and stores it under the handle `image`, unless it fails.
struct StartRender {
  ClientId client = 0;
  GroupKey key;
  Rank rank = 0;
  BoxKey padded;
  Placement placement;
  std::shared_ptr<const FrameSetup> setup;
  std::shared_ptr<const OcclusionMask> hidden;  // tiles that need not be rendered; null: none is known
  ImageHandle image = 0;
  std::vector<BoxKey> lights = {};                 // LightVolumesOf the setup, whole
  std::vector<std::optional<BoxKey>> fields = {};  // by FrameSetup::fields; none: it does not reach there
  std::vector<BoxKey> shapes = {};                 // of FrameSetup::shapes, whole
};
// Draws tiles of the frame's shapes and sends each receiver its tiles, as ShapeTiles. What fails is not sent. -> TilesDrawn
struct DrawTiles {
  struct For {
    Peer to;
    std::vector<std::uint32_t> tiles;  // ascending
    bool colors = true;                // it displays them; else it only renders
  };
  ClientId client = 0;
  Epoch epoch = 0;
  WorkerId from = 0;
  GroupKey key;
  std::shared_ptr<const FrameSetup> setup;
  std::vector<For> receivers;
  std::vector<BoxKey> shapes = {}, lights = {};  // as those of StartRender
};
// Keeps what has come, for renders and pictures of the frame that begin later.
struct KeepTiles {
  std::shared_ptr<const FrameSetup> setup;
  ShapeTiles message;
  Bytes payload;
};
// These name a started render by its image. RenderDone has not come for it. PauseRender: it stops soon, between two of
// its pieces, and keeps what it has. ResumeRender: it goes on. CancelRender: it ends soon; RenderDone still comes.
struct PauseRender {
  ImageHandle image = 0;
};
struct ResumeRender {
  ImageHandle image = 0;
};
struct CancelRender {
  ImageHandle image = 0;
};
// Combines `other` (if 0: the incoming image; none is an empty one) into `image`. If `image` names no image yet, it becomes a copy of the
// other one. Only the pixels of `pixels` count in the other one: an image may hold pixels that have been passed on. `other` stays unchanged
// and needs its own release. -> CombineDone
struct StartCombine {
  ClientId client = 0;
  GroupKey key;
  ImageHandle image = 0;
  ImageHandle other = 0;
  Rare<IncomingImage> incoming;
  Side side = Side::kBack;
  bool replace = false;  // instead: `pixels` of `image`, which have been passed on, are replaced by those of the other one
  PixelRange pixels;     // pixels of the frame; empty: all
  PixelBounds frame;
  RankInterval ranks;  // ranks that `other` shows there; if `other` is 0: as the message says
};
// Finds the hidden tiles of `image`, a frame that has accumulated the groups up to `key`. `known`: the last hidden tiles. -> HiddenFound
struct FindHidden {
  ClientId client = 0;
  GroupKey key;
  ImageHandle image = 0;
  std::shared_ptr<const FrameSetup> setup;
  OcclusionMask known;
};
// How pixels reach another worker.
struct Delivery {
  bool lend = false;                              // the receiver can read this process' memory, so pixels may stay where they are
  bool timed = false;                             // -> PartialSent
  double bytes_per_second = LinkRates::kUnknown;  // the link's rate; pixels that are not lent are packed if that pays
};
// Sends message.pixels of `image`. Fills in how they travel, and adds bytes and times of messages to the reports of this worker's ranks. ->
// SendFailed, or nothing.
struct SendPartial {
  ClientId client = 0;
  std::shared_ptr<const Peer> to;
  PartialImage message;
  ImageHandle image = 0;
  PixelBounds frame;
  ColorCoding color = ColorCoding::kFloat32;  // if they travel as runs
  Rank rank = 0;                              // the rank that sends
  Delivery delivery;
};
// Sends an image that was lent for this message as runs, if it is still lent.
struct ResendImage {
  ImageRefused refused;
  bool first = false;  // the first refusal of this worker: for the log
};
// To another worker's images plane.
struct AnswerPeer {
  Peer to;
  std::variant<ImageReceived, ImageRefused> message;
};
// The images plane admits these keys and no others. Connections of those that have `ended` end.
struct AdmitKeys {
  std::set<std::string> keys, ended;
};
// Release what was lent and counted for groups that are over.
struct ForgetGroups {
  FrameId finished_before = 0;
  std::vector<FrameId> cancelled;
  GroupKey next;  // in its frame, earlier groups and older attempts are over

  bool Over(FrameId frame) const { return frame < finished_before || std::ranges::find(cancelled, frame) != cancelled.end(); }
  bool Over(const GroupKey& key) const {
    return Over(key.frame) || (key.frame == next.frame && (key.attempt < next.attempt || key.group < next.group));
  }
};
// Makes the picture of `pixels` of `image`, a frame or a share of it, encodes it, fills message.picture and a report, sends it to the
// coordinator; the payload straight to the client, if that is possible. -> SendFailed, or nothing.
struct SendFrame {
  ClientId client = 0;
  FrameImage message;
  ImageHandle image = 0;
  PixelRange pixels;       // others of the image may hold anything
  bool straight8 = false;  // FrameRequest::straight8
  std::optional<Rgb> straight8_over = {};
  std::shared_ptr<const FrameSetup> setup;
  std::optional<PicturesAddress> pictures = {};  // where its client takes it; none: through the coordinator
  std::vector<BoxKey> shapes = {}, lights = {};  // if the setup has shapes: as those of StartRender
};
// Runs after everything that was started before it. Every handle that is named in a StartRender, or as a new image in a StartCombine, is
// released exactly once, even if making the image failed.
struct ReleaseImage {
  ImageHandle image = 0;
};
struct StopProcess {
  std::uint32_t rendered_ranks = 0;  // since the process began: for the log
};
using WorkerAction = std::variant<SendControl, SendChunkRequest, ConnectVoxels, OpenBox, StoreChunk, DropBox, StartRender, DrawTiles,
                                  KeepTiles, PauseRender, ResumeRender, CancelRender, StartCombine, FindHidden, SendPartial, ResendImage,
                                  AnswerPeer, AdmitKeys, ForgetGroups, SendFrame, ReleaseImage, StopProcess>;
using WorkerActions = std::vector<WorkerAction>;

// Entries in the machine's tables. At rest, all but those of cached padded boxes are 0.
struct WorkerSizes {
  std::size_t frames = 0, cancelled = 0;
  std::size_t early_images = 0;  // groups and frames that images and tiles have come for too early
  std::size_t renders = 0;       // waiting, running or paused
  std::size_t chunk_requests = 0;
  std::size_t boxes = 0;
};

// What is told of the worker from outside the service (metrics).
struct WorkerCounts {
  WorkerSizes sizes;
  std::uint64_t cached_bytes = 0, fetched_bytes = 0;  // as a Heartbeat tells them
  bool registered = false, leaving = false;
};

class WorkerMachine {
 public:
  explicit WorkerMachine(WorkerConfig config);
  ~WorkerMachine();
  WorkerMachine(WorkerMachine&&) noexcept;

  // Whoever gives back the last step's actions saves the allocation of the next ones. Their contents do not matter.
  WorkerActions Step(WorkerEvent&& event, Time now, WorkerActions memory = {});
  Time NextWake() const;

  bool registered() const;
  WorkerId worker() const;                      // 0 while unregistered
  const Peer* FindPeer(WorkerId worker) const;  // another worker, as the coordinator has named it; null: it has not, or it has gone
  WorkerSizes sizes() const;
  WorkerCounts counts() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace slabstream
