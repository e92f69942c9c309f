// The cost of combining: p worker processes on this host, each with a finished picture, until the root holds the result. Nothing else runs:
// the workers are the real ones (machine, executor, sockets) with a renderer that returns a prepared picture; this program plays their
// coordinator. Time runs from the moment at which the last rank holds its picture to the end of the last combining step at the root.
//
// Pictures are premultiplied float RGBA, combined by over. "sparse": each rank has a square of 20 % of the picture, and these slide from
// one corner to the other; they compress better than any rendered picture. Each line is a case: median, 10th and 90th percentile in
// milliseconds; the median until the coordinator knows; the processor time of all workers for a frame, without making the pictures (if
// workers outnumber cores, the time is not below this over the number of cores); and the ratio of pixels handed over to pixels filled,
// which bounds the gain from sparse pictures. For tcp and full pictures, the first line is the system's time to move them one after the
// other: a process writes those of p - 1 ranks to a plain socket, another reads them, from and to memory that both keep.
#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <pthread.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <ctime>

#include "bench/program.h"
#include "common/base/check.h"
#include "common/combining/schemes.h"
#include "common/transport/socket.h"
#include "common/wire/any_message.h"
#include "common/wire/payload.h"
#include "laboratory/measure/statistics.h"
#include "tests/support/temporary_directory.h"
#include "worker/service/service.h"

namespace slabstream {
namespace {

constexpr Epoch kEpoch = 1;
constexpr DatasetId kDataset = 1;
constexpr Duration kPatience = std::chrono::seconds(30);
constexpr int kWarmUp = 10;

struct Case {
  Rank ranks = 2;
  std::int32_t size = 1024;
  bool sparse = false;
  std::string link;
  ColorCoding color = ColorCoding::kFloat32;  // of the pixels sent
  LinkCompression compression = LinkCompression::kAuto;
};

// Memory that the processes of one case share.
struct Shared {
  pthread_barrier_t all_hold;             // their pictures of the current frame
  std::atomic<std::int64_t> all_held_ns;  // when the last one did
  std::atomic<std::int64_t> made_ns;      // processor time spent on making them, over all workers and frames
};

std::int64_t NowNs() { return MonotonicNow().time_since_epoch().count(); }

std::int64_t ProcessorNs(clockid_t clock) {
  timespec time = {};
  CHECK_EQ(::clock_gettime(clock, &time), 0);
  return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
}
std::int64_t ProcessorNsOf(pid_t process) {
  clockid_t clock = {};
  CHECK_EQ(::clock_getcpuclockid(process, &clock), 0);
  return ProcessorNs(clock);
}

PixelBounds BoundsOf(const Case& config, Rank rank) {
  if (!config.sparse) return {0, 0, config.size, config.size};
  const auto side = std::int32_t(std::lround(config.size * std::sqrt(0.2)));
  const auto at = std::int32_t(std::int64_t(config.size - side) * rank / std::max<Rank>(config.ranks - 1, 1));
  return {at, at, at + side, at + side};
}

// All pixels that the steps hand over, divided by the non-empty ones among them: a combined image has more of these than each picture.
double PixelsOverFilled(const Case& config, const IndexedSchedule& schedule) {
  const auto size = std::size_t(config.size);
  std::vector<std::vector<bool>> filled(config.ranks, std::vector<bool>(size * size));
  for (Rank rank = 0; rank < config.ranks; ++rank) {
    const PixelBounds bounds = BoundsOf(config, rank);
    for (auto y = std::size_t(bounds.y_begin); y < std::size_t(bounds.y_end); ++y) {
      std::fill_n(filled[rank].begin() + std::ptrdiff_t(y * size + std::size_t(bounds.x_begin)), bounds.width(), true);
    }
  }
  double all = 0, of_them = 0;
  for (const Step& step : schedule.steps()) {
    for (std::size_t pixel = step.pixels.begin; pixel < step.pixels.end; ++pixel) {
      ++all;
      if (!filled[step.from][pixel]) continue;
      ++of_them;
      filled[step.to][pixel] = true;
    }
  }
  return all / of_them;
}

LocalImage MakePicture(const Case& config, Rank rank) {
  LocalImage image = MakeUnwrittenImage(PixelFormat::kRgba, BoundsOf(config, rank));
  for (std::size_t i = 0; i < image.rgba.size(); ++i) {
    const float alpha = 0.1F + 0.05F * float((i / 4 + rank) % 7);
    image.rgba[i] = i % 4 == 3 ? alpha : alpha * float(i % 5) / 5;
  }
  return image;
}

// Returns a copy of one picture, when all ranks have theirs.
class PreparedPicture : public Renderer {
 public:
  PreparedPicture(const Case& config, Rank rank, Shared& shared) : picture_(MakePicture(config, rank)), shared_(shared) {}

