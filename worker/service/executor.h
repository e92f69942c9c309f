// Executor: runs the slow actions of a WorkerMachine. For each client, one thread renders; another combines and encodes; a third makes
// finished pictures while the next frames are combined; a fourth draws shapes for other workers (ClientLanes). Another one unpacks chunks.
// Rendering uses all render threads of the worker; the machine lets one client's render go on at a time.
//
//   1. The thread that owns the machine calls Perform for each action of the kinds below, in order.
//   2. The result goes to the outbox: an event for the machine, or a message that is ready to be sent.
// Tables of padded boxes and images belong to the calling thread. Tasks share the entries that they need, so nothing is freed under a
// running task and no lock is held while pixels are touched. One task at a time touches the pixels of an image: the machine orders its next
// use only after the event that ends the last one. A combining thread's own tasks are an exception: they run in order. Nothing is combined
// into the image of a finished frame; the image of a preview still grows, so previews are made on the combining thread. Renders of several
// clients may use a padded box at a time (StoredBox).
#pragma once

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string_view>
#include <variant>
#include <vector>

#include "common/image/local_image.h"
#include "common/parallel/task_arena.h"
#include "common/threads/task_thread.h"
#include "common/transport/mailbox.h"
#include "worker/machine/worker_machine.h"
#include "worker/renderers/renderer.h"
#include "worker/service/client_lanes.h"
#include "worker/service/image_packing.h"
#include "worker/service/lent_images.h"
#include "worker/service/peer_memory.h"
#include "worker/service/sent_tallies.h"
#include "worker/service/shared_shapes.h"
#include "worker/service/stored_box.h"
#include "worker/service/thread_share.h"

namespace slabstream {

// An encoded message to another worker's images plane.
struct OutgoingPartial {
  Peer to;
  std::vector<std::byte> header;
  Bytes payload;
  bool timed = false;             // Delivery::timed
  std::uint64_t acknowledge = 0;  // PartialImage::acknowledge
  GroupKey key;                   // the message's group
};
struct OutgoingFrame {
  GroupKey key;  // the last group that it shows
  FrameImage message;
  Bytes payload;
  std::optional<PicturesAddress> pictures;  // SendFrame::pictures
};
using ExecutorOutput = std::variant<WorkerEvent, OutgoingPartial, OutgoingFrame>;

// Called with the name of each task when the task begins, on its thread. If it throws, the task fails. For tests; may be empty.
using TaskHook = std::function<void(std::string_view task)>;

class Executor {
 public:
  // `frame_codec` packs finished frames. `threads` render, at least 1. The outbox must outlive the executor.
  Executor(Mailbox<ExecutorOutput>& outbox, Codec frame_codec, int threads, RendererFactory make_renderer = MakeRenderer,
           TaskHook hook = {});
  ~Executor();  // cancels the renders, drops tasks that have not begun, joins

  void Perform(const OpenBox& action);
  void Perform(StoreChunk&& action);
  void Perform(const DropBox& action);
  void Perform(StartRender&& action);
  void Perform(DrawTiles&& action);
  void Perform(const KeepTiles& action);
  void Perform(const PauseRender& action);
  void Perform(const ResumeRender& action);
  void Perform(const CancelRender& action);
  void Perform(StartCombine&& action);
  void Perform(FindHidden&& action);
  void Perform(SendPartial&& action);
  void Perform(const ResendImage& action);
  void Perform(const ForgetGroups& action);
  void Perform(SendFrame&& action);
  void Perform(const ReleaseImage& action);

  // A task could not even report its failure. The outbox was notified; the worker can only leave.
  bool broken() const { return broken_; }
  PeerMemory& peer_memory() { return peer_memory_; }
  // A padded box that is open.
  std::shared_ptr<StoredBox> BoxOf(const BoxKey& key) const;
  // For reports that leave without a PartialImage: adds the bytes and times of their ranks' messages.
  void AddSent(const GroupKey& key, std::vector<RankReport>& reports) { sent_.MoveInto(key, reports); }

 private:
  // Runs `work`, which returns a Status, and catches its exceptions.
  template <class Work>
  Status Guard(const char* task, Work&& work);
  // The same for work that sends and returns nothing: a failure is posted as SendFailed. False: it failed.
  template <class Work>
  bool TrySend(const char* task, const GroupKey& key, Work&& work);
  void Break();
  // The entry of the table, which exists.
  std::shared_ptr<LocalImage> ImageOf(ImageHandle image) const;
  // What the shapes of a frame are drawn with, and what they are drawn into. A frame without shapes has none of it.
  struct ShapeBoxes {
    std::vector<std::shared_ptr<StoredBox>> shapes, lights;  // as of StartRender and SendFrame
    std::shared_ptr<SharedShapes> shared;
  };
  // `action`: a StartRender, DrawTiles or SendFrame.
  template <class Action>
  ShapeBoxes ShapeBoxesOf(FrameId frame, const Action& action);
  std::shared_ptr<SharedShapes> SharedShapesOf(FrameId frame, const FrameSetup& setup);
  Status MakePicture(LocalImage& frame, SendFrame& send, const ShapeBoxes& shape_boxes, TaskArena& arena);
  // The payload for pixels that stay where they are until they are read or sent from there. None: they have to be encoded.
  std::optional<Bytes> PayloadInPlace(const LocalImage& image, const ImageView& view, SendPartial& send);
  void Post(SendPartial& send, Bytes payload, std::int64_t begin_ns);  // the payload was made since begin_ns
  std::shared_ptr<RenderControl> ControlOf(ImageHandle image) const;   // null: the render has ended
  // The boxes that a render reads.
  struct RenderedBoxes {
    std::shared_ptr<StoredBox> padded;
    ShapeBoxes shapes;
    std::vector<std::shared_ptr<StoredBox>> fields;  // as StartRender::fields
  };
  RenderDone Render(const StartRender& action, const RenderedBoxes& boxes, const RenderControl& control, ClientLane& lane,
                    LocalImage& image);

  Mailbox<ExecutorOutput>& outbox_;
  const Codec frame_codec_;
  std::map<BoxKey, std::shared_ptr<StoredBox>> boxes_;
  std::map<ImageHandle, std::shared_ptr<LocalImage>> images_;
  LentImages lent_;
  SentTallies sent_;
  PeerMemory peer_memory_;
  std::map<FrameId, std::shared_ptr<SharedShapes>> shapes_;      // of frames that are not over
  std::map<ImageHandle, std::weak_ptr<RenderControl>> renders_;  // their tasks hold them
  const RendererFactory make_renderer_;
  const TaskHook hook_;
  std::atomic<bool> broken_ = false;
  const ThreadShare threads_;
  TaskThread chunk_thread_;
  ClientLanes combine_, finish_, draw_, render_;
};

}  // namespace slabstream
