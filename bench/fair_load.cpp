#include "bench/fair_load.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "bench/service_processes.h"
#include "client/client.h"
#include "common/base/check.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

constexpr int kSmall = 64;  // voxels a side of the small frames' sphere, and pixels a side
constexpr int kAloneFrames = 60;
constexpr double kMostTimesAlone = 3, kPieceMs = 50;

constexpr Duration kLeast = std::chrono::seconds(3);  // of large requests, one after the other

struct LargeCase {
  const char* name;
  const char* renderer;
  const char* decomposition;
  const char* small_dataset;
};
constexpr LargeCase kLargeCases[] = {
    {"mip", "mip", "slab", "other"}, {"kd-tree", "splat", "kd-tree", "other"}, {"same", "mip", "slab", "sphere"}};

FrameRequest SmallFrame(const char* dataset, int frame) {
  FrameRequest request;
  request.dataset = dataset;
  request.size = {kSmall, kSmall};
  request.view.azimuth_degrees = frame * 7 % 360;
  return request;
}

// No two of them have the same transfer function, so that each is counted and planned from the beginning.
FrameRequest LargeFrame(const LargeCase& of, const FairLoadOptions& options, int number) {
  FrameRequest request;
  request.dataset = "sphere";
  request.renderer = of.renderer;
  request.size = {options.size, options.size};
  request.policy.decomposition = of.decomposition;
  if (of.renderer == std::string("splat")) request.policy.balance_by = "occupied";
  if (of.renderer == std::string("mip")) request.parameters["sampling-rate"] = std::to_string(options.samples);
  request.transfer.choice = TransferFunction{.colors = {{0, {0, 0, 0}}, {255, {1, 1, 1}}},
                                             .opacities = {{0, 0}, {20, 0}, {60, 0.2 + 0.0001 * number}, {255, 0.5}}};
  return request;
}

// Processor seconds of a process so far.
double ProcessorSeconds(pid_t pid) {
  std::ifstream file(fmt::format("/proc/{}/stat", pid));
  std::string text((std::istreambuf_iterator<char>(file)), {});
  std::istringstream fields(text.substr(text.rfind(')') + 1));
  std::vector<std::string> words((std::istream_iterator<std::string>(fields)), {});
  constexpr std::size_t kUser = 11, kSystem = 12;  // behind the name
  CHECK_LT(kSystem, words.size());
  return (std::stod(words[kUser]) + std::stod(words[kSystem])) / double(::sysconf(_SC_CLK_TCK));
}

double WorkerSeconds(const ServiceProcesses& service) {
  double seconds = 0;
  for (const auto& [name, pid] : service.pids()) seconds += name.starts_with("worker") ? ProcessorSeconds(pid) : 0;
  return seconds;
}

double Milliseconds(Duration duration) { return std::chrono::duration<double, std::milli>(duration).count(); }

double QuantileOf(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  std::ranges::sort(values);
  return values[std::min(values.size() - 1, std::size_t(share * double(values.size())))];
}

struct Large {
  int frames = 0;
  double seconds = 0;         // until their pictures
  double worker_seconds = 0;  // of all workers meanwhile, whatever they did
};

// One large request after the other. `number` counts them.
Large Ask(Client& client, const LargeCase& of, const FairLoadOptions& options, const ServiceProcesses& service, int& number) {
  const double busy = WorkerSeconds(service);
  const Time begin = MonotonicNow();
  Large asked;
  for (; asked.frames == 0 || MonotonicNow() < begin + kLeast; ++asked.frames) {
    const Result<Picture> picture = client.Render(LargeFrame(of, options, ++number));
    CHECK(picture.ok()) << picture.status().message();
  }
  asked.seconds = Milliseconds(MonotonicNow() - begin) / 1000;
  asked.worker_seconds = WorkerSeconds(service) - busy;
  return asked;
}

}  // namespace

Status MeasureFairLoad(const FairLoadOptions& options) {
  const TemporaryDirectory temporary;
  const ServiceProcesses service({.directory = temporary.path(), .size = options.service, .other_volume = kSmall});
  Context context;
  Client small = service.Connect(context), large = service.Connect(context);
  fmt::print("sphere {0}^3 at {1}x{1} beside sphere {2}^3 at {2}x{2}, {3} workers of {4} threads\n", options.service.volume, options.size,
             kSmall, options.service.workers, options.service.threads);
  Status status;
  int number = 0;
  CHECK(large.Render(LargeFrame(kLargeCases[0], options, number)).ok());  // the voxels travel once
  for (const LargeCase& of : kLargeCases) {
    std::vector<double> alone, beside;
    for (int frame = 0; frame < kAloneFrames; ++frame)
      alone.push_back(Milliseconds(small.Render(SmallFrame(of.small_dataset, frame)).value().latency));
    const Large without = Ask(large, of, options, service, number);
    Large with;
    {
      std::jthread other([&](const std::stop_token& stop) {
        for (int frame = 0; !stop.stop_requested(); ++frame) {
          const Picture picture = small.Render(SmallFrame(of.small_dataset, frame)).value();
          if (stop.stop_requested()) return;
          beside.push_back(Milliseconds(picture.latency));
        }
      });
      with = Ask(large, of, options, service, number);
      other.request_stop();
    }
    const double median_alone = QuantileOf(alone, 0.5), median = QuantileOf(beside, 0.5);
    const double busy = with.worker_seconds / with.seconds / (without.worker_seconds / without.seconds);
    const double of_large = without.worker_seconds / without.frames * with.frames;  // what they take alone
    const double share = 1 - of_large / std::max(with.worker_seconds, of_large);
    fmt::print(
        "{:8} large: {:.2f} s alone, {:.2f} s beside {} small ones. small: {:.1f} ms alone; {:.1f} ms beside it in the median, 95 % "
        "{:.1f}, most {:.1f}. workers are {:.2f} times as busy; small ones take {:.2f} of their time\n",
        of.name, without.seconds / without.frames, with.seconds / with.frames, beside.size(), median_alone, median,
        QuantileOf(beside, 0.95), QuantileOf(beside, 1), busy, share);
    std::fflush(stdout);
    if (median > kMostTimesAlone * median_alone + kPieceMs) {
      status = Status::Unavailable(fmt::format("{}: small frames wait: {:.1f} ms instead of {:.1f}", of.name, median, median_alone));
    }
    if (busy < 0.9)
      status = Status::Unavailable(fmt::format("{}: workers are {:.2f} times as busy as without small frames", of.name, busy));
    if (share > 0.6) status = Status::Unavailable(fmt::format("{}: small frames take {:.2f} of the workers' time", of.name, share));
  }
  return status;
}

}  // namespace slabstream
