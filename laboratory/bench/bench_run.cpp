#include "laboratory/bench/bench_run.h"

#include <fmt/format.h>
#include <unistd.h>

#include <memory>
#include <span>
#include <utility>

#include "client/cli/picture_files.h"
#include "client/cli/service_connection.h"

namespace slabstream {
namespace {

Result<ServiceConnection> Connect(const BenchCase& c, const ConnectionOptions& connection) {
  if (connection.local_workers == 0) return ServiceConnection::Open(connection, c.dataset);
  if (const auto* path = std::get_if<std::string>(&c.volume)) return ServiceConnection::Open(connection, *path);
  // A sphere is made beforehand, so that the first frame's time is the service's own. Only the service keeps it.
  Result<std::shared_ptr<const Volume>> sphere = LoadBenchVolume(c);
  if (!sphere.ok()) return sphere.status();
  return ServiceConnection::OpenLocal(connection, {[c, made = *std::move(sphere)]() mutable -> Result<std::shared_ptr<const Volume>> {
                                        if (made == nullptr) return LoadBenchVolume(c);
                                        return std::exchange(made, nullptr);
                                      }});
}

FrameJob MakeJob(const BenchCase& c, const BenchOptions& options, const std::string& dataset, Projection projection, int index) {
  FrameJob job{BenchRequest(c, BenchView(projection, index, options.frames), {options.size, options.size}), {}, {}};
  job.request.dataset = dataset;
  return job;
}

// One frame of each projection to warm up, then their turntables turn after turn.
std::vector<FrameJob> MeasuredJobs(const BenchCase& c, const BenchOptions& options, const std::string& dataset) {
  std::vector<FrameJob> jobs;
  for (const Projection projection : c.renderer->projections()) jobs.push_back(MakeJob(c, options, dataset, projection, 0));
  for (int turn = 0; turn < options.turns; ++turn) {
    for (const Projection projection : c.renderer->projections()) {
      for (int i = 0; i < options.frames; ++i) jobs.push_back(MakeJob(c, options, dataset, projection, i));
    }
  }
  return jobs;
}

Status WritePictures(Client& client, const BenchCase& c, const BenchOptions& options, const std::string& dataset) {
  std::vector<FrameJob> jobs;
  for (const Projection projection : c.renderer->projections()) {
    jobs.push_back(MakeJob(c, options, dataset, projection, 0));
    jobs.back().output = fmt::format("{}/{}.{}.png", options.pictures_directory, c.name, NameOf(projection));
  }
  PictureFormat format;
  format.background = {0, 0, 0, 1};
  PictureFiles files(format, {}, false, {});
  FrameLoopOptions loop;
  loop.pictures = &files;
  const Result<std::vector<FrameRecord>> frames = RenderFrames(client, jobs, loop);
  return frames.ok() ? Status::Ok() : frames.status();
}

}  // namespace

Result<BenchResult> RunBenchCase(const BenchCase& bench_case, const BenchOptions& options) {
  ResetPeakMemory();
  Result<ServiceConnection> connection = Connect(bench_case, options.connection);
  if (!connection.ok()) return connection.status();
  const std::vector<FrameJob> jobs = MeasuredJobs(bench_case, options, connection->dataset());

  FrameLoopOptions loop;
  loop.keep_reports = true;
  loop.progress = ::isatty(STDERR_FILENO) == 1;  // else the rows of the table show the progress
  loop.label = bench_case.name;
  const Result<std::vector<FrameRecord>> records = RenderFrames(connection->client(), jobs, loop);
  if (!records.ok()) return records.status();

  BenchResult result;
  result.bench_case = bench_case;
  result.peak_rss_bytes = PeakMemoryBytes();
  result.first_frame_ms = double(records->front().latency.count()) / 1e6;
  const std::size_t warm_up = bench_case.renderer->projections().size();
  SetFrames(result, std::span(jobs).subspan(warm_up), std::span(*records).subspan(warm_up));
  const Result<StatusReply> status = connection->client().QueryStatus();
  if (!status.ok()) return status.status();
  for (const DatasetStatus& dataset : status->datasets) {
    if (dataset.name == connection->dataset()) result.description = dataset.description;
  }
  if (!options.pictures_directory.empty()) {
    if (Status written = WritePictures(connection->client(), bench_case, options, connection->dataset()); !written.ok()) return written;
  }
  return result;
}

}  // namespace slabstream
