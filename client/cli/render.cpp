#include <fmt/format.h>

#include <iostream>

#include "client/cli/commands.h"
#include "client/cli/report_files.h"
#include "client/cli/session.h"
#include "common/base/files.h"
#include "common/planning/validate_request.h"

namespace slabstream {

Status RunRender(const RenderOptions& options) {
  const Time start = MonotonicNow();
  if (Status status = CheckPicturePath(options.output); !status.ok()) return status;
  if (Status status = CheckCanWrite("--output", options.output); !status.ok()) return status;
  if (Status status = CheckReportPaths(options.frame); !status.ok()) return status;

  Result<Session> session = Session::Open(options.frame.connection, options.frame.source);
  if (!session.ok()) return session.status();
  FrameJob job{options.frame.request, options.output};
  job.request.dataset = session->dataset();
  if (Status status = Validate(job.request); !status.ok()) return status;

  FrameLoopOptions loop;
  loop.format = options.frame.format;
  loop.keep_reports = WantsReports(options.frame);
  loop.progress = options.frame.progress;
  const Result<std::vector<FrameRecord>> frames = RenderFrames(session->client(), {job}, loop);
  if (!frames.ok()) return frames.status();
  if (Status status = WriteReports(options.frame, *frames); !status.ok()) return status;

  const auto elapsed = std::chrono::duration<double, std::milli>(MonotonicNow() - start).count();
  const auto latency = std::chrono::duration<double, std::milli>(frames->front().latency).count();
  std::cout << fmt::format("rendered {} {}x{} in {:.0f} ms (frame {:.0f} ms)\n", options.output, job.request.size.width,
                           job.request.size.height, elapsed, latency);
  return Status::Ok();
}

}  // namespace slabstream
