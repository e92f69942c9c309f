#include "laboratory/bench/bench.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <memory>
#include <span>
#include <utility>

#include "client/cli/picture_sink.h"
#include "client/cli/service_connection.h"
#include "common/files/files.h"
#include "common/renderers/registry.h"
#include "laboratory/bench/bench_cases.h"
#include "laboratory/bench/bench_export.h"
#include "laboratory/bench/bench_report.h"

namespace slabstream {
namespace {

// Why a case cannot be measured here; empty: it can.
std::string WhyNot(const BenchCase& c, const BenchOptions& options) {
  const auto* path = std::get_if<std::string>(&c.volume);
  std::error_code error;
  if (path == nullptr || options.connection.local_workers == 0 || std::filesystem::exists(*path, error)) return "";
  return fmt::format("'{}' does not exist", *path);
}

// The named cases, all of which must exist; or all standard ones, some of which may be missing.
Result<std::vector<BenchCase>> ChooseCases(const BenchOptions& options) {
  std::vector<BenchCase> cases;
  for (const std::string& text : options.cases) {
    Result<BenchCase> parsed = ParseBenchCase(text, options.connection.local_workers == 0);
    if (!parsed.ok()) return parsed.status();
    if (const std::string why_not = WhyNot(*parsed, options); !why_not.empty()) {
      return Status::NotFound(fmt::format("CASE '{}': {}", text, why_not));
    }
    const auto same_name = [&](const BenchCase& other) { return other.name == parsed->name; };
    if (std::any_of(cases.begin(), cases.end(), same_name)) {
      return Status::InvalidArgument(fmt::format("CASE '{}': a case called {} is given before it", text, parsed->name));
    }
    cases.push_back(*std::move(parsed));
  }
  if (cases.empty()) cases = StandardBenchCases();
  for (BenchCase& c : cases) {
    if (options.renderer) {
      c.renderer = *options.renderer;
      c.parameters.clear();
    }
    for (const auto& [name, text] : options.parameters) c.parameters.insert_or_assign(name, text);
    if (const auto values = ParseParameters(*c.renderer, c.parameters); !values.ok()) {
      return Status(values.status().code(), fmt::format("CASE '{}': {}", c.name, values.status().message()));
    }
  }
  return cases;
}

Status MakeDirectory(const std::string& option, const std::string& path) {
  if (path.empty()) return Status::Ok();
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (error) return Status::InvalidArgument(fmt::format("{} '{}' cannot be made: {}", option, path, error.message()));
  return CheckCanWrite(option, path + "/probe");
}

Status PrepareOutputs(const BenchOptions& options) {
  if (!options.json_path.empty()) {
    if (Status status = CheckCanWrite("--json", options.json_path); !status.ok()) return status;
  }
  if (Status status = MakeDirectory("--pictures", options.pictures_directory); !status.ok()) return status;
  return MakeDirectory("--export", options.export_directory);
}

Result<ServiceConnection> Connect(const BenchCase& c, const ConnectionOptions& connection, std::span<const ShapeChoice> shapes) {
  if (connection.local_workers == 0) return ServiceConnection::Open(connection, c.dataset);
  if (const auto* path = std::get_if<std::string>(&c.volume)) return ServiceConnection::Open(connection, {path, 1}, {}, shapes);
  // A sphere is made beforehand, so that the first frame's time is the service's own. Only the service keeps it.
  Result<std::shared_ptr<const Volume>> sphere = LoadBenchVolume(c);
  if (!sphere.ok()) return sphere.status();
  return ServiceConnection::OpenLocal(connection, {[c, made = *std::move(sphere)]() mutable -> Result<std::shared_ptr<const Volume>> {
                                        if (made == nullptr) return LoadBenchVolume(c);
                                        return std::exchange(made, nullptr);
                                      }},
                                      shapes);
}

FrameJob MakeJob(const BenchCase& c, const BenchOptions& options, const std::string& dataset, Projection projection, int index) {
  FrameJob job{BenchRequest(c, BenchView(projection, index, options.frames), {options.size, options.size}), {}, {}};
  job.request.dataset = dataset;
  job.request.termination = options.termination;
  job.request.shapes = options.shapes;
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
  PictureFiles files(format, false, {});
  FrameLoopOptions loop;
  loop.pictures = &files;
  const Result<std::vector<FrameRecord>> frames = RenderFrames(client, jobs, loop);
  return frames.ok() ? Status::Ok() : frames.status();
}

// Measures a case: a service of its own (or the one at an endpoint), two frames to warm up, then turn after turn with one frame in flight.
// Pictures are decoded into memory while it measures and written only afterwards. Cancelled after Ctrl-C.
Result<BenchResult> RunBenchCase(const BenchCase& bench_case, const BenchOptions& options) {
  ResetPeakMemory();
  Result<ServiceConnection> connection = Connect(bench_case, options.connection, options.shapes);
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

Result<BenchResult> Measure(const BenchCase& c, const BenchOptions& options) {
  const std::string why_not = WhyNot(c, options);
  if (why_not.empty()) return RunBenchCase(c, options);
  BenchResult skipped;
  skipped.bench_case = c;
  skipped.skipped = why_not;
  return skipped;
}

Status Export(const std::vector<BenchCase>& cases, const BenchOptions& options) {
  for (const BenchCase& c : cases) {
    if (const std::string why_not = WhyNot(c, options); !why_not.empty()) {
      std::cout << fmt::format("{} skipped: {}\n", c.name, why_not);
      continue;
    }
    if (Status status = ExportCase(c, options); !status.ok()) return status;
    std::cout << fmt::format("wrote {}/{}.scene.json\n", options.export_directory, c.name);
  }
  return Status::Ok();
}

}  // namespace

Status RunBench(const BenchOptions& options) {
  if (options.list) {
    for (const BenchCase& c : StandardBenchCases()) std::cout << fmt::format("{:<25} {}\n", c.name, c.purpose);
    return Status::Ok();
  }
  const Result<std::vector<BenchCase>> cases = ChooseCases(options);
  if (!cases.ok()) return cases.status();
  if (Status status = PrepareOutputs(options); !status.ok()) return status;
  if (!options.export_directory.empty()) return Export(*cases, options);

  const BenchRun run{DescribeMachine(), options};
  std::size_t name_width = 4;
  for (const BenchCase& c : *cases) name_width = std::max(name_width, c.name.size());
  std::vector<BenchResult> results;
  for (const BenchCase& c : *cases) {
    Result<BenchResult> result = Measure(c, options);
    if (!result.ok()) return result.status();
    if (results.empty()) std::cout << BenchHeader(run, name_width);
    std::cout << BenchRow(*result, name_width) << std::flush;
    results.push_back(*std::move(result));
  }
  return options.json_path.empty() ? Status::Ok() : WriteTextFile(options.json_path, BenchJson(run, results));
}

}  // namespace slabstream
