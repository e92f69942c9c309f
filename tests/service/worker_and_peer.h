// A worker and what it talks to: the test plays its coordinator and its peer.
#pragma once

#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "common/wire/payload.h"
#include "tests/support/random_image.h"
#include "tests/support/renderers.h"
#include "worker/service/service.h"

namespace slabstream {

inline constexpr Epoch kEpoch = 9;
inline constexpr WorkerId kWorker = 1, kPeer = 2;
inline constexpr std::int32_t kSide = 200;

inline LocalImage Picture(std::uint64_t seed) {
  Random random(seed);
  return RandomImage(random, PixelFormat::kRgba, {0, 0, kSide, kSide});
}

// The worker's part of every frame.
class FixedPicture : public Renderer {
 public:
  Result<LocalImage> Render(BoxData&, const LevelBox&, const FrameSetup&, const OcclusionMask&, const RenderControl&,
                            RankReport&) override {
    return Picture(1);
  }
};

class WorkerAndPeer : public testing::Test {
 protected:
  // The images planes are at `images_endpoint`: inproc for whom the workers' memory matters, a wildcard port for whom the link does.
  explicit WorkerAndPeer(WorkerOptions options = {}, const std::string& images_endpoint = "inproc://images")
      : control_(*Socket::Router(context_)),
        voxels_(*Socket::Router(context_)),
        images_(*Socket::Router(context_)),
        to_worker_(*Socket::Dealer(context_)) {
    const bool inproc = images_endpoint.starts_with("inproc");
    CHECK(control_.Bind("inproc://control").ok() && voxels_.Bind("inproc://voxels").ok());
    peer_images_ = images_.Bind(inproc ? images_endpoint + ".peer" : images_endpoint).value();
    options.coordinator_endpoint = "inproc://control";
    options.images_endpoint = inproc ? images_endpoint + ".worker" : images_endpoint;
    options.make_renderer = [](const RendererKind&) { return std::make_unique<FixedPicture>(); };
    worker_ = WorkerService::Start(context_, std::move(options)).value();
    const auto hello = Await<Register>();
    memory_scope_ = peer_scope_ = hello.memory_scope;
    worker_images_ = hello.images_endpoint;
    CHECK(to_worker_.Connect(worker_images_).ok());
    SendControl(Welcome{kEpoch, hello.incarnation, kWorker, "inproc://voxels", 1000, 60000});
  }

  void SendControl(MessageView message) { ASSERT_TRUE(control_.Send(identity_, Encode(message)).ok()); }
  void SendToWorker(MessageView message, const Bytes& payload = {}) { ASSERT_TRUE(to_worker_.Send({}, Encode(message), payload).ok()); }

  // The next message of one of these kinds that the worker sends anywhere; chunks are handed out meanwhile.
  template <class... Messages>
  AnyMessage AwaitEither() {
    const Time deadline = MonotonicNow() + std::chrono::seconds(30);
    while (MonotonicNow() < deadline) {
      Socket* const sockets[] = {&control_, &voxels_, &images_};
      Wait(sockets, nullptr, std::chrono::seconds(1));
      for (Socket* socket : sockets) {
        while (auto incoming = socket->TryReceive()) {
          const AnyMessage message = Decode(incoming->header()).value();
          if (socket == &control_) identity_ = incoming->identity;
          if (const auto* request = std::get_if<ChunkRequest>(&message)) Serve(incoming->identity, *request);
          payload_ = incoming->payload();
          if ((std::holds_alternative<Messages>(message) || ...)) return message;
        }
      }
    }
    CHECK(false) << "the message did not come";
    return {};
  }
  template <class Message>
  Message Await() {
    return std::get<Message>(AwaitEither<Message>());
  }

  // Zeros, unless `voxels_of_` has the whole dataset, of one chunk.
  void Serve(const std::string& identity, const ChunkRequest& request) {
    Chunk chunk = {.epoch = kEpoch, .dataset = request.dataset, .box = request.box, .chunk = request.chunk};
    const auto known = voxels_of_.find(request.dataset);
    std::vector<std::byte> voxels =
        known == voxels_of_.end() ? std::vector<std::byte>(std::size_t(request.box.voxel_count())) : known->second;
    const Bytes payload = PackChunk(Bytes(std::move(voxels)), Codec::kRaw, chunk);
    ASSERT_TRUE(voxels_.Send(identity, Encode(chunk), payload).ok());
  }

  // Rank 0, the root, is `root`; both ranks render everything.
  GroupAssignment Assignment(FrameId frame, WorkerId root) {
    GroupAssignment assignment;
    assignment.epoch = kEpoch;
    assignment.key = {frame, 0, 0};
    assignment.finished_before = frame;
    assignment.group_count = 2;
    FrameSetup& setup = assignment.setup;
    SetRenderer(*Splatting(), setup);
    setup.dataset = 1;
    setup.description.geometry.size = {8, 8, 32};
    setup.range = {0, 1};
    setup.camera = MakeCamera({}, {kSide, kSide}, setup.description.geometry);
    setup.sheets = MakeSheetGrid(setup.camera, setup.description.geometry);
    setup.sheets.width = setup.sheets.height = kSide;
    setup.transfer.colors = {{0, {1, 1, 1}}};
    setup.transfer.opacities = {{0, 1, 0.5, 0}};
    setup.termination = 0;
    assignment.group.placements = {{0, {{0, 0, 0}, {8, 8, 16}}, root}, {1, {{0, 0, 16}, {8, 8, 32}}, kWorker + kPeer - root}};
    assignment.group.schedule = {"fan-in", 2, {0}};
    assignment.display = root;
    assignment.peers = {{kWorker, worker_images_, memory_scope_}, {kPeer, peer_images_, peer_scope_}};
    return assignment;
  }

  Context context_;
  Socket control_, voxels_, images_, to_worker_;
  std::unique_ptr<WorkerService> worker_;
  std::string identity_;  // the identity of the worker's control connection
  std::string worker_images_, peer_images_;
  std::uint64_t memory_scope_ = 0;  // the worker's
  std::uint64_t peer_scope_ = 0;    // the same, unless a test makes it another host's
  Bytes payload_;                   // the payload of the message that Await returned
  std::map<DatasetId, std::vector<std::byte>> voxels_of_;
};

}  // namespace slabstream
