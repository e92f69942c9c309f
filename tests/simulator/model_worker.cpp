#include "tests/simulator/model_worker.h"

#include <algorithm>

#include "common/volume/box_assembly.h"
#include "tests/simulator/model_occlusion.h"

namespace slabstream {

ModelWorker::ModelWorker(int node, WorkerConfig config, const WorkerSpeed& speed, const Faults& faults, Random& random,
                         EventQueue<Time>& queue, WorkerNetwork& network)
    : node_(node),
      config_(config),
      speed_(speed),
      faults_(faults),
      random_(random),
      queue_(queue),
      network_(network),
      machine_(std::move(config)),
      combine_thread_free_(queue.now()),
      finish_thread_free_(queue.now()) {}

void ModelWorker::Start() { Step(Tick{}); }

void ModelWorker::Step(const WorkerEvent& event) {
  if (!alive_) return;
  for (WorkerAction& action : machine_.Step(event, queue_.now())) {
    std::visit([this](const auto& a) { Perform(a); }, action);
  }
  CheckCredit();
  const Time wake = machine_.NextWake();
  if (wake != Time::max()) alarm_.Set(queue_, wake, [this] { Wake(); });
}

void ModelWorker::Wake() {
  if (!alive_) return;
  const Time wake = machine_.NextWake();
  if (wake > queue_.now()) return alarm_.Set(queue_, wake, [this] { Wake(); });
  Step(Tick{});
  idle_wakes_ = machine_.NextWake() <= queue_.now() ? idle_wakes_ + 1 : 0;
  ASSERT_LT(idle_wakes_, 10) << "worker node " << node_ << " spins";
}

Time ModelWorker::After(Time& free, Duration work) const {
  free = std::max(free, queue_.now()) + work;
  return free;
}

void ModelWorker::Perform(const SendControl& action) { network_.ToCoordinator(node_, action.message, {}); }

void ModelWorker::Perform(const SendChunkRequest& action) {
  const ChunkRequest& request = action.request;
  const std::uint64_t total = std::uint64_t(request.box.voxel_count());  // the simulated volumes have one byte a voxel
  const std::uint64_t bytes = std::min<std::uint64_t>(kChunkBytes, total - std::uint64_t(request.chunk) * kChunkBytes);
  requested_[{request.dataset, request.box, request.chunk}] = {bytes, queue_.now()};
  network_.ToSlabServer(node_, request);
}

// The credit bounds what is requested and not stored. A request that has expired no longer counts: its answer is taken for lost.
void ModelWorker::CheckCredit() {
  if (!machine_.registered()) requested_.clear();
  std::erase_if(requested_, [&](const auto& entry) { return entry.second.requested + config_.chunk_timeout <= queue_.now(); });
  std::uint64_t bytes = 0;
  for (const auto& [name, outstanding] : requested_) bytes += outstanding.bytes;
  if (requested_.size() > 1) {
    EXPECT_LE(bytes, config_.credit_bytes) << "worker node " << node_;
  }
}

void ModelWorker::Perform(const OpenSlab& action) {
  EXPECT_TRUE(slabs_.try_emplace(action.slab).second) << "a slab is opened twice";
  for (const OpenSlab::Copy& copy : action.copies) {
    EXPECT_TRUE(Complete(copy.from)) << "a slab is copied from that is not open or not complete";
    EXPECT_TRUE(copy.from.box.Contains(copy.box) && copy.from.dataset == action.slab.dataset && copy.from.type == action.slab.type);
    slabs_[action.slab].copied.push_back(copy);
  }
}

void ModelWorker::Perform(const StoreChunk& action) {
  EXPECT_EQ(slabs_.count(action.slab), 1U) << "a chunk is stored in a slab that is not open";
  EXPECT_TRUE(action.slab.box.Contains(action.chunk.box));
  queue_.At(CombineThread(speed_.store), [this, slab = action.slab, box = action.chunk.box, chunk = action.chunk.chunk] {
    requested_.erase({slab.dataset, box, chunk});
    Status status;
    if (random_.Chance(faults_.damage_chunk)) {
      status = Status::DataLoss("digest of a chunk");
    } else if (const auto open = slabs_.find(slab); open != slabs_.end()) {
      open->second.chunks[box].insert(chunk);
    }
    Step(ChunkStored{slab, box, chunk, status});
  });
}

// All chunks of the boxes that it has any of, and these with the copied ones tile it.
bool ModelWorker::Complete(const SlabKey& key) const {
  const auto open = slabs_.find(key);
  if (open == slabs_.end()) return false;
  std::vector<Box> boxes;
  for (const auto& [box, chunks] : open->second.chunks) {
    if (chunks.size() != ChunkCount(box, key.type)) return false;
    boxes.push_back(box);
  }
  for (const OpenSlab::Copy& copy : open->second.copied) boxes.push_back(copy.box);
  return Assemble(key.box, boxes).missing.empty();
}

void ModelWorker::Perform(const DropSlab& action) {
  EXPECT_EQ(slabs_.erase(action.slab), 1U) << "a slab is dropped that is not open";
  for (const auto& [key, slab] : slabs_) {
    for (const OpenSlab::Copy& copy : slab.copied)
      EXPECT_TRUE(slab.rendered || copy.from != action.slab) << "a slab is dropped that is copied from";
  }
  EXPECT_FALSE(rendering_ && rendering_->slab == action.slab) << "a slab is dropped while it is rendered from";
}

void ModelWorker::Perform(const StartRender& action) {
  EXPECT_FALSE(rendering_.has_value()) << "two renders at a time";
  EXPECT_TRUE(Complete(action.slab)) << "a slab is rendered from before it is complete";
  EXPECT_TRUE(action.slab.box.Contains(SlabBox(action.placement.box, *action.setup))) << "a slab without the voxels of its box";
  EXPECT_EQ(action.slab.dataset, action.setup->dataset);
  rendering_ = action;
  const std::uint64_t number = ++render_number_;
  const Status status = random_.Chance(faults_.fail_render) ? Status::ResourceExhausted("no memory to render") : Status::Ok();
  const Duration time(random_.Integer<std::int64_t>(speed_.render.count() / 2, speed_.render.count() * 2));
  queue_.After(time, [this, number, status, time] { FinishRender(number, status, time); });
}

void ModelWorker::Perform(const CancelRender& action) {
  if (!rendering_ || rendering_->key != action.key || random_.Chance(0.3)) return;  // sometimes too late
  queue_.After(speed_.store, [this, number = render_number_] { FinishRender(number, Status::Cancelled("render"), {}); });
}

void ModelWorker::FinishRender(std::uint64_t number, Status status, Duration time) {
  if (!alive_ || !rendering_ || number != render_number_) return;  // ended already
  const StartRender render = *std::exchange(rendering_, std::nullopt);
  if (status.ok()) {
    slabs_.at(render.slab).rendered = true;
    const PixelBounds frame = FrameBounds(*render.setup);
    images_.Render(render.image, render.placement.id, std::uint64_t(frame.pixel_count()), [&](std::uint64_t i) {
      const auto width = std::uint64_t(frame.width());
      return render.hidden->Hides(std::int32_t(i % width), std::int32_t(i / width));
    });
  } else {
    images_.FailRender(render.image);
  }
  RankReport report;
  report.stage_ns[std::size_t(Stage::kRender)] = time.count();
  Step(RenderDone{render.key, render.rank, render.image, std::move(status), report, std::uint64_t(render.slab.box.voxel_count()) * 2});
}

void ModelWorker::Perform(const StartCombine& action) {
  images_.Combine(action);
  const Status status = random_.Chance(faults_.fail_combine) ? Status::ResourceExhausted("no memory to combine") : Status::Ok();
  queue_.At(CombineThread(speed_.combine), [this, key = action.key, image = action.image, status] {
    Step(CombineDone{key, image, status, {Stage::kCombine, 0, 1}});
  });
}

void ModelWorker::Perform(const FindHidden& action) {
  EXPECT_TRUE(UsesOcclusion(*action.setup)) << "nothing may be left out of this frame";
  HiddenFound found{action.key, action.image, FindOpaqueTiles(images_.Get(action.image), FrameBounds(*action.setup))};
  ForEachTile(action.known, [&](std::int32_t x, std::int32_t y, bool hidden) {
    EXPECT_TRUE(!hidden || found.hidden.Hides(x * kOcclusionTile, y * kOcclusionTile)) << "what was hidden is no longer";
  });
  queue_.At(CombineThread(speed_.store), [this, found = std::move(found)] { Step(found); });
}

void ModelWorker::Perform(const SendPartial& action) {
  queue_.At(CombineThread(speed_.combine),
            [this, to = action.to, message = action.message, payload = images_.Encode(action.image, action.message.pixels)] {
              if (alive_) network_.ToPeer(node_, to, message, payload);
            });
}

void ModelWorker::Perform(const SendFrame& action) {
  const bool finished = action.message.groups_done == action.message.group_count;
  queue_.At(After(finished ? finish_thread_free_ : combine_thread_free_, speed_.finish),
            [this, message = action.message, payload = PackSymbols(images_.Get(action.image))] {
              if (alive_) network_.ToCoordinator(node_, message, payload);
            });
}

void ModelWorker::Perform(const StopProcess&) {
  stopped_ = true;
  // The process ends when its threads have ended; nothing but the running render may be left.
  EXPECT_EQ(images_.size(), 0U) << "worker node " << node_ << " keeps images when it stops";
}

}  // namespace slabstream
