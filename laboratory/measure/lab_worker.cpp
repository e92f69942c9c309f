#include "laboratory/measure/lab_worker.h"

#include <set>
#include <utility>

#include "common/base/time.h"
#include "common/parallel/task_arena.h"
#include "laboratory/measure/thread_time.h"

namespace slabstream {

LabWorker::LabWorker(const Volume& volume) : volume_(volume) {
  if (volume.cells != nullptr) cells_ = std::make_unique<MeshCutter>(volume.cells);
}
LabWorker::~LabWorker() = default;

BoxRendering LabWorker::Render(const Box& box, const FrameSetup& setup) {
  if (kind_ != setup.renderer) renderer_ = MakeRenderer(*setup.renderer);
  kind_ = setup.renderer;
  const Box padded_box = PaddedBox(box, setup);
  std::unique_ptr<BoxData>& padded = boxes_[padded_box];
  if (padded == nullptr) {
    std::shared_ptr<const Mesh> cells;
    if (cells_ != nullptr) cells = std::make_shared<const Mesh>(cells_->Cut(padded_box));
    padded = std::make_unique<BoxData>(BrickedVoxels(CutBlock(volume_.block, padded_box)), std::move(cells));
  }
  RenderControl control;
  BoxRendering rendering;
  const OcclusionMask hidden = MaskBefore(box, setup);
  TaskArena one_thread(1);
  one_thread.Run([&] {
    const Time begin = MonotonicNow();
    rendering.processor_seconds =
        SecondsOf([&] { rendering.image = renderer_->Render(*padded, box, setup, hidden, control, rendering.report).value(); });
    rendering.seconds = double((MonotonicNow() - begin).count()) * 1e-9;
  });
  return rendering;
}

void LabWorker::KeepOnly(std::span<const Box> boxes, const FrameSetup& setup) {
  std::set<Box> padded;
  for (const Box& box : boxes) padded.insert(PaddedBox(box, setup));
  std::erase_if(boxes_, [&](const auto& held) { return !padded.contains(held.first); });
}

}  // namespace slabstream
