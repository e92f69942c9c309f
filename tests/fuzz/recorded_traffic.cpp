#include "tests/fuzz/recorded_traffic.h"

#include <array>
#include <chrono>
#include <optional>
#include <utility>

#include "common/base/check.h"
#include "common/volume/sphere.h"
#include "common/wire/any_message.h"
#include "coordinator/service/service.h"

namespace slabstream {
namespace {

// A client, or a worker, that writes down every header on its connection.
class RecordedPeer {
 public:
  RecordedPeer(Context& context, const std::string& endpoint, std::vector<std::vector<std::byte>>& headers)
      : socket_(Socket::Dealer(context).value()), headers_(headers) {
    CHECK(socket_.Connect(endpoint).ok());
  }

  void Send(MessageView message) {
    headers_.push_back(Encode(message));
    CHECK(socket_.Send({}, headers_.back()).ok());
  }
  // The next message of this kind; what comes before it is written down, too.
  template <class Message>
  Message Await() {
    const Time limit = MonotonicNow() + std::chrono::seconds(60);
    const std::array<Socket*, 1> sockets = {&socket_};
    while (MonotonicNow() < limit) {
      const std::optional<Incoming> incoming = socket_.TryReceive();
      if (!incoming) {
        Wait(sockets, nullptr, std::chrono::seconds(1));
        continue;
      }
      const std::span<const std::byte> header = incoming->header();
      headers_.emplace_back(header.begin(), header.end());
      const AnyMessage message = Decode(header).value();
      if (const auto* wanted = std::get_if<Message>(&message)) return *wanted;
    }
    CHECK(false) << "the message did not come";
    return {};
  }

 private:
  Socket socket_;
  std::vector<std::vector<std::byte>>& headers_;
};

}  // namespace

std::vector<std::vector<std::byte>> RecordedHeaders() {
  std::vector<std::vector<std::byte>> headers;
  Context context;
  CoordinatorOptions options;
  options.client_endpoint = "inproc://recorded";
  options.catalogue["ball"] = []() -> Result<std::shared_ptr<const Volume>> {
    return std::make_shared<const Volume>(MakeSphere({.sphere_class = SphereClass::kFilled, .size = 16, .occupancy = 0.3}).value());
  };
  const auto coordinator = CoordinatorService::Start(context, std::move(options)).value();

  RecordedPeer worker(context, coordinator->worker_endpoint(), headers), client(context, coordinator->client_endpoint(), headers);
  worker.Send(Register{.incarnation = 1, .host = "host", .images_endpoint = "inproc://recorded.images", .threads = 1});
  const auto welcome = worker.Await<Welcome>();
  worker.Send(Heartbeat{.epoch = welcome.epoch, .incarnation = 1, .worker = welcome.worker});
  worker.Await<Ping>();
  FrameRequest request;
  request.dataset = "ball";
  request.size = {32, 24};
  client.Send(SubmitFrame{.request = 1, .frame = request});
  const auto assignment = worker.Await<GroupAssignment>();

  RecordedPeer boxes(context, welcome.voxels_endpoint, headers);
  boxes.Send(ChunkRequest{
      .epoch = welcome.epoch, .worker = welcome.worker, .dataset = assignment.setup.dataset, .box = assignment.group.placements.at(0).box});
  boxes.Await<Chunk>();
  client.Send(ClientPing{.nonce = 2, .open = {1}});
  client.Await<ClientPong>();
  client.Send(StatusQuery{.nonce = 3});
  client.Await<StatusReply>();
  client.Send(SummaryQuery{.nonce = 5, .dataset = "ball", .transfer = {}});
  client.Await<SummaryReply>();
  client.Send(SampleQuery{.nonce = 6, .dataset = "ball", .points = {{1, 2, 3}}});
  client.Await<SampleReply>();
  client.Send(PickQuery{.nonce = 7, .frame = request, .x = 16, .y = 12});
  client.Await<PickReply>();
  client.Send(ViewQuery{.nonce = 12, .frame = request});
  client.Await<ViewReply>();
  AddVolume add{.nonce = 8, .name = "sent"};
  add.description.geometry.size = {2, 2, 2};
  client.Send(add);
  client.Await<VolumeCredit>();
  client.Send(DropVolume{.nonce = 8});
  client.Await<OrderRefused>();
  client.Send(CancelFrame{.request = 1});
  client.Await<FrameFailed>();
  worker.Send(Leave{welcome.epoch, welcome.worker});
  client.Send(ShutDown{.nonce = 4});
  client.Await<ShutDownReply>();
  return headers;
}

}  // namespace slabstream
