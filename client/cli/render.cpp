// `render` and `turntable`.
#include <fmt/format.h>

#include <cmath>
#include <iostream>

#include "client/cli/camera_json.h"
#include "client/cli/commands.h"
#include "client/cli/frame_loop.h"
#include "client/cli/session.h"
#include "client/cli/stats_json.h"
#include "client/cli/trace_json.h"
#include "common/base/files.h"
#include "common/planning/validate_request.h"

namespace slabstream {
namespace {

double Milliseconds(Duration duration) { return std::chrono::duration<double, std::milli>(duration).count(); }

// Before work begins: checks that the directories of all files exist.
Status CheckPaths(const FrameOptions& options, const std::string& output) {
  if (Status status = CheckPicturePath(output); !status.ok()) return status;
  if (Status status = CheckCanWrite("--output", output); !status.ok()) return status;
  if (Status status = CheckCanDraw(options.format.annotations); !status.ok()) return status;
  if (!options.stats_path.empty()) {
    if (Status status = CheckCanWrite("--stats", options.stats_path); !status.ok()) return status;
  }
  if (!options.camera_path.empty()) {
    if (Status status = CheckCanWrite("--save-camera", options.camera_path); !status.ok()) return status;
  }
  return options.trace_path.empty() ? Status::Ok() : CheckCanWrite("--trace", options.trace_path);
}

// The pictures of `jobs`, whose datasets are filled in here, and the files beside them (--stats, --trace).
Result<std::vector<FrameRecord>> RenderPictures(const FrameOptions& options, std::vector<FrameJob> jobs, int in_flight) {
  if (Status status = CheckPaths(options, jobs.front().output); !status.ok()) return status;
  Result<Session> session = Session::Open(options.connection, options.source, options.layers);
  if (!session.ok()) return session.status();
  for (FrameJob& job : jobs) job.request.dataset = session->dataset();
  if (Status status = Validate(jobs.front().request); !status.ok()) return status;

  FrameLoopOptions loop;
  loop.in_flight = in_flight;
  loop.format = options.format;
  if (options.record) loop.source = options.source;
  loop.layers = options.layers;
  loop.keep_reports = !options.stats_path.empty() || !options.trace_path.empty();
  loop.progress = options.progress;
  Result<std::vector<FrameRecord>> frames = RenderFrames(session->client(), jobs, loop);
  if (!frames.ok()) return frames;
  if (!options.camera_path.empty()) {
    const std::string text = ViewJson(options.request.view).dump(1) + "\n";
    if (Status status = WriteTextFile(options.camera_path, text); !status.ok()) return status;
  }
  if (!options.stats_path.empty()) {
    if (Status status = WriteTextFile(options.stats_path, StatsJson(options, *frames)); !status.ok()) return status;
  }
  if (!options.trace_path.empty()) {
    if (Status status = WriteTextFile(options.trace_path, TraceJson(options, *frames)); !status.ok()) return status;
  }
  return frames;
}

}  // namespace

Status RunRender(const RenderOptions& options) {
  const Time start = MonotonicNow();
  const auto frames = RenderPictures(options.frame, {{options.frame.request, options.output}}, 1);
  if (!frames.ok()) return frames.status();
  const ImageSize size = options.frame.request.size;
  std::cout << fmt::format("rendered {} {}x{} in {:.0f} ms (frame {:.0f} ms)\n", options.output, size.width, size.height,
                           Milliseconds(MonotonicNow() - start), Milliseconds(frames->front().latency));
  return Status::Ok();
}

Status RunTurntable(const TurntableOptions& options) {
  if (options.frame.request.view.eye) {
    return Status::InvalidArgument("--eye stands still; a turntable turns by --azimuth, about --look-at");
  }
  const Time start = MonotonicNow();
  std::vector<FrameJob> jobs;
  for (int i = 0; i < options.frames; ++i) {
    FrameJob& job = jobs.emplace_back(FrameJob{options.frame.request, options.output.Name(i)});
    // Back into one turn, so that a start near the limit of angles stays valid.
    job.request.view.azimuth_degrees = std::fmod(job.request.view.azimuth_degrees + 360.0 * options.turns * i / options.frames, 360.0);
  }
  const auto frames = RenderPictures(options.frame, std::move(jobs), options.in_flight);
  if (!frames.ok()) return frames.status();
  const ImageSize size = options.frame.request.size;
  std::cout << fmt::format("rendered {} frames, {} to {}, {}x{} in {:.0f} ms (first frame {:.0f} ms)\n", frames->size(),
                           frames->front().output, frames->back().output, size.width, size.height, Milliseconds(MonotonicNow() - start),
                           Milliseconds(frames->front().latency));
  return Status::Ok();
}

}  // namespace slabstream