  Result<LocalImage> Render(BoxData&, const LevelBox&, const FrameSetup&, const OcclusionMask&, const RenderControl&,
                            RankReport&) override {
    const std::int64_t begin_ns = ProcessorNs(CLOCK_THREAD_CPUTIME_ID);
    LocalImage copy = picture_;
    shared_.made_ns += ProcessorNs(CLOCK_THREAD_CPUTIME_ID) - begin_ns;
    shared_.all_held_ns = NowNs();  // the last one's time stays
    ::pthread_barrier_wait(&shared_.all_hold);
    return copy;
  }

 private:
  const LocalImage picture_;
  Shared& shared_;
};

[[noreturn]] void RunWorker(const Case& config, Rank rank, const std::string& directory, Shared& shared) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  Context context;
  WorkerOptions options;
  options.coordinator_endpoint = "ipc://" + directory + "/control";
  const bool tcp = config.link == "tcp" || config.link == "sealed";
  options.images_endpoint = tcp ? "tcp://127.0.0.1:*" : "ipc://" + directory + "/images-" + std::to_string(rank);
  if (config.link == "sealed")
    options.keys = ClientKeys{MakeKeyPair().public_key, MakeKeyPair()};  // the coordinator's is not used over ipc
  options.share_memory = config.link == "shared";
  options.machine.compression = config.compression;
  options.make_renderer = [&](const RendererKind&) { return std::make_unique<PreparedPicture>(config, rank, shared); };
  auto service = WorkerService::Start(context, std::move(options));
  CHECK(service.ok()) << service.status().message();
  (*service)->WaitUntilStopped();
  std::_Exit(0);
}

struct Times {
  double pixels_over_filled = 1;
  std::vector<double> combined, reported;  // milliseconds
  double processor = 0;                    // milliseconds a frame, of all workers
};

// Plays the coordinator of one case's workers.
class Coordinator {
 public:
  Coordinator(const Case& config, const std::string& directory, const Shared& shared, std::vector<pid_t> processes)
      : config_(config),
        shared_(shared),
        processes_(std::move(processes)),
        control_(*Socket::Router(context_)),
        voxels_(*Socket::Router(context_)) {
    CHECK(control_.Bind("ipc://" + directory + "/control").ok());
    voxels_endpoint_ = *voxels_.Bind("ipc://" + directory + "/voxels");
    SetRenderer(DefaultRenderer(), setup_);
    setup_.dataset = kDataset;
    setup_.description.geometry.size = {16, 16, 65535};
    setup_.range = {0, 1};
    setup_.camera = MakeCamera({}, {config.size, config.size}, setup_.description.geometry);
    setup_.sheets = MakeSheetGrid(setup_.camera, setup_.description.geometry);
    setup_.sheets.width = setup_.sheets.height = config.size;
    setup_.transfer.colors = {{0, {1, 1, 1}}};
    setup_.transfer.opacities = {{0, 1, 0.5, 0}};
    setup_.termination = 0;
    const Time deadline = MonotonicNow() + kPatience;
    while (workers_.size() < config.ranks) {
      CHECK(MonotonicNow() < deadline) << workers_.size() << " of " << config.ranks << " workers have come";
      Serve();
    }
  }

