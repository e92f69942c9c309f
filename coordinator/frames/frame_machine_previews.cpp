// Quick pictures from coarse levels: the first previews of requests whose voxels take long to read.
//
// Such a picture has a request of its own, which stands before the client's. It draws what voxels of kCoarsePixels pixels show, or a
// coarser level of at most kMostLevelBytes, without light, and its client gets it as a preview of which no group is done. It ends silently:
// once nobody wants it, and if it fails. The frame of the client's request begins after it, since workers may have memory for one of the
// two alone.

#include <algorithm>
#include <utility>

#include "coordinator/frames/frame_machine_state.h"

namespace slabstream {
namespace {

constexpr double kCoarsePixels = 8;
constexpr std::int64_t kMostLevelBytes = 16 << 20;

bool IsReadInParts(const OpenRequest::HasDataset& dataset) {
  const auto stored = [](const CoarserVolume& level) { return level.summary->stored.has_value(); };
  return dataset.resolved->summary->stored || std::ranges::any_of(dataset.resolved->coarser, stored);
}

}  // namespace

// `request` is about to be queued.
void FrameMachine::State::QueueCoarse(const OpenRequest& request) {
  OpenRequest coarse = request;
  coarse.coarse = true;
  coarse.pictures.reset();
  FrameRequest& frame = coarse.submit.frame;
  frame.previews = false;
  frame.level = kAutomatic;
  frame.detail = kCoarsePixels * (frame.detail == 0 ? 1 : frame.detail);
  frame.shading = {};
  coarse.use = ++last_use;
  actions.emplace_back(std::in_place_type<ToDatasets>,
                       SeekDataset{coarse.use, std::make_shared<const FrameRequest>(frame), kMostLevelBytes});
  queue.Push(std::move(coarse));
}

// Until the client's request shows something of its own, and only while its voxels are still being read, or are read in parts.
bool FrameMachine::State::IsWanted(const OpenRequest& coarse) {
  const RequestId id = coarse.submit.request;
  const RunningFrame* const running = frames.FindRequest(coarse.client, id);
  if (running != nullptr && running->groups_done() > 0) return false;
  const OpenRequest* const request = running != nullptr ? &running->request() : queue.Find(coarse.client, id);
  if (request == nullptr) return false;
  const OpenRequest::HasDataset* const fine = request->dataset();
  if (fine == nullptr) return true;
  if (!IsReadInParts(*fine)) return false;
  return coarse.dataset() == nullptr || coarse.dataset()->drawn.front() > fine->drawn.front();
}

bool FrameMachine::State::AwaitsCoarse(const OpenRequest& request) const {
  return request.submit.frame.previews && queue.FindCoarse(request.client, request.submit.request) != nullptr;
}

void FrameMachine::State::DropCoarse() {
  const auto unwanted = [this](const OpenRequest& request) { return request.coarse && !IsWanted(request); };
  for (const OpenRequest& request : queue.Extract(unwanted)) {
    actions.emplace_back(std::in_place_type<ToDatasets>, LeaveDataset{request.use});
  }
  for (auto it = frames.begin(); it != frames.end();) {
    const RunningFrame& frame = *it++;  // EndFrame removes it
    if (unwanted(frame.request())) EndFrame(frame.id(), "a preview that nobody wants any more");
  }
}

}  // namespace slabstream
