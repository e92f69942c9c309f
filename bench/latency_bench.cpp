// The latency of a frame beside rendering: request to last byte, less the time from the first worker's start of rendering to the last one's
// end, and less making the picture from the frame (resampling or resolving, which an embedded renderer would have to do too). One frame in
// flight, a turning view; embedded, and with a coordinator and workers as processes over ipc and tcp. With one frame in flight nothing
// overlaps: this is the user's wait between two pictures.
//
//   build/bin/latency_bench [--volume VOXELS_A_SIDE] [--size PIXELS_A_SIDE] [--zoom Z] [--frames N] [--workers N] [--threads N]
//                           [--renderer splat|zbuffer]
//
// A line a transport: medians and 95th percentiles of the frames after a warm-up. "Before render" is the part of this latency before the
// first worker begins.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include "client/cli/process.h"
#include "client/client.h"
#include "client/embedded/embedded_service.h"
#include "common/base/check.h"
#include "common/base/large_buffers.h"
#include "common/volume/sphere.h"
#include "common/volume_io/volume_reader.h"
#include "laboratory/measure/statistics.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

constexpr int kWarmUpFrames = 20;
constexpr Duration kPatience = std::chrono::seconds(10);

struct BenchOptions {
  int volume = 64, size = 512, frames = 200, workers = 2, threads = 1;
  double zoom = 1;  // at 3 the object fills the picture
  std::string renderer = "splat";
};

// Measurements of each frame, in milliseconds.
struct Measured {
  std::vector<double> latency, render, finish, beside, before;
};

FrameRequest RequestOf(const BenchOptions& options, int frame) {
  FrameRequest request;
  request.dataset = "sphere";
  request.renderer = options.renderer;
  request.size = {options.size, options.size};
  request.view.azimuth_degrees = frame * 360.0 / options.frames;
  request.view.elevation_degrees = 20;
  request.view.zoom = options.zoom;
  return request;
}

void Measure(Client& client, const BenchOptions& options, Measured& measured) {
  for (int frame = -kWarmUpFrames; frame < options.frames; ++frame) {
    const std::int64_t submit_ns = MonotonicNow().time_since_epoch().count();
    const Result<Picture> picture = client.Render(RequestOf(options, frame));
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
}

void PrintHead() {
  fmt::print("{:12} {:>16} {:>16} {:>16} {:>16} {:>16}   ms: median (95 %)\n", "", "latency", "render", "picture", "beside these",
             "before render");
}

void PrintRow(const std::string& name, const Measured& measured) {
  const auto cell = [](const std::vector<double>& values) {
    return fmt::format("{:.2f} ({:.2f})", Quantile(values, 0.5), Quantile(values, 0.95));
  };
  fmt::print("{:12} {:>16} {:>16} {:>16} {:>16} {:>16}\n", name, cell(measured.latency), cell(measured.render), cell(measured.finish),
             cell(measured.beside), cell(measured.before));
  std::fflush(stdout);
}

// Coordinator and workers as processes, as `slabstream up` starts them. Call before this process has threads.
void MeasureProcesses(const BenchOptions& options, const std::string& listen, const std::string& directory, Measured& measured) {
  const auto start = [&](std::vector<std::string> command) {
    command[0] = ProgramBeside(command[0]).value();
    return Child::Start({.command = std::move(command), .log_path = directory + "/log"}).value();
  };
  Child coordinator = start({"slabstream-coordinator", "--listen", listen, "--data", "sphere=" + directory + "/sphere.mha"});
  const std::string line = coordinator.ReadLine(kPatience).value();
  const auto value = [&line](const std::string& key) {
    const std::size_t begin = line.find(key + "=") + key.size() + 1;
    return line.substr(begin, line.find(' ', begin) - begin);
  };
  std::vector<Child> workers;
  for (int i = 0; i < options.workers; ++i) {
    workers.push_back(start({"slabstream-worker", "--coordinator", value("workers"), "--threads", std::to_string(options.threads)}));
  }
  {
    Context context;
    Client client = Client::Connect(context, value("client")).value();
    while (client.QueryStatus().value().workers.size() < std::size_t(options.workers)) ::usleep(10000);
    Measure(client, options, measured);
    CHECK(client.ShutDownService().ok());
  }
  for (Child& worker : workers) worker.Terminate(kPatience);
  coordinator.Terminate(kPatience);
}

void MeasureEmbedded(const BenchOptions& options, const std::shared_ptr<const Volume>& volume, int workers, int threads,
                     Measured& measured) {
  Context context;
  EmbeddedOptions embedded;
  embedded.workers = workers;
  embedded.worker.threads = std::uint32_t(threads);
  embedded.coordinator.catalogue["sphere"] = [volume]() -> Result<std::shared_ptr<const Volume>> { return volume; };
  const std::unique_ptr<EmbeddedService> service = EmbeddedService::Start(context, std::move(embedded)).value();
  Client client = Client::Connect(context, service->endpoint()).value();
  Measure(client, options, measured);
}

int Run(const BenchOptions& options) {
  const TemporaryDirectory temporary;
  const std::string directory = temporary.path();
  const auto sphere = std::make_shared<const Volume>(MakeSphere({.sphere_class = SphereClass::kHollow, .size = options.volume}).value());
  CHECK(WriteVolume(*sphere, directory + "/sphere.mha").ok());
  fmt::print("sphere {0}^3, {1}x{1}, zoom {2}, {3}, {4} workers of {5} threads, {6} frames\n", options.volume, options.size, options.zoom,
             options.renderer, options.workers, options.threads, options.frames);
  PrintHead();
  const std::pair<const char*, std::string> transports[] = {{"tcp", "tcp://127.0.0.1:*"}, {"ipc", "ipc://" + directory + "/service"}};
  for (const auto& [name, listen] : transports) {
    Measured measured;
    MeasureProcesses(options, listen, directory, measured);
    PrintRow(name, measured);
  }
  Measured embedded, embedded_one;
  MeasureEmbedded(options, sphere, options.workers, options.threads, embedded);
  PrintRow("embedded", embedded);
  if (options.workers > 1) {
    MeasureEmbedded(options, sphere, 1, options.workers * options.threads, embedded_one);
    PrintRow("embedded, 1", embedded_one);
  }
  return 0;
}

}  // namespace
}  // namespace slabstream

int main(int argc, char** argv) {
  slabstream::KeepFrameBuffers();
  slabstream::BenchOptions options;
  CLI::App app("Latency of a frame beside its rendering.");
  app.add_option("--volume", options.volume)->check(CLI::Range(2, 1024));
  app.add_option("--size", options.size)->check(CLI::Range(1, 8192));
  app.add_option("--frames", options.frames)->check(CLI::Range(1, 100000));
  app.add_option("--workers", options.workers)->check(CLI::Range(1, 64));
  app.add_option("--threads", options.threads)->check(CLI::Range(1, 64));
  app.add_option("--zoom", options.zoom)->check(CLI::Range(slabstream::kMinZoom, slabstream::kMaxZoom));
  app.add_option("--renderer", options.renderer)->check(CLI::IsMember({"splat", "zbuffer"}));
  CLI11_PARSE(app, argc, argv);
  return slabstream::Run(options);
}
