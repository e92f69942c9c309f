#include "tests/network/cluster.h"

#include <algorithm>
#include <chrono>
#include <iterator>
#include <limits>
#include <map>
#include <thread>
#include <utility>
#include <variant>

namespace slabstream {
namespace {

using std::chrono::milliseconds;

constexpr char kDataset[] = "ball";
// Less than the minute after which a frame without progress is handed out again.
constexpr std::chrono::seconds kFrameDeadline{45};
constexpr int kPictureSize = 512, kVolumeSize = 128, kGroups = 8;

bool IsHeard(const WorkerStatus& worker) { return worker.silent_ms < 2000; }

}  // namespace

std::vector<float> SamplesOf(const Picture& picture) {
  constexpr std::size_t kChannels = 5;
  std::vector<float> samples(kChannels * std::size_t(picture.size.width) * std::size_t(picture.size.height));
  for (std::size_t i = 4; i < samples.size(); i += kChannels) samples[i] = std::numeric_limits<float>::infinity();
  const LocalImage& image = *picture.image.floats();
  std::size_t from = 0;
  for (std::int32_t y = image.bounds.y_begin; y < image.bounds.y_end; ++y) {
    for (std::int32_t x = image.bounds.x_begin; x < image.bounds.x_end; ++x, ++from) {
      float* to = samples.data() + kChannels * (std::size_t(y) * std::size_t(picture.size.width) + std::size_t(x));
      std::copy_n(image.rgba.data() + 4 * from, 4, to);
      to[4] = image.depth[from];
    }
  }
  return samples;
}

void ClusterTest::MakeHosts(Hosts::Family family) {
  Result<Hosts> hosts = Hosts::Make(kFirstWorker + kWorkers, family);
  if (!hosts.ok()) GTEST_SKIP() << hosts.status().message();
  hosts_.emplace(*std::move(hosts));
}

void ClusterTest::StartCoordinator() {
  const std::string volume = MakeSphere("ball.nrrd", 1, kVolumeSize);
  coordinator_ = std::make_unique<RunningProgram>(
      hosts_->On(kCoordinator, {SLABSTREAM_COORDINATOR_PROGRAM, "--listen", "tcp://" + hosts_->AddressOf(kCoordinator) + ":*", "--keys",
                                Path("keys"), "--data", kDataset + ("=" + volume)}),
      directory_);
  ASSERT_TRUE(coordinator_->WaitForOutput("slabstream-coordinator ready"));
}

void ClusterTest::StartWorker(int host, const std::string& file) {
  workers_.push_back(std::make_unique<RunningProgram>(
      hosts_->On(host, {SLABSTREAM_WORKER_PROGRAM, "--no-shared-memory", "--threads", "1", "--service", KeyFile(file)}), directory_));
}

void ClusterTest::StartWorkers() {
  for (int i = 0; i < kWorkers; ++i) StartWorker(kFirstWorker + i);
}

std::unique_ptr<Client> ClusterTest::Connect(int host) {
  std::unique_ptr<Client> made;
  hosts_->Run(host, [&] {
    const Result<ServiceFile> file = ReadServiceFile(KeyFile("client.json"));
    ASSERT_TRUE(file.ok()) << file.status().message();
    Result<Client> client = Client::Connect(*contexts_.emplace_back(std::make_unique<Context>()), {file->endpoint, file->keys()});
    ASSERT_TRUE(client.ok()) << client.status().message();
    made = std::make_unique<Client>(*std::move(client));
  });
  return made;
}

void ClusterTest::BeginFrames() {
  client_ = Connect(kClient);
  other_client_ = Connect(kOtherClient);
  ASSERT_TRUE(client_ != nullptr && other_client_ != nullptr);
  WaitForWorkers(kWorkers);
  const Result<Picture> picture = client_->Render(Frames().front());
  ASSERT_TRUE(picture.ok()) << picture.status().message();
  undisturbed_ = SamplesOf(*picture);
  ASSERT_GT(std::ranges::count_if(undisturbed_, [](float sample) { return sample > 0; }), kPictureSize) << "an empty picture";
}

std::vector<FrameRequest> ClusterTest::Frames() {
  std::vector<FrameRequest> requests;
  for (const char* decomposition : {"slab", "octree", "kd-tree"}) {
    FrameRequest& request = requests.emplace_back();
    request.dataset = kDataset;
    request.renderer = "zbuffer";
    request.size = {kPictureSize, kPictureSize};
    request.policy.decomposition = decomposition;
    request.policy.groups = kGroups;
  }
  return requests;
}

std::vector<Result<Picture>> ClusterTest::Render(Client& client, const std::vector<FrameRequest>& requests,
                                                 const std::function<void()>& in_the_middle) {
  std::map<RequestId, std::size_t> open;
  std::vector<Result<Picture>> pictures;
  const auto submit = [&] {
    for (const FrameRequest& request : requests) {
      open[client.Submit(request, kFrameDeadline)] = pictures.size();
      pictures.push_back(Status::Internal("no end"));
    }
  };
  submit();
  bool called = !in_the_middle;
  while (!open.empty()) {
    std::optional<ClientEvent> event = client.Next(milliseconds(100));
    if (!event) continue;
    if (const auto* progress = std::get_if<FrameProgress>(&event->what)) {
      if (!called && progress->groups_done > 0) {
        called = true;
        in_the_middle();
        submit();  // all of the first ones may be over by now
      }
      continue;
    }
    auto* picture = std::get_if<Picture>(&event->what);
    if (picture != nullptr) {
      pictures[open.at(event->request)] = std::move(*picture);
    } else {
      pictures[open.at(event->request)] = std::get<Status>(event->what);
    }
    open.erase(event->request);
  }
  EXPECT_TRUE(called) << "the frames were over before they could be disturbed";
  return pictures;
}

void ClusterTest::ExpectUndisturbed(const std::vector<Result<Picture>>& pictures) const {
  for (const Result<Picture>& picture : pictures) {
    ASSERT_TRUE(picture.ok()) << picture.status().message();
    EXPECT_TRUE(SamplesOf(*picture) == undisturbed_) << "attempts: " << picture->statistics.attempts;
  }
}

std::uint32_t ClusterTest::RenderThrough(const std::function<void()>& disturb) {
  std::vector<Result<Picture>> of_other;
  std::jthread other([&] { of_other = Render(*other_client_, Frames(), {}); });
  std::vector<Result<Picture>> pictures = Render(*client_, Frames(), disturb);
  other.join();
  std::ranges::move(of_other, std::back_inserter(pictures));
  ExpectUndisturbed(pictures);
  std::uint32_t attempts = 0;
  for (const Result<Picture>& picture : pictures) {
    if (picture.ok()) attempts = std::max(attempts, picture->statistics.attempts);
  }
  return attempts;
}

void ClusterTest::WaitForStatus(Client& client, const std::string& expected, const std::function<bool(const StatusReply&)>& holds) {
  const Time deadline = MonotonicNow() + kProgramTimeout;
  std::string seen;
  while (MonotonicNow() < deadline) {
    const Result<StatusReply> status = client.QueryStatus();
    if (status.ok() && holds(*status)) return;
    seen = status.ok() ? std::to_string(status->workers.size()) + " workers" : status.status().message();
    (void)client.Next(milliseconds(20));
  }
  FAIL() << "expected " << expected << ", there are " << seen;
}

void ClusterTest::WaitForWorkers(int workers) {
  WaitForStatus(*client_, std::to_string(workers) + " workers", [&](const StatusReply& status) {
    return int(status.workers.size()) == workers && std::ranges::all_of(status.workers, IsHeard);
  });
}

void ClusterTest::WaitForSilence() {
  const std::unique_ptr<Client> client = Connect(kOtherClient);
  ASSERT_NE(client, nullptr);
  WaitForStatus(*client, "a worker that is not heard",
                [](const StatusReply& status) { return !std::ranges::all_of(status.workers, IsHeard); });
}

void ClusterTest::ExpectHealthy(int workers) {
  WaitForWorkers(workers);
  if (!HasFatalFailure()) ExpectUndisturbed(Render(*client_, Frames(), {}));
}

}  // namespace slabstream
