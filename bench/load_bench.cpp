// Puts a service under the load of many clients, which are threads of this process. Well-behaved clients ask for a picture, read it, and
// ask for the next one. After a while two others join them: one asks for pictures and never reads them, one asks for very large pictures.
// The program exits with 0 if each process stays within its --memory, and if the well-behaved clients together keep at least half of their
// pictures a second. With --fair it measures small frames beside large requests instead (fair_load.h).
#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <fstream>
#include <functional>
#include <thread>

#include "bench/fair_load.h"
#include "bench/program.h"
#include "bench/service_processes.h"
#include "client/client.h"
#include "common/base/check.h"
#include "common/volume/memory_budget.h"
#include "common/wire/any_message.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

constexpr Duration kAnswerWait = std::chrono::milliseconds(200);
constexpr Duration kReportInterval = std::chrono::seconds(10);

struct Options {
  ServiceSize service;
  int clients = 200, seconds = 600, size = 128, large = 8192;
  int memory_mebi = 1024;  // of each process
  bool fair = false;
  int samples = FairLoadOptions{}.samples;
};

FrameRequest RequestOf(int size, int frame) {
  FrameRequest request;
  request.dataset = "sphere";
  request.size = {size, size};
  request.view.azimuth_degrees = frame * 7 % 360;
  return request;
}

struct Counts {
  std::atomic<std::uint64_t> pictures = 0, failures = 0;
};

// Asks for one picture after another.
void AskAndRead(Client& client, int size, Counts& counts, const std::stop_token& stop) {
  for (int frame = 0; !stop.stop_requested(); ++frame) {
    const RequestId request = client.Submit(RequestOf(size, frame));
    for (bool over = false; !over && !stop.stop_requested();) {
      const std::optional<ClientEvent> event = client.Next(kAnswerWait);
      if (!event || event->request != request) continue;
      const auto* picture = std::get_if<Picture>(&event->what);
      const bool failed = std::holds_alternative<Status>(event->what);
      over = failed || (picture != nullptr && picture->final);
      if (over) ++(failed ? counts.failures : counts.pictures);
    }
  }
}

