// The latency of a frame beside rendering: request to last byte, less the time from the first worker's start of rendering to the last one's
// end, and less making the picture from the frame (resampling or resolving, which an embedded renderer would have to do too). The view
// turns. The service is embedded, or a coordinator and workers as processes over ipc, over tcp, and over tcp with keys. One frame is in
// flight, so nothing overlaps: this is the user's wait between two pictures.
//
// A line a transport: medians and 95th percentiles of the frames after a warm-up. "Before render" is the part of this latency before the
// first worker begins.
#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "bench/program.h"
#include "bench/service_processes.h"
#include "client/cli/service_connection.h"
#include "common/base/check.h"
#include "laboratory/measure/statistics.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

constexpr int kWarmUpFrames = 20;

struct Options {
  ServiceSize service;
  int size = 512, frames = 200;
  double zoom = 1;  // at 3 the object fills the picture
  bool straight8 = false;
  const RendererKind* renderer = &DefaultRenderer();
};

// Measurements of each frame, in milliseconds.
struct Measured {
  std::vector<double> latency, render, finish, beside, before;
};

FrameRequest RequestOf(const Options& options, const std::string& dataset, int frame) {
  FrameRequest request;
  request.dataset = dataset;
  request.renderer = options.renderer->name();
  request.size = {options.size, options.size};
  request.view.azimuth_degrees = frame * 360.0 / options.frames;
  request.view.elevation_degrees = 20;
  request.view.zoom = options.zoom;
  request.straight8 = options.straight8;
  return request;
}

Measured Measure(Client& client, const std::string& dataset, const Options& options) {
  Measured measured;
  for (int frame = -kWarmUpFrames; frame < options.frames; ++frame) {
    const std::int64_t submit_ns = MonotonicNow().time_since_epoch().count();
    const Result<Picture> picture = client.Render(RequestOf(options, dataset, frame));
    CHECK(picture.ok()) << picture.status().message();
    if (frame < 0) continue;
    std::int64_t begin_ns = INT64_MAX, end_ns = 0, finish_ns = 0;
    for (const RankReport& report : picture->statistics.reports) {
      finish_ns += report.stage_ns[std::size_t(Stage::kResolve)];
      for (const Span& span : report.spans) {
        if (span.stage != Stage::kRender) continue;
        begin_ns = std::min(begin_ns, span.begin_ns);
        end_ns = std::max(end_ns, span.end_ns);
      }
    }
    const auto milliseconds = [](std::int64_t ns) { return double(ns) / 1e6; };
    measured.latency.push_back(milliseconds(picture->latency.count()));
    measured.render.push_back(milliseconds(end_ns - begin_ns));
    measured.finish.push_back(milliseconds(finish_ns));
    measured.before.push_back(milliseconds(begin_ns - submit_ns));
    measured.beside.push_back(milliseconds(picture->latency.count() - (end_ns - begin_ns) - finish_ns));
  }
  return measured;
}

void PrintHead() {
  fmt::print("{:14} {:>16} {:>16} {:>16} {:>16} {:>16}   ms: median (95 %)\n", "", "latency", "render", "picture", "beside these",
             "before render");
}

void PrintRow(const std::string& name, const Measured& measured) {
  const auto cell = [](const std::vector<double>& values) {
    return fmt::format("{:.2f} ({:.2f})", MedianOf(values).median, Quantile(values, 0.95));
  };
  fmt::print("{:14} {:>16} {:>16} {:>16} {:>16} {:>16}\n", name, cell(measured.latency), cell(measured.render), cell(measured.finish),
             cell(measured.beside), cell(measured.before));
  std::fflush(stdout);
}

// Call before this process has threads.
Measured MeasureProcesses(const Options& options, const std::string& listen, const std::string& directory) {
  const ServiceProcesses service({.directory = directory, .listen = listen, .size = options.service});
  Context context;
  Client client = service.Connect(context);
  return Measure(client, "sphere", options);
}

// With keys: pictures straight from workers, and through the coordinator. Call before this process has threads.
std::pair<Measured, Measured> MeasureWithKeys(const Options& options, const std::string& directory) {
  const ServiceProcesses service({.directory = directory, .size = options.service, .keys = true});
  Context context;
  Client direct = service.Connect(context), relayed = service.Connect(context, false);
  return {Measure(direct, "sphere", options), Measure(relayed, "sphere", options)};
}

Measured MeasureEmbedded(const Options& options, const std::shared_ptr<const Volume>& volume, int workers, int threads) {
  const auto load = [volume]() -> Result<std::shared_ptr<const Volume>> { return volume; };
  ServiceConnection connection = ServiceConnection::OpenLocal({.local_workers = workers, .local_threads = threads}, {load}).value();
  return Measure(connection.client(), connection.dataset(), options);
}

Status Run(const Options& options) {
  const TemporaryDirectory temporary;
  const std::string directory = temporary.path();
  const auto [volume, workers, threads] = options.service;
  const auto sphere = std::make_shared<const Volume>(MakeSphere({.sphere_class = SphereClass::kHollow, .size = volume}).value());
  fmt::print("sphere {0}^3, {1}x{1}, zoom {2}, {3}, {4} workers of {5} threads, {6} frames\n", volume, options.size, options.zoom,
             options.renderer->name(), workers, threads, options.frames);
  PrintHead();
  const std::pair<const char*, std::string> transports[] = {{"tcp", "tcp://127.0.0.1:*"}, {"ipc", "ipc://" + directory + "/service"}};
  for (const auto& [name, listen] : transports) PrintRow(name, MeasureProcesses(options, listen, directory));
  const auto [direct, relayed] = MeasureWithKeys(options, directory);
  PrintRow("keys, direct", direct);
  PrintRow("keys, relayed", relayed);
  PrintRow("embedded", MeasureEmbedded(options, sphere, workers, threads));
  if (workers > 1) PrintRow("embedded, 1", MeasureEmbedded(options, sphere, 1, workers * threads));
  return Status::Ok();
}

void AddOptions(const Command& app, Options& options) {
  AddServiceSize(app, options.service);
  AddInteger(app, "--size", options.size, 1, 8192, "Pixels a side");
  AddInteger(app, "--frames", options.frames, 1, 100000, "Measured frames");
  AddNumber(app, "--zoom", options.zoom, {0.01, kMaxZoom}, "Magnification; at 3 the sphere fills the picture");
  app.AddFlag("--straight8", options.straight8, "Ask for the codes of a PNG of 8 bits, a quarter of the bytes");
  AddRenderer(app, options.renderer);
}

}  // namespace
}  // namespace slabstream

int main(int argc, char** argv) {
  return slabstream::BenchMain(argc, argv, "latency_bench", "The latency of a frame beside its rendering", slabstream::AddOptions,
                               slabstream::Run);
}
