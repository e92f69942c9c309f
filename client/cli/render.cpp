// `render` and `turntable`.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "client/cli/about_pictures.h"
#include "client/cli/commands.h"
#include "client/cli/frame_loop.h"
#include "client/cli/input_volume.h"
#include "client/cli/picture_orders.h"
#include "client/cli/picture_sink.h"
#include "client/cli/report_json.h"
#include "client/cli/service_connection.h"
#include "client/cli/trace_spans.h"
#include "client/movie/camera_moves.h"
#include "client/movie/turntable.h"
#include "client/report/frame_summary.h"
#include "client/request/camera_file.h"
#include "common/cli/program.h"
#include "common/files/files.h"
#include "common/otlp/trace_sender.h"
#include "common/wire/validate_request.h"
#include "data/volume_io/read_options.h"

namespace slabstream {
namespace {

// Before work begins: checks that the directories of all files exist.
Status CheckPaths(const FrameOptions& options, const std::string& output) {
  Status status = CheckCanWrite("--output", output);
  if (status.ok()) status = CheckCanDraw(options.format.annotations);
  const std::pair<const char*, const std::string&> others[] = {
      {"--stats", options.stats_path}, {"--save-camera", options.camera_path}, {"--trace", options.trace_path}};
  for (const auto& [option, path] : others) {
    if (status.ok() && !path.empty()) status = CheckCanWrite(option, path);
  }
  return status;
}

// The catalogue may have a dataset for each time of a file.
Status UseDatasetsOfTimes(Client& client, std::vector<FrameJob>& jobs) {
  const Result<StatusReply> service = client.QueryStatus();
  if (!service.ok()) return service.status();
  const auto has = [&](const std::string& name) {
    return std::ranges::find(service->datasets, name, &DatasetStatus::name) != service->datasets.end();
  };
  const auto name_of = [](const FrameJob& job) { return fmt::format("{}@{}", job.request.dataset, job.request.time); };
  if (has(jobs.front().request.dataset) || !has(name_of(jobs.front()))) return Status::Ok();
  for (FrameJob& job : jobs) {
    job.source = job.request.dataset = name_of(job);
    job.request.time.clear();
  }
  return Status::Ok();
}

// Connects to the service for the volumes of all jobs, and fills in their datasets.
Result<ServiceConnection> Connect(const FrameOptions& options, std::vector<FrameJob>& jobs) {
  std::vector<std::string> sources;
  std::map<std::string, std::size_t> numbers;
  for (const FrameJob& job : jobs) {
    if (numbers.emplace(job.source, sources.size()).second) sources.push_back(job.source);
  }
  Result<ServiceConnection> connection = ServiceConnection::Open(options.connection, sources, options.layers, jobs.front().request.shapes);
  if (!connection.ok()) return connection;
  for (FrameJob& job : jobs) job.request.dataset = connection->dataset(numbers[job.source]);
  if (options.connection.local_workers > 0 || jobs.front().request.time.empty()) return connection;
  if (Status status = UseDatasetsOfTimes(connection->client(), jobs); !status.ok()) return status;
  return connection;
}

bool IsSameVolume(const FrameRequest& a, const FrameRequest& b) { return a.dataset == b.dataset && a.time == b.time; }

// A preset and shares of values depend on the volume. All times of a dataset look alike. Of datasets that are a time each, they are those
// of the first one, so that a colour means the same value in all frames.
Status SettleTransfer(Client& client, std::vector<FrameJob>& jobs) {
  const FrameRequest first = jobs.front().request;
  if (first.dataset == jobs.back().request.dataset) return Status::Ok();
  Result<SummaryReply> summary = client.Summarize(SummaryOf(first));
  if (!summary.ok()) return summary.status();
  for (FrameJob& job : jobs) {
    job.request.transfer.choice = summary->transfer;
    job.request.transfer.scalar_range.reset();
  }
  return Status::Ok();
}

// The views of the jobs, whose datasets are known.
Status PlaceCameras(Client& client, const CameraMove& move, std::vector<FrameJob>& jobs) {
  std::vector<FrameRequest> volumes;
  for (const FrameJob& job : jobs) {
    if (volumes.empty() || !IsSameVolume(volumes.back(), job.request)) volumes.push_back(job.request);  // times rise
  }
  const AskView ask = [&client](ViewQuery query) { return client.ChooseView(std::move(query)); };
  Result<std::vector<ViewParameters>> views = ViewsOfMovie(move, int(jobs.size()), volumes, ask);
  if (!views.ok()) return views.status();
  for (std::size_t i = 0; i < jobs.size(); ++i) jobs[i].request.view = (*views)[i];
  return Status::Ok();
}

// The pictures of `jobs`, and the files beside them (--stats, --trace, --save-camera). `move`: of a sequence; null: the views are those of
// the jobs. `open_pictures` is called just before the first frame: until then Ctrl-C ends the process at once, so there must be nothing to
// clean up. `failures`, `label`: as in FrameLoopOptions.
using OpenSink = std::function<Result<std::unique_ptr<PictureSink>>()>;
Result<std::vector<FrameRecord>> RenderPictures(const FrameOptions& options, std::vector<FrameJob> jobs, const CameraMove* move,
                                                const OpenSink& open_pictures, int in_flight, std::vector<Status>* failures,
                                                const std::string& label = "") {
  Result<ServiceConnection> connection = Connect(options, jobs);
  if (!connection.ok()) return connection.status();
  if (Status status = Validate(jobs.front().request); !status.ok()) return status;
  if (Status status = SettleTransfer(connection->client(), jobs); !status.ok()) return status;
  if (move != nullptr) {
    if (Status status = PlaceCameras(connection->client(), *move, jobs); !status.ok()) return status;
  }
  for (FrameJob& job : jobs) job.request.key = options.format.annotations.needs_key();
  const Result<std::unique_ptr<PictureSink>> pictures = open_pictures();
  if (!pictures.ok()) return pictures.status();

  FrameLoopOptions loop;
  loop.in_flight = in_flight;
  loop.pictures = pictures->get();
  loop.keep_reports = !options.stats_path.empty() || !options.trace_path.empty() || options.collector;
  loop.failures = failures;
  loop.progress = options.progress;
  loop.label = label;
  Result<std::vector<FrameRecord>> frames = RenderFrames(connection->client(), jobs, loop);
  if (!frames.ok()) return frames;
  WarnOf(connection->client(), jobs.front().request, frames->front().empty);
  if (!options.camera_path.empty()) {
    const ViewParameters view = frames->front().statistics.view.value_or(jobs.front().request.view);
    if (Status status = WriteTextFile(options.camera_path, CameraText(view)); !status.ok()) return status;
  }
  if (!options.stats_path.empty()) {
    if (Status status = WriteTextFile(options.stats_path, StatsJson(options, *frames)); !status.ok()) return status;
  }
  if (!options.trace_path.empty()) {
    if (Status status = WriteTextFile(options.trace_path, TraceJson(*frames)); !status.ok()) return status;
  }
  return frames;
}

// --otlp, when the pictures are there: a collector that does not take the spans takes nothing from the command.
void Send(const FrameOptions& options, const std::string& command, Time begin, const std::vector<FrameRecord>& frames,
          const std::vector<Status>& failures) {
  if (!options.collector) return;
  const std::vector<TraceSpan> spans = CommandSpans(
      {.command = command, .source = options.source, .begin = begin, .end = MonotonicNow(), .parent = ParentOfProcess()}, frames, failures);
  const Status status = SendSpans(*options.collector, ThisProcess("slabstream"), spans);
  if (!status.ok()) PrintWarning("--otlp: " + status.message());
}

// `output`: one of the files.
Result<std::unique_ptr<PictureSink>> FilesOf(const FrameOptions& options, const std::string& output) {
  if (Status status = CheckCanWritePicture(output); !status.ok()) return status;
  return std::unique_ptr<PictureSink>(std::make_unique<PictureFiles>(options.format, options.record, options.layers));
}

MovieOptions MovieOf(const TurntableOptions& options) {
  MovieOptions movie{.path = options.output.movie, .shape = {.size = options.frame.request.size}, .format = options.frame.format};
  if (options.frames_per_second) movie.shape.frames_per_second = *options.frames_per_second;
  return movie;
}

// Where frame `index` goes.
std::string FileOf(const TurntableOptions& options, int index) {
  return options.output.movie.empty() ? options.output.pictures.Name(index) : options.output.movie;
}

// Where the frames of a turntable go.
Result<std::unique_ptr<PictureSink>> OpenPictures(const TurntableOptions& options) {
  if (options.output.movie.empty()) return FilesOf(options.frame, FileOf(options, 0));
  Result<std::unique_ptr<Movie>> movie = Movie::Start(MovieOf(options));
  if (!movie.ok()) return movie.status();
  return std::unique_ptr<PictureSink>(*std::move(movie));
}

// The times that SOURCE?time=FIRST:LAST names are those of --time.
Result<TurntableOptions> WithTimesOfSource(TurntableOptions options) {
  if (options.frame.connection.local_workers == 0) return options;
  const Result<SourceText> source = ParseSourceText(options.frame.source);
  if (!source.ok()) return source.status();
  const std::optional<TimeRange> named = source->options.time;
  if (named && options.times) return Status::InvalidArgument(fmt::format("'{}': time is given twice", options.frame.source));
  if (named && named->count() > 1) {
    options.times = TimeSteps{named->first, named->last};
    options.frame.source = AtTime(options.frame.source, {});
  }
  return options;
}

// What is wrong with the options as a whole, before work begins.
Status CheckTurntable(const TurntableOptions& options) {
  if (options.frame.request.view.eye && options.turns > 0) {
    return Status::InvalidArgument(
        "--eye fixes the viewpoint, but a turntable turns by --azimuth, about --look-at; --turns 0 fixes the view");
  }
  if (!options.frames && !options.times && !(options.path && options.path->timed)) {
    return Status::InvalidArgument(options.path ? "--frames is required: the cameras of --path have no times" : "--frames is required");
  }
  const std::string first_output = FileOf(options, 0);
  if (!options.output.movie.empty()) {
    if (Status status = CheckCanEncode(MovieOf(options)); !status.ok()) return status;
  } else if (options.frames_per_second) {
    return Status::InvalidArgument(fmt::format("--fps {:g} is for movies ({}), but --output '{}' names pictures",
                                               *options.frames_per_second, MovieEndings(), first_output));
  } else if (Status status = CheckPictureFile(first_output, options.frame.request.size); !status.ok()) {
    return status;
  }
  return CheckPaths(options.frame, first_output);
}

// CheckTurntable has found that one of these is there.
std::int64_t FrameCount(const TurntableOptions& options) {
  if (options.frames) return *options.frames;
  if (options.times) return options.times->count();
  // A path's first and last camera are frames.
  const double per_second = options.frames_per_second.value_or(MovieShape().frames_per_second);
  return std::llround(options.path->seconds() * per_second) + 1;
}

// Frame i shows the time that belongs to the i-th part of the whole.
Result<std::vector<FrameJob>> TurntableJobs(const TurntableOptions& options) {
  const TimeSteps times = options.times.value_or(TimeSteps{});
  if (FrameCount(options) > kMaxTurntableFrames) {
    const std::string what =
        options.times ? fmt::format("--time {}:{} shows {} times", times.first, times.last, times.count())
                      : fmt::format("--path takes {:g} seconds, which are {} frames", options.path->seconds(), FrameCount(options));
    return Status::InvalidArgument(fmt::format("{}, but at most {} --frames are possible", what, kMaxTurntableFrames));
  }
  const int frames = int(FrameCount(options));
  if (times.count() > 1 && options.frame.connection.local_workers > 0) {
    if (Status status = CheckInputHeaders(AtTime(options.frame.source, times.last)); !status.ok()) return status;
  }
  std::vector<FrameJob> jobs;
  for (int i = 0; i < frames; ++i) {
    FrameJob& job = jobs.emplace_back(FrameJob{options.frame.request, FileOf(options, i), options.frame.source});
    if (options.times) job.request.time = std::to_string(times.At(i, frames));
  }
  return jobs;
}

// `label` begins each line of progress.
Status RenderOne(const PictureOrder& order, const std::string& label) {
  const Time start = MonotonicNow();
  const FrameOptions& frame = order.frame;
  const auto open_pictures = [&] { return FilesOf(frame, order.output); };
  const auto frames = RenderPictures(frame, {{frame.request, order.output, frame.source}}, nullptr, open_pictures, 1, nullptr, label);
  if (!frames.ok()) return frames.status();
  const ImageSize size = frame.request.size;
  std::cout << fmt::format("rendered {} {}x{} in {:.0f} ms ({}, frame {:.0f} ms)\n", order.output, size.width, size.height,
                           Milliseconds((MonotonicNow() - start).count()), frames->front().statistics.renderer,
                           Milliseconds(frames->front().latency.count()));
  Send(frame, "render", start, *frames, {});
  return Status::Ok();
}

}  // namespace

Status RunRender(const RenderOptions& options) {
  const Result<std::vector<PictureOrder>> orders = PictureOrders(options);
  if (!orders.ok()) return orders.status();
  for (const PictureOrder& order : *orders) {
    if (Status status = CheckPictureFile(order.output, order.frame.request.size); !status.ok()) return status;
    if (Status status = CheckPaths(order.frame, order.output); !status.ok()) return status;
  }
  if (orders->size() == 1) return RenderOne(orders->front(), "");
  std::vector<Status> failures;
  for (const PictureOrder& order : *orders) {
    const std::string& source = order.frame.source;
    const Status status = RenderOne(order, source);
    if (status.code() == StatusCode::kCancelled) return status;
    if (status.ok()) continue;
    const bool named = status.message().find(source) != std::string::npos;
    failures.push_back(named ? status : Status(status.code(), fmt::format("SOURCE {}: {}", source, status.message())));
  }
  return ReportAll("slabstream render", failures);
}

Status RunTurntable(const TurntableOptions& given) {
  const Result<TurntableOptions> with_times = WithTimesOfSource(given);
  if (!with_times.ok()) return with_times.status();
  const TurntableOptions& options = *with_times;
  if (Status status = CheckTurntable(options); !status.ok()) return status;
  const Time start = MonotonicNow();
  const Result<std::vector<FrameJob>> jobs = TurntableJobs(options);
  if (!jobs.ok()) return jobs.status();
  const auto open_pictures = [&] { return OpenPictures(options); };
  std::vector<Status> failures;
  CameraMove move{.turns = options.turns};
  if (options.path) move.cameras = options.path->cameras;
  const auto frames = RenderPictures(options.frame, *jobs, &move, open_pictures, options.in_flight, &failures);
  const std::string who = "slabstream turntable";
  if (!frames.ok()) {
    failures.push_back(frames.status());
    return ReportAll(who, failures);
  }
  const ImageSize size = options.frame.request.size;
  const std::string files = options.output.movie.empty() ? fmt::format("{} to {}", frames->front().output, frames->back().output)
                                                         : fmt::format("into {}", options.output.movie);
  std::cout << fmt::format("rendered {} frames, {}, {}x{} in {:.0f} ms (first frame {:.0f} ms)\n", frames->size(), files, size.width,
                           size.height, Milliseconds((MonotonicNow() - start).count()), Milliseconds(frames->front().latency.count()));
  Send(options.frame, "turntable", start, *frames, failures);
  return ReportAll(who, failures);
}

}  // namespace slabstream