// Asks for more and more, and reads nothing, but says that it is alive.
void AskAndNeverRead(Context& context, const std::string& endpoint, int size, const std::stop_token& stop) {
  Socket socket = Socket::Dealer(context, {.receive_high_water_mark = 1}).value();
  CHECK(socket.Connect(endpoint).ok());
  for (RequestId request = 1; !stop.stop_requested(); ++request) {
    (void)socket.Send({}, Encode(SubmitFrame{.request = request, .deadline_ms = 600'000, .frame = RequestOf(size, int(request % 360))}));
    (void)socket.Send({}, Encode(ClientPing{.nonce = request}));
    ::usleep(50'000);
  }
}

// Bytes of resident memory that the process had at most.
std::uint64_t PeakMemory(pid_t pid) {
  std::ifstream file(fmt::format("/proc/{}/status", pid));
  for (std::string word; file >> word;) {
    std::uint64_t kibi = 0;
    if (word == "VmHWM:" && file >> kibi) return kibi << 10;
  }
  return 0;
}

class Load {
 public:
  explicit Load(const Options& options) : options_(options) {}

  // Call before this process has threads.
  Status Run() {
    const TemporaryDirectory temporary;
    const std::string memory = fmt::format("{}MiB", options_.memory_mebi);
    const ServiceProcesses service({.directory = temporary.path(), .size = options_.service, .arguments_of_each = {"--memory", memory}});
    return Measure(service);
  }

 private:
  Status Measure(const ServiceProcesses& service) {
    Context context;
    std::vector<Client> clients;
    for (int i = 0; i < options_.clients; ++i) clients.push_back(service.Connect(context));
    fmt::print("sphere {0}^3, {1} clients of {2}x{2} pixels, {3} workers of {4} threads, {5} MiB for each process\n",
               options_.service.volume, options_.clients - 2, options_.size, options_.service.workers, options_.service.threads,
               options_.memory_mebi);

    Counts good, large;
    std::vector<std::jthread> threads;
    for (std::size_t i = 2; i < clients.size(); ++i) {
      threads.emplace_back([&, i](const std::stop_token& stop) { AskAndRead(clients[i], options_.size, good, stop); });
    }
    (void)RateOf(good, options_.seconds / 20, "all begin");
    const double alone = RateOf(good, options_.seconds / 4, "well-behaved clients alone");
    threads.emplace_back([&](const std::stop_token& stop) { AskAndNeverRead(context, service.endpoint(), 1024, stop); });
    threads.emplace_back([&](const std::stop_token& stop) { AskAndRead(clients[1], options_.large, large, stop); });
    const double beside = RateOf(good, options_.seconds - options_.seconds / 4 - options_.seconds / 20, "beside the two others");
    for (std::jthread& thread : threads) thread.request_stop();
    threads.clear();

    fmt::print("{0}x{0}: {1} pictures, {2} refused or failed; well-behaved clients: {3} pictures, {4} failures\n", options_.large,
               large.pictures, large.failures, good.pictures, good.failures);
    const std::uint64_t limit = std::uint64_t(options_.memory_mebi) << 20;
    Status status;
    for (const auto& [name, pid] : service.pids()) {
      const std::uint64_t peak = PeakMemory(pid);
      fmt::print("{:12} {:>10} at most, limit {}\n", name, MemoryText(peak), MemoryText(limit));
      if (peak == 0 || peak > limit) status = Status::ResourceExhausted(fmt::format("{} took {}", name, MemoryText(peak)));
    }
    fmt::print("speed kept: {:.2f}\n", beside / alone);
    if (beside < alone / 2) status = Status::Unavailable("well-behaved clients kept less than half of their speed");
    if (good.failures > 0) status = Status::Unavailable("frames of well-behaved clients failed");
    return status;
  }

  // Pictures a second, over so many seconds.
  static double RateOf(const Counts& counts, int seconds, const std::string& what) {
    const std::uint64_t before = counts.pictures;
    const Time begin = MonotonicNow(), end = begin + std::chrono::seconds(std::max(seconds, 1));
    const auto rate = [&] { return double(counts.pictures - before) / std::chrono::duration<double>(MonotonicNow() - begin).count(); };
    while (MonotonicNow() < end) {
      std::this_thread::sleep_for(std::min<Duration>(end - MonotonicNow(), kReportInterval));
      fmt::print("{}: {:.1f} pictures a second\n", what, rate());
      std::fflush(stdout);
    }
    return rate();
  }

  const Options options_;
};

Status Run(const Options& options) {
  if (!options.fair) return Load(options).Run();
  return MeasureFairLoad({.service = options.service, .size = options.large, .samples = options.samples});
}

void AddOptions(const Command& app, Options& options) {
  AddInteger(app, "--clients", options.clients, 3, 1000, "Clients, with the one that never reads and the one that asks for large pictures");
  AddInteger(app, "--seconds", options.seconds, 20, 86400, "Duration; a quarter of it without those two");
  AddServiceSize(app, options.service);
  AddInteger(app, "--size", options.size, 1, 8192, "Pixels a side of most pictures");
  AddInteger(app, "--large", options.large, 1, 16384, "Pixels a side of the large pictures");
  app.AddFlag("--fair", options.fair, "Instead: small frames beside large requests of another client, of --volume and --large");
  AddInteger(app, "--samples", options.samples, 1, 16, "With --fair: samples in each voxel length of the large intensity projection");
  AddInteger(app, "--memory", options.memory_mebi, 256, 1 << 20, "MiB for the coordinator, and for each worker");
}

}  // namespace
}  // namespace slabstream

int main(int argc, char** argv) {
  return slabstream::BenchMain(argc, argv, "load_bench", "A service under the load of many clients, one of which never reads",
                               slabstream::AddOptions, slabstream::Run);
}
