#include <fmt/format.h>

#include <cmath>
#include <iostream>

#include "client/cli/commands.h"
#include "client/cli/report_files.h"
#include "client/cli/session.h"
#include "common/base/files.h"
#include "common/planning/validate_request.h"

namespace slabstream {
namespace {

std::vector<FrameJob> MakeJobs(const TurntableOptions& options, const std::string& dataset) {
  std::vector<FrameJob> jobs;
  for (int i = 0; i < options.frames; ++i) {
    FrameJob job{options.frame.request, options.output.Name(i)};
    job.request.dataset = dataset;
    // Back into one turn, so that a start near the limit of angles stays valid.
    job.request.view.azimuth_degrees = std::fmod(job.request.view.azimuth_degrees + 360.0 * options.turns * i / options.frames, 360.0);
    jobs.push_back(std::move(job));
  }
  return jobs;
}

}  // namespace

Status RunTurntable(const TurntableOptions& options) {
  const Time start = MonotonicNow();
  const std::string first = options.output.Name(0);
  if (Status status = CheckPicturePath(first); !status.ok()) return status;
  if (Status status = CheckCanWrite("--output", first); !status.ok()) return status;
  if (Status status = CheckReportPaths(options.frame); !status.ok()) return status;

  Result<Session> session = Session::Open(options.frame.connection, options.frame.source);
  if (!session.ok()) return session.status();
  const std::vector<FrameJob> jobs = MakeJobs(options, session->dataset());
  if (Status status = Validate(jobs.front().request); !status.ok()) return status;

  FrameLoopOptions loop;
  loop.in_flight = options.in_flight;
  loop.format = options.frame.format;
  loop.keep_reports = WantsReports(options.frame);
  loop.progress = options.frame.progress;
  const Result<std::vector<FrameRecord>> frames = RenderFrames(session->client(), jobs, loop);
  if (!frames.ok()) return frames.status();
  if (Status status = WriteReports(options.frame, *frames); !status.ok()) return status;

  const double elapsed_ms = std::chrono::duration<double, std::milli>(MonotonicNow() - start).count();
  const double first_ms = std::chrono::duration<double, std::milli>(frames->front().latency).count();
  std::cout << fmt::format("rendered {} frames, {} to {}, {}x{} in {:.0f} ms (first frame {:.0f} ms)\n", jobs.size(), first,
                           jobs.back().output, options.frame.request.size.width, options.frame.request.size.height, elapsed_ms, first_ms);
  return Status::Ok();
}

}  // namespace slabstream
