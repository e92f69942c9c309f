#include "tests/simulator/model_worker.h"

#include <algorithm>

#include "common/base/overloaded.h"
#include "common/volume/box_assembly.h"
#include "tests/simulator/model_occlusion.h"

namespace slabstream {
namespace {

constexpr double kLongestRender = 10, kLongestOther = 0.5;  // seconds
constexpr std::uint64_t kLargePixels = 4;

}  // namespace

WorkCost ModelWorker::Begin(Job& job) {
  const double seconds = std::visit([&](const auto& action) { return Begin(job, action); }, job.action);
  return {Slowed(seconds, std::holds_alternative<StartRender>(job.action) ? kLongestRender : kLongestOther)};
}

// Within limits: what was begun slowly ends slowly, also after the world has healed.
double ModelWorker::Slowed(double seconds, double longest) {
  return slowness_ == 1 ? seconds : std::max(seconds, std::min(seconds * slowness_, longest));
}

bool ModelWorker::LacksMemory(std::uint64_t pixels) {
  const bool lacks = !has_memory_ && pixels >= kLargePixels;
  if (lacks) tally_.Add(Count::kLargeFramesRefused);
  return lacks;
}

WorkerEvent ModelWorker::Answer(Job& job) {
  return std::visit(Overloaded{[&](const StartRender& action) -> WorkerEvent { return Rendered(action, job.cancelled); },
                               [&](const StoreChunk& action) -> WorkerEvent { return Stored(action); },
                               [&](const StartCombine& action) -> WorkerEvent {
                                 const bool fails =
                                     random_.Chance(faults_.fail_combine) || LacksMemory(std::uint64_t(action.frame.pixel_count()));
                                 const Status status = fails ? Status::ResourceExhausted("no memory to combine") : Status::Ok();
                                 return CombineDone{action.key, action.image, status, {Stage::kCombine, 0, 1}};
                               },
                               [&](const FindHidden& action) -> WorkerEvent {
                                 return HiddenFound{action.key, action.image, std::move(hidden_.extract(action.image).mapped())};
                               },
                               [](const auto&) -> WorkerEvent { return Tick{}; }},
                    job.action);
}

void ModelWorker::OnRequest(const ChunkRequest& request) {
  const std::uint32_t bytes = IsCellChunk(request.chunk) ? BytesOfCellChunk(cells_.BytesOf(request.dataset, request.box), request.chunk)
                                                         : PartOfChunk(request.box, TypeOf(request.dataset), request.chunk).bytes;
  requested_[{request.dataset, request.box, request.chunk}] = {bytes, service_.time()};
}

// The credit bounds what is requested and not stored. A request that has expired no longer counts: its answer is taken for lost.
void ModelWorker::CheckCredit() {
  if (!service_.worker(node_).registered()) requested_.clear();
  std::erase_if(requested_, [&](const auto& entry) { return entry.second.requested + config_.chunk_timeout <= service_.time(); });
  std::uint64_t bytes = 0;
  for (const auto& [name, outstanding] : requested_) bytes += outstanding.bytes;
  if (requested_.size() > 1) {
    EXPECT_LE(bytes, config_.credit_bytes) << "worker node " << node_;
  }
}

void ModelWorker::Perform(const OpenBox& action) {
  EXPECT_TRUE(boxes_.try_emplace(action.padded).second) << "a padded box is opened twice";
  for (const OpenBox::Copy& copy : action.copies) {
    EXPECT_TRUE(Complete(copy.from)) << "a padded box is copied from that is not open or not complete";
    EXPECT_TRUE(copy.from.box.Contains(copy.box) && copy.from.dataset == action.padded.dataset && copy.from.types == action.padded.types);
    boxes_[action.padded].copied.push_back(copy);
  }
}

double ModelWorker::Begin(Job&, const StoreChunk& action) {
  EXPECT_EQ(boxes_.count(action.padded), 1U) << "a chunk is stored in a padded box that is not open";
  EXPECT_TRUE(action.padded.box.Contains(action.chunk.box));
  if (IsCellChunk(action.chunk.chunk)) {
    EXPECT_TRUE(action.padded.types.cells) << "cells of a dataset that has none";
    EXPECT_EQ(action.chunk.box, action.padded.box) << "cells are those of the whole padded box";
  }
  return speed_.store;
}

ChunkStored ModelWorker::Stored(const StoreChunk& store) {
  requested_.erase({store.padded.dataset, store.chunk.box, store.chunk.chunk});
  Status status;
  if (random_.Chance(faults_.damage_chunk)) {
    status = Status::DataLoss("digest of a chunk");
  } else if (const auto open = boxes_.find(store.padded); open != boxes_.end()) {
    const bool of_cells = IsCellChunk(store.chunk.chunk);
    if (of_cells) tally_.Add(Count::kCellChunks);
    std::set<std::uint32_t>& stored = of_cells ? open->second.cell_chunks : open->second.chunks[store.chunk.box];
    stored.insert(store.chunk.chunk);
  }
  return {store.padded, store.chunk.box, store.chunk.chunk, status};
}

// All chunks of the boxes that it has any of, and these with the copied ones tile it; and all chunks of its cells.
bool ModelWorker::Complete(const BoxKey& key) const {
  const auto open = boxes_.find(key);
  if (open == boxes_.end()) return false;
  std::vector<Box> boxes;
  for (const auto& [box, chunks] : open->second.chunks) {
    if (chunks.size() != ChunkCount(box, key.types.samples)) return false;
    boxes.push_back(box);
  }
  for (const OpenBox::Copy& copy : open->second.copied) boxes.push_back(copy.box);
  if (key.types.cells && open->second.cell_chunks.size() != CellChunkCount(cells_.BytesOf(key.dataset, key.box))) return false;
  return Assemble(key.box, boxes).missing.empty();
}

void ModelWorker::Perform(const DropBox& action) {
  EXPECT_EQ(boxes_.erase(action.padded), 1U) << "a padded box is dropped that is not open";
  for (const auto& [key, padded] : boxes_) {
    for (const OpenBox::Copy& copy : padded.copied)
      EXPECT_TRUE(padded.rendered || copy.from != action.padded) << "a padded box is dropped that is copied from";
  }
  for (const auto& [image, rendering] : rendering_)
    EXPECT_NE(rendering.padded, action.padded) << "a padded box is dropped while it is rendered from";
}

double ModelWorker::Begin(Job&, const StartRender& action) {
  for (const auto& [image, rendering] : rendering_) {
    EXPECT_NE(rendering.client, action.client) << "two renders of a client at a time";
    tally_.Add(Count::kRendersBesideOthers);
  }
  EXPECT_TRUE(Complete(action.padded)) << "a padded box is rendered from before it is complete";
  for (const BoxKey& shape : action.shapes) EXPECT_TRUE(Complete(shape)) << "a shape is drawn before it is complete";
  EXPECT_TRUE(action.padded.box.Contains(PaddedBox(action.placement.at(), *action.setup))) << "a padded box without the voxels of its box";
  EXPECT_EQ(action.padded.dataset, DatasetOf(*action.setup, action.placement.level));
  if (slowness_ != 1) tally_.Add(Count::kSlowRenders);
  const bool large = std::uint64_t(FrameBounds(*action.setup).pixel_count()) >= kLargePixels;
  const double seconds = speed_.render * random_.Real(0.5, 2) * (large ? speed_.large : 1);
  rendering_[action.image] = {action.client, action.padded, seconds};
  return seconds;
}

RenderDone ModelWorker::Rendered(const StartRender& render, bool cancelled) {
  const double render_seconds = rendering_.extract(render.image).mapped().seconds;
  Status status;
  if (cancelled) {
    status = Status::Cancelled("render");
  } else if (random_.Chance(faults_.fail_render) || LacksMemory(std::uint64_t(FrameBounds(*render.setup).pixel_count()))) {
    status = Status::ResourceExhausted("no memory to render");
  }
  if (status.ok()) {
    boxes_.at(render.padded).rendered = true;
    const PixelBounds frame = FrameBounds(*render.setup);
    images_.Render(render.image, render.placement.id, std::uint64_t(frame.pixel_count()), [&](std::uint64_t i) {
      const auto width = std::uint64_t(frame.width());
      return render.hidden->Hides(std::int32_t(i % width), std::int32_t(i / width));
    });
  } else {
    images_.FailRender(render.image);
  }
  RankReport report;
  report.stage_ns[std::size_t(Stage::kRender)] = std::int64_t(render_seconds * 1e9);
  return {render.key, render.rank, render.image, std::move(status), report, std::uint64_t(render.padded.box.voxel_count()) * 2};
}

double ModelWorker::Begin(Job&, const StartCombine& action) {
  images_.Combine(action);
  return speed_.combine;
}

double ModelWorker::Begin(Job&, const FindHidden& action) {
  EXPECT_TRUE(UsesOcclusion(*action.setup)) << "nothing may be left out of this frame";
  OcclusionMask found = FindOpaqueTiles(images_.Get(action.image), FrameBounds(*action.setup));
  ForEachTile(action.known, [&](std::int32_t x, std::int32_t y, bool hidden) {
    EXPECT_TRUE(!hidden || found.Hides(x * kOcclusionTile, y * kOcclusionTile)) << "what was hidden is no longer";
  });
  EXPECT_TRUE(hidden_.emplace(action.image, std::move(found)).second) << "hidden tiles of an image are looked for twice at a time";
  return speed_.store;
}

double ModelWorker::Begin(Job& job, const SendPartial& action) {
  job.payload = images_.Encode(action.image, action.message.pixels);
  return speed_.combine;
}

double ModelWorker::Begin(Job& job, const SendFrame& action) {
  SymbolicImage picture = images_.Get(action.image);
  std::erase_if(picture, [&](const auto& pixel) { return pixel.first < action.pixels.begin || pixel.first >= action.pixels.end; });
  job.payload = PackSymbols(picture);
  return speed_.finish;
}

void ModelWorker::Perform(const StopProcess&) {
  stopped_ = true;
  // The process ends when its threads have ended; nothing but the running render may be left.
  EXPECT_EQ(images_.size(), 0U) << "worker node " << node_ << " keeps images when it stops";
}

}  // namespace slabstream