  Times Measure(const std::string& scheme, int repeats) {
    GroupAssignment assignment;
    assignment.epoch = kEpoch;
    assignment.group_count = 2;  // so that no picture is made of the group
    assignment.setup = setup_;
    for (Rank rank = 0; rank < config_.ranks; ++rank) {
      const std::int32_t z = 8 * std::int32_t(rank) + 64;
      assignment.group.placements.push_back({rank, {{0, 0, z}, {16, 16, z + 8}}, rank + 1});
      assignment.peers.push_back({rank + 1, workers_[rank].endpoint, workers_[rank].memory_scope, workers_[rank].key});
    }
    assignment.group.schedule = {scheme, config_.ranks, {0}};
    assignment.group.color = config_.color;
    assignment.display = 1;
    Times times;
    if (config_.ranks > 1)
      times.pixels_over_filled = PixelsOverFilled(config_, *DeriveSchedule(assignment.group.schedule, WholeFrame(setup_)).value());
    std::int64_t busy_ns = 0;
    for (int i = -kWarmUp; i < repeats; ++i) {
      if (i == 0) busy_ns = BusyNs();
      assignment.key = {++frame_, 0, 0};
      assignment.finished_before = frame_;
      done_.reset();
      for (const Worker& worker : workers_) Send(worker.identity, assignment);
      const Time deadline = MonotonicNow() + kPatience;
      while (!done_) {
        CHECK(MonotonicNow() < deadline) << scheme << ": no answer";
        Serve();
      }
      if (i < 0) continue;
      std::int64_t end_ns = 0;
      for (const RankReport& report : done_->reports) {
        for (const Span& span : report.spans) {
          if (span.stage == Stage::kCombine) end_ns = std::max(end_ns, span.end_ns);
        }
      }
      times.combined.push_back(double(end_ns - shared_.all_held_ns) / 1e6);
      times.reported.push_back(double(reported_ns_ - shared_.all_held_ns) / 1e6);
    }
    times.processor = double(BusyNs() - busy_ns) / 1e6 / repeats;
    return times;
  }

 private:
  struct Worker {
    std::string identity, endpoint;
    std::uint64_t memory_scope = 0;
    std::string key;  // of its images plane
  };

  // Processor time of all workers, without making the pictures.
  std::int64_t BusyNs() const {
    std::int64_t sum = -shared_.made_ns;
    for (const pid_t process : processes_) sum += ProcessorNsOf(process);
    return sum;
  }

  void Send(const std::string& identity, MessageView message) { CHECK(control_.Send(identity, Encode(message)).ok()); }

  void Serve() {
    const std::vector<Socket*> sockets = {&control_, &voxels_};
    Wait(sockets, nullptr, std::chrono::milliseconds(200));
    if (const Time now = MonotonicNow(); now >= next_ping_) {
      next_ping_ = now + std::chrono::milliseconds(500);
      for (const Worker& worker : workers_) Send(worker.identity, Ping{kEpoch, frame_, {}});
    }
    while (const auto incoming = control_.TryReceive()) {
      const AnyMessage message = Decode(incoming->header()).value();
      if (const auto* hello = std::get_if<Register>(&message)) {
        if (std::ranges::find(workers_, incoming->identity, &Worker::identity) != workers_.end()) continue;
        workers_.push_back({incoming->identity, hello->images_endpoint, hello->memory_scope, hello->images_key});
        Send(incoming->identity, Welcome{kEpoch, hello->incarnation, WorkerId(workers_.size()), voxels_endpoint_, 1000, 60000});
      } else if (const auto* done = std::get_if<GroupDone>(&message)) {
        reported_ns_ = NowNs();
        if (done->key.frame == frame_) done_ = *done;
      } else if (const auto* trouble = std::get_if<WorkerTrouble>(&message)) {
        CHECK(false) << trouble->status.message();
      }
    }
    while (const auto incoming = voxels_.TryReceive()) {
      const auto request = std::get<ChunkRequest>(Decode(incoming->header()).value());
      const auto bytes = std::size_t(request.box.voxel_count()) * BytesPerSample(setup_.description.type);
      Chunk chunk = {.epoch = kEpoch, .dataset = kDataset, .box = request.box, .chunk = request.chunk};
      const Bytes payload = PackChunk(Bytes(std::vector<std::byte>(std::min<std::size_t>(bytes, kChunkBytes))), Codec::kRaw, chunk);
      CHECK(voxels_.Send(incoming->identity, Encode(chunk), payload).ok());
    }
  }

