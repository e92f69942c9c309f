#include "client/movie/camera_moves.h"

#include <optional>
#include <utility>

#include "client/movie/turntable.h"

namespace slabstream {
namespace {

// The frames of a dataset that cannot be asked about fail later, one by one. Not so if nobody answers.
bool IsOfDataset(const Status& status) {
  return status.code() != StatusCode::kUnavailable && status.code() != StatusCode::kDeadlineExceeded &&
         status.code() != StatusCode::kCancelled;
}

// The view, complete.
Result<ViewParameters> WholeView(const ViewParameters& view, std::span<const FrameRequest> volumes, const AskView& ask) {
  std::optional<Ball> framed;
  const auto seen = [&view](FrameRequest volume) {
    volume.view = view;
    return volume;
  };
  for (const FrameRequest& volume : volumes) {
    const Result<ViewReply> reply = ask({.frame = seen(volume)});
    if (!reply.ok()) {
      if (&volume == &volumes.front() || !IsOfDataset(reply.status())) return reply.status();
      continue;
    }
    if (volumes.size() == 1) return reply->view;
    if (reply->framed) framed = framed ? BallAround(*framed, *reply->framed) : *reply->framed;
  }
  const Result<ViewReply> reply = ask({.frame = seen(volumes.front()), .framed = framed});
  if (!reply.ok()) return reply.status();
  return reply->view;
}

}  // namespace

Result<std::vector<ViewParameters>> ViewsOfMovie(const CameraMove& move, int frames, std::span<const FrameRequest> volumes,
                                                 const AskView& ask) {
  std::vector<ViewParameters> views;
  if (move.cameras.empty()) {
    const Result<ViewParameters> first = WholeView(volumes.front().view, volumes, ask);
    if (!first.ok()) return first.status();
    for (int i = 0; i < frames; ++i) {
      ViewParameters& view = views.emplace_back(*first);
      if (view.azimuth_degrees) view.azimuth_degrees = TurntableAzimuth(*view.azimuth_degrees, move.turns, i, frames);
    }
    return views;
  }
  std::vector<PathCamera> cameras = move.cameras;
  for (PathCamera& camera : cameras) {
    Result<ViewParameters> view = WholeView(camera.view, volumes, ask);
    if (!view.ok()) return view.status();
    camera.view = *std::move(view);
  }
  const Result<CameraPath> path = CameraPath::Make(cameras);
  if (!path.ok()) return path.status();
  const double begin = path->begin_seconds(), length = path->end_seconds() - begin;
  for (int i = 0; i < frames; ++i) views.push_back(path->At(frames == 1 ? begin : begin + length * (double(i) / (frames - 1))));
  return views;
}

}  // namespace slabstream
