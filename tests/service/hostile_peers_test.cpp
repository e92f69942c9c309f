// Garbage on every plane of a running service: it is dropped, and the next picture is right.
#include <gtest/gtest.h>

#include "client/client.h"
#include "coordinator/service.h"
#include "tests/service/pictures.h"
#include "tests/support/random.h"
#include "tests/support/renderers.h"
#include "worker/service.h"

namespace slabstream {
namespace {

using std::chrono::seconds;

// Messages of every plane that are well formed and refer to nothing that exists.
std::vector<AnyMessage> StrayMessages() {
  return {Heartbeat{.epoch = 5, .incarnation = 6, .worker = 7},
          GroupDone{.epoch = 5, .worker = 7, .key = {1, 1, 0}},
          WorkerTrouble{.epoch = 5, .worker = 7, .key = {1, 1, 0}, .status = Status::Internal("stray")},
          Leave{.epoch = 5, .worker = 7},
          Ping{.epoch = 5, .finished_before = 1000},
          Retire{.epoch = 5},
          ChunkRequest{.epoch = 5, .worker = 7, .dataset = 1, .box = {{0, 0, 0}, {1, 1, 1}}},
          CancelFrame{.request = 99},
          ClientPing{.nonce = 3, .open = {1, 2, 3}},
          StatusQuery{.nonce = 4},
          FrameFailed{.request = 1, .status = Status::Internal("stray")}};
}

TEST(HostilePeers, GarbageIsDroppedOnEveryPlane) {
  Random random(21);
  SCOPED_TRACE(random.trace());
  Context context;
  const std::shared_ptr<const Volume> volume = TestSphere(32);
  CoordinatorOptions options;
  options.client_endpoint = "inproc://hostile";
  options.worker_endpoint = "inproc://hostile.workers";
  options.slabs_endpoint = "inproc://hostile.slabs";
  options.catalogue["ball"] = [volume]() -> Result<std::shared_ptr<const Volume>> { return volume; };
  const auto coordinator = CoordinatorService::Start(context, std::move(options)).value();
  const auto first = WorkerService::Start(context, {"inproc://hostile.workers", "inproc://hostile.images-1", {}}).value();
  const auto second = WorkerService::Start(context, {"inproc://hostile.workers", "inproc://hostile.images-2", {}}).value();

  std::vector<Socket> attackers;
  for (const char* endpoint : {"inproc://hostile", "inproc://hostile.workers", "inproc://hostile.slabs", "inproc://hostile.images-1",
                               "inproc://hostile.images-2"}) {
    attackers.push_back(Socket::Dealer(context).value());
    ASSERT_TRUE(attackers.back().Connect(endpoint).ok());
  }
  const std::vector<AnyMessage> strays = StrayMessages();
  Client client = Client::Connect(context, coordinator->client_endpoint()).value();
  for (int round = 0; round < 5; ++round) {
    for (Socket& attacker : attackers) {
      for (int i = 0; i < 100; ++i) {
        std::vector<std::byte> header;
        const int kind = random.Integer(0, 2);
        if (kind == 0) {
          header.resize(random.Integer<std::size_t>(1, 300));
          for (std::byte& byte : header) byte = std::byte(random.Integer(0, 255));
        } else {
          header = Encode(strays[random.Integer<std::size_t>(0, strays.size() - 1)]);
          if (kind == 1) header[random.Integer<std::size_t>(0, header.size() - 1)] = std::byte(random.Integer(0, 255));
        }
        const Bytes payload = random.Chance(0.3) ? Bytes(std::vector<std::byte>(random.Integer<std::size_t>(1, 100))) : Bytes();
        (void)attacker.Send({}, std::move(header), payload);
      }
      while (attacker.TryReceive()) {
      }
    }
    const FrameRequest request = TestRequest(Splatting(), 70 * round);
    const Result<Picture> picture = client.Render(request, seconds(60));
    ASSERT_TRUE(picture.ok()) << picture.status().message();
    EXPECT_LE(LargestDifference(picture->image, RenderDirectly(request, *volume), request.size), AllowedDifference(request));
  }
  EXPECT_EQ(client.QueryStatus().value().workers_lost, 0U) << "nobody but the coordinator may send a worker away";
}

TEST(HostilePeers, EndpointsAreChecked) {
  Context context;
  CoordinatorOptions options;
  options.client_endpoint = "tcp://192.168.1.2:7420";
  EXPECT_EQ(CoordinatorService::Start(context, options).status().code(), StatusCode::kInvalidArgument);
  options.client_endpoint = "inproc://checked";
  options.worker_endpoint = "nowhere";
  EXPECT_EQ(CoordinatorService::Start(context, options).status().code(), StatusCode::kInvalidArgument);
  options.worker_endpoint.clear();
  const auto coordinator = CoordinatorService::Start(context, options);
  ASSERT_TRUE(coordinator.ok()) << coordinator.status().message();
  EXPECT_EQ(CoordinatorService::Start(context, options).status().code(), StatusCode::kUnavailable) << "the endpoint is taken";
  EXPECT_EQ(WorkerService::Start(context, {"tcp://127.0.0.1:*", {}, {}}).status().code(), StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace slabstream