  const Case& config_;
  const Shared& shared_;
  const std::vector<pid_t> processes_;
  Context context_;
  Socket control_, voxels_;
  std::string voxels_endpoint_;
  FrameSetup setup_;
  std::vector<Worker> workers_;
  FrameId frame_ = 0;
  Time next_ping_ = Time::min();
  std::int64_t reported_ns_ = 0;
  std::optional<GroupDone> done_;
};

// In a process of its own: workers are forked before it has any thread.
void RunCase(const Case& config, const std::vector<std::string>& schemes, int repeats) {
  const TemporaryDirectory temporary;
  const std::string directory = temporary.path();
  void* const memory = ::mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  CHECK(memory != MAP_FAILED);
  Shared& shared = *new (memory) Shared{};
  pthread_barrierattr_t attributes;
  ::pthread_barrierattr_init(&attributes);
  ::pthread_barrierattr_setpshared(&attributes, PTHREAD_PROCESS_SHARED);
  ::pthread_barrier_init(&shared.all_hold, &attributes, config.ranks);
  std::vector<pid_t> workers;
  for (Rank rank = 0; rank < config.ranks; ++rank) {
    workers.push_back(::fork());
    CHECK(workers.back() >= 0);
    if (workers.back() == 0) RunWorker(config, rank, directory, shared);
  }
  {
    Coordinator coordinator(config, directory, shared, workers);
    for (const std::string& scheme : schemes) {
      const Times times = coordinator.Measure(scheme, repeats);
      fmt::print("{:6} {:5} {:6} p {:3}  {:20} {:8.2f} [{:.2f}, {:.2f}]  reported {:8.2f}  processor {:8.2f}  pixels/filled {:.2f}\n",
                 config.link, config.size, config.sparse ? "sparse" : "full", config.ranks, scheme, MedianOf(times.combined).median,
                 Quantile(times.combined, 0.1), Quantile(times.combined, 0.9), MedianOf(times.reported).median, times.processor,
                 times.pixels_over_filled);
      (void)std::fflush(stdout);
    }
  }
  for (const pid_t worker : workers) ::kill(worker, SIGKILL);
  for (const pid_t worker : workers) ::waitpid(worker, nullptr, 0);
}

// In memory that is kept from frame to frame.
using Pictures = std::vector<std::vector<std::byte>>;

// Accepts one connection, reads pictures into those of `pictures` in turn, and answers each with a byte.
[[noreturn]] void DrainPictures(int listener, Pictures pictures) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  const int socket = ::accept(listener, nullptr, nullptr);
  for (std::size_t i = 0;; ++i) {
    std::vector<std::byte>& picture = pictures[i % pictures.size()];
    for (std::size_t read = 0; read < picture.size();) {
      const ssize_t count = ::recv(socket, picture.data() + read, picture.size() - read, 0);
      if (count <= 0) std::_Exit(0);
      read += std::size_t(count);
    }
    CHECK_EQ(::send(socket, picture.data(), 1, 0), 1);
  }
}

// Measures the system's time to move the pictures of all ranks but one between processes, through connections like the workers'. Both ends
// hold as many pictures, so that they are as far in a cache as a frame's are. Called before this process has any thread.
void MeasureLoopback(std::int32_t size, Rank ranks, int repeats) {
  constexpr char kCongestionControl[] = "reno";
  const std::size_t bytes = 4 * sizeof(float) * std::size_t(size) * std::size_t(size), images = std::max<Rank>(ranks, 2) - 1;
  const Pictures pictures(images, std::vector<std::byte>(bytes, std::byte{1}));
  sockaddr_in address = {};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t length = sizeof(address);
  const int listener = ::socket(AF_INET, SOCK_STREAM, 0);
  CHECK(::bind(listener, reinterpret_cast<sockaddr*>(&address), length) == 0 && ::listen(listener, 1) == 0);
  CHECK_EQ(::getsockname(listener, reinterpret_cast<sockaddr*>(&address), &length), 0);
  const pid_t reader = ::fork();
  CHECK(reader >= 0);
  if (reader == 0) DrainPictures(listener, pictures);
  const int socket = ::socket(AF_INET, SOCK_STREAM, 0);
  CHECK_EQ(::setsockopt(socket, IPPROTO_TCP, TCP_CONGESTION, kCongestionControl, sizeof(kCongestionControl) - 1), 0);
  CHECK_EQ(::connect(socket, reinterpret_cast<sockaddr*>(&address), length), 0);
  std::vector<double> times;
  const auto busy_ns = [&] { return ProcessorNs(CLOCK_PROCESS_CPUTIME_ID) + ProcessorNsOf(reader); };
  std::int64_t begin_busy_ns = 0;
  for (int i = -kWarmUp; i < repeats; ++i) {
    if (i == 0) begin_busy_ns = busy_ns();
    const std::int64_t begin_ns = NowNs();
    for (const std::vector<std::byte>& picture : pictures) {
      for (std::size_t written = 0; written < bytes;) {
        const ssize_t count = ::send(socket, picture.data() + written, bytes - written, 0);
        CHECK(count > 0);
        written += std::size_t(count);
      }
      std::byte answer;
      CHECK_EQ(::recv(socket, &answer, 1, 0), 1);
    }
    times.push_back(double(NowNs() - begin_ns) / 1e6);
  }
  times.erase(times.begin(), times.begin() + kWarmUp);
  const double processor = double(busy_ns() - begin_busy_ns) / 1e6 / repeats;
  fmt::print("tcp    {:5} full   p {:3}  {:20} {:8.2f} [{:.2f}, {:.2f}]  {:17} processor {:8.2f}\n", size, ranks, "bytes alone",
             MedianOf(times).median, Quantile(times, 0.1), Quantile(times, 0.9), "", processor);
  (void)std::fflush(stdout);  // before the next fork
  ::close(socket);
  ::close(listener);
  ::waitpid(reader, nullptr, 0);
}

struct Options {
  std::vector<Rank> ranks = {2, 4, 8, 16};
  std::vector<std::int32_t> sizes = {1024, 512};
  std::vector<std::string> schemes = {"fan-in",          "centralized", "chain",       "tree:4",
                                      "tree:4,strips=4", "radix-k",     "binary-swap", "direct-send"};
  std::vector<std::string> images = {"full", "sparse"}, links = {"shared", "tcp"};
  int repeats = 50;
  ColorCoding color = ColorCoding::kFloat32;
  LinkCompression compression = LinkCompression::kAuto;
};

// A case at a time, in a process of its own.
Status Run(const Options& options) {
  for (const std::string& link : options.links) {
    for (const std::int32_t size : options.sizes) {
      for (const std::string& image : options.images) {
        for (const Rank ranks : options.ranks) {
          if (link == "tcp" && image == "full") MeasureLoopback(size, ranks, options.repeats);
          const pid_t child = ::fork();
          CHECK(child >= 0);
          if (child == 0) {
            RunCase({ranks, size, image == "sparse", link, options.color, options.compression}, options.schemes, options.repeats);
            std::_Exit(0);
          }
          int status = 0;
          ::waitpid(child, &status, 0);
          if (status != 0) return Status::Internal("a case has failed");
        }
      }
    }
  }
  return Status::Ok();
}

void AddOptions(const Command& app, Options& options) {
  const auto scheme = [](const std::string&, const std::string& text) { return TextIf(ParseCombining(text).status(), text); };
  AddList(app, "--ranks", options.ranks, Integers<Rank>(1, 64), "Numbers of workers");
  AddList(app, "--size", options.sizes, Integers(8, 8192), "Pixels a side, multiples of 8");
  AddList(app, "--schemes", options.schemes, scheme, "Combining schemes, separated by semicolons", ';');
  AddList(app, "--images", options.images, OneOf({"full", "sparse"}), "What the pictures fill");
  AddList(app, "--links", options.links, OneOf({"shared", "ipc", "tcp", "sealed"}), "How images travel; sealed: tcp, encrypted");
  AddChoice<ColorCoding, 3>(app, "--color", options.color, {"float32", "half", "fixed16"},
                            {ColorCoding::kFloat32, ColorCoding::kHalf, ColorCoding::kFixed16},
                            "Coding of colours that are sent: float32, half or fixed16");
  const auto compression = [](const std::string&, const std::string& text) -> Result<LinkCompression> {
    if (const auto parsed = ParseCompression(text)) return *parsed;
    return Status::InvalidArgument(fmt::format("--compress is '{}', but must be auto, on or off", text));
  };
  AddParsed(app, "--compress", options.compression, compression, "Whether images are packed: auto, on or off").TypeName("NAME");
  AddInteger(app, "--repeats", options.repeats, 1, 100000, "Frames of each scheme");
}

}  // namespace
}  // namespace slabstream

int main(int argc, char** argv) {
  return slabstream::BenchMain(argc, argv, "combining_bench", "Times combining among worker processes of this host", slabstream::AddOptions,
                               slabstream::Run);
}
