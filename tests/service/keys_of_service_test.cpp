// A service with keys: coordinator, workers and clients over encrypted tcp connections. Pictures are as ever; whoever has no key, another
// role's or a revoked one, is refused.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "client/client.h"
#include "common/planning/placement.h"
#include "common/service/service_file.h"
#include "common/wire/any_message.h"
#include "coordinator/service/service.h"
#include "data/volume_io/volume_writer.h"
#include "tests/service/next_picture.h"
#include "tests/service/pictures.h"
#include "tests/support/renderers.h"
#include "tests/support/temporary_directory.h"
#include "worker/service/picture_sockets.h"
#include "worker/service/service.h"

namespace slabstream {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::ElementsAre;
using testing::Field;
using testing::HasSubstr;

class KeysOfServiceTest : public testing::Test {
 protected:
  void SetUp() override { StartCoordinator(); }
  ~KeysOfServiceTest() override {
    workers_.clear();
    coordinator_.reset();
  }

  void StartCoordinator() {
    CoordinatorOptions options;
    options.client_endpoint = options.worker_endpoint = options.voxels_endpoint = "tcp://127.0.0.1:*";
    options.keys_folder = folder();
    options.catalogue["ball"] = [volume = volume_]() -> Result<std::shared_ptr<const Volume>> { return volume; };
    Result<std::unique_ptr<CoordinatorService>> started = CoordinatorService::Start(coordinator_context_, std::move(options));
    ASSERT_TRUE(started.ok()) << started.status().message();
    coordinator_ = *std::move(started);
  }
  // Workers of one process lend each other their images; here they must send them.
  void StartWorkers(int count) {
    const ServiceFile file = FileOf(Role::kWorker);
    for (int i = 0; i < count; ++i) {
      WorkerOptions options;
      options.coordinator_endpoint = file.endpoint;
      options.keys = file.keys();
      options.share_memory = false;
      workers_.push_back(WorkerService::Start(worker_contexts_[std::size_t(i)], std::move(options)).value());
    }
    for (const auto& worker : workers_) worker->WaitUntilRegistered();
  }

  std::string folder() const { return directory_ / "keys"; }
  ServiceFile FileOf(Role role) const { return ReadServiceFile(folder() + "/" + std::string(NameOf(role)) + ".json").value(); }
  Result<Client> ConnectWith(const ServiceFile& file, Duration timeout = seconds(30)) {
    return Client::Connect(client_context_, {coordinator_->client_endpoint(), file.keys()}, timeout);
  }
  Client ConnectAs(Role role) { return ConnectWith(FileOf(role)).value(); }

  TemporaryDirectory directory_{"/tmp"};
  const std::shared_ptr<const Volume> volume_ = TestSphere(48);
  Context coordinator_context_, client_context_;
  std::array<Context, 3> worker_contexts_;
  std::unique_ptr<CoordinatorService> coordinator_;
  std::vector<std::unique_ptr<WorkerService>> workers_;
};

TEST_F(KeysOfServiceTest, PicturesAreThoseOfOneRenderer) {
  StartWorkers(3);
  Client client = ConnectAs(Role::kClient);
  for (const RendererKind* renderer : {Splatting(), ZBuffer()}) {
    for (const char* combine : {"fan-in", "radix-k", "direct-send"}) {
      FrameRequest request = TestRequest(renderer, 30);
      request.policy.combine = combine;
      const Result<Picture> picture = client.Render(request);
      ASSERT_TRUE(picture.ok()) << picture.status().message();
      EXPECT_LE(LargestDifference(picture->image, RenderDirectly(request, *volume_), request.size), AllowedDifference(request));
      EXPECT_EQ(picture->statistics.attempts, 1U);
    }
  }
}

TEST_F(KeysOfServiceTest, PicturesGoStraightToClientsAndAreTheSame) {
  StartWorkers(2);
  ServiceAddress relayed_address(coordinator_->client_endpoint(), FileOf(Role::kClient).keys());
  relayed_address.direct_pictures = false;
  Client direct = ConnectAs(Role::kClient), relayed = Client::Connect(client_context_, relayed_address, seconds(30)).value();
  FrameRequest request = TestRequest(Splatting(), 30, 3);
  // Each worker makes pictures in turn; until it has a connection to the client, they come through the coordinator.
  int in_a_row = 0;
  for (const Time end = MonotonicNow() + seconds(60); in_a_row < 4 && MonotonicNow() < end;) {
    const Result<Picture> picture = direct.Render(request);
    ASSERT_TRUE(picture.ok()) << picture.status().message();
    in_a_row = picture->direct ? in_a_row + 1 : 0;
  }
  ASSERT_EQ(in_a_row, 4);
  const Result<Picture> other = relayed.Render(request);
  ASSERT_TRUE(other.ok()) << other.status().message();
  EXPECT_FALSE(other->direct);

  request.previews = true;
  direct.Submit(request);
  int pictures = 0;
  for (bool final = false; !final;) {
    const std::optional<AnsweredRequest> answered = NextPicture(direct);
    ASSERT_TRUE(answered.has_value());
    ++pictures;
    final = answered->picture.final;
    EXPECT_TRUE(answered->picture.direct);
    if (final) {
      EXPECT_EQ(LargestDifference(answered->picture.image, other->image, request.size), 0);
    }
  }
  EXPECT_GE(pictures, 2) << "a preview at least";
}

// Every worker finishes a share. Until it has a connection to the client, its share comes through the coordinator.
TEST_F(KeysOfServiceTest, SharesOfPicturesAddUpToThoseOfOneRenderer) {
  constexpr int kWorkers = 3;
  StartWorkers(kWorkers);
  Client client = ConnectAs(Role::kClient);
  int direct = 0, divided = 0;
  for (const RendererKind* renderer : {Splatting(), ZBuffer(), FindRenderer("raycast")}) {
    for (const char* combine : {"fan-in", "centralized", "radix-k", "direct-send", "chain"}) {
      for (const bool minified : {false, true}) {
        FrameRequest request = TestRequest(renderer, 30, 1);
        request.size = {640, 600};
        request.policy.combine = combine;
        if (minified) request.view.zoom = 0.04;
        SCOPED_TRACE(testing::Message() << renderer->name() << ", " << combine << (minified ? ", minified" : ""));
        const Result<Picture> picture = client.Render(request);
        ASSERT_TRUE(picture.ok()) << picture.status().message();
        EXPECT_LE(LargestDifference(picture->image, RenderDirectly(request, *volume_), request.size), AllowedDifference(request));
        const std::int64_t most = picture->statistics.grid.pixel_count() / std::int64_t(kSharePixels);
        const bool swaps = combine == std::string("radix-k") || combine == std::string("direct-send");
        const bool finishes = minified || renderer == Splatting();
        const bool divides = (swaps || finishes) && !(minified && renderer == ZBuffer());  // means of depths do not add up
        const std::int64_t shares = divides ? std::clamp<std::int64_t>(most, 1, kWorkers) : 1;
        EXPECT_EQ(std::int64_t(picture->statistics.reports.size()), kWorkers + shares) << "boxes and shares";
        request.straight8 = true;  // shares that are resampled come as floats all the same
        const Result<Picture> codes = client.Render(request);
        ASSERT_TRUE(codes.ok()) << codes.status().message();
        LocalImage colors = *picture->image.floats();
        colors.format = PixelFormat::kRgba;
        colors.depth.clear();
        EXPECT_LE(LargestDifference(codes->image, colors, request.size), 1.01F / 255);
        divided += shares > 1 ? 1 : 0;
        direct += picture->direct ? 1 : 0;
      }
    }
  }
  EXPECT_GT(direct, 0);
  EXPECT_GE(divided, 9);
}

TEST_F(KeysOfServiceTest, PicturesComeThroughTheCoordinatorIfNobodyListensAtTheDoor) {
  StartWorkers(1);
  SocketOptions options;
  options.client_keys = FileOf(Role::kClient).keys();
  Socket client = Socket::Dealer(client_context_, options).value();
  ASSERT_TRUE(client.Connect(coordinator_->client_endpoint()).ok());
  const SubmitFrame submit{.request = 1, .frame = TestRequest(Splatting(), 30), .pictures = PicturesDoor{9, MakeKeyPair().public_key}};
  ASSERT_TRUE(client.Send({}, Encode(submit)).ok());
  const std::array<Socket*, 1> sockets = {&client};
  for (const Time end = MonotonicNow() + seconds(60); MonotonicNow() < end; Wait(sockets, nullptr, end - MonotonicNow())) {
    const std::optional<Incoming> incoming = client.TryReceive();
    if (!incoming) continue;
    const Result<CoordinatorToClient> message = Decode<CoordinatorToClient>(incoming->header(), incoming->payload().size());
    ASSERT_TRUE(message.ok()) << message.status().message();
    const auto* reply = std::get_if<FrameReply>(&*message);
    if (reply == nullptr) continue;
    EXPECT_THAT(reply->shares, ElementsAre(Field(&PictureShare::direct, false)));
    EXPECT_FALSE(incoming->payload().empty());
    return;
  }
  FAIL() << "no picture";
}

TEST(PictureSockets, AClientThatNamesManyKeysTakesFewSockets) {
  Context context;
  PictureSockets sockets(context, MakeKeyPair(), 1);
  const Time now = MonotonicNow();
  for (std::size_t i = 0; i < PictureSockets::kMostConnections + 10; ++i) {
    sockets.Prepare({"tcp://127.0.0.1:9", MakeKeyPair().public_key}, now);
  }
  EXPECT_EQ(sockets.size(), PictureSockets::kMostConnections);
  sockets.CloseIdle(now + seconds(3600));
  EXPECT_EQ(sockets.size(), 0U);
}

TEST_F(KeysOfServiceTest, WhoeverHasNoKeyOfTheRoleIsRefused) {
  // At once, long before the time-out: without a key, with that of a stranger, and with a worker's.
  const Status without = Client::Connect(client_context_, coordinator_->client_endpoint(), seconds(60)).status();
  EXPECT_EQ(without.code(), StatusCode::kInvalidArgument);
  EXPECT_THAT(without.message(), HasSubstr("has keys: name its service file"));
  ServiceFile stranger = FileOf(Role::kClient);
  stranger.own = MakeKeyPair();
  for (const ServiceFile& file : {stranger, FileOf(Role::kWorker)}) {
    const Status status = ConnectWith(file, seconds(2)).status();
    EXPECT_EQ(status.code(), StatusCode::kUnavailable);
    EXPECT_THAT(status.message(), HasSubstr("refuses the key"));
  }
  ServiceFile deceived = FileOf(Role::kClient);
  deceived.server_key = MakeKeyPair().public_key;
  EXPECT_FALSE(ConnectWith(deceived, milliseconds(500)).ok());
  EXPECT_TRUE(ConnectWith(FileOf(Role::kClient)).ok());
}

TEST_F(KeysOfServiceTest, OnlyAdminsEndTheServiceAndChangeKeys) {
  Client client = ConnectAs(Role::kClient);
  EXPECT_THAT(client.ShutDownService().message(), HasSubstr("needs the service file of role admin, not client"));
  EXPECT_THAT(client.OrderKeys({}).status().message(), HasSubstr("need the service file of role admin, not client"));
  EXPECT_TRUE(client.QueryStatus().ok());
  Client admin = ConnectAs(Role::kAdmin);
  const Result<std::vector<AdmittedKey>> keys = admin.OrderKeys({});
  ASSERT_TRUE(keys.ok()) << keys.status().message();
  EXPECT_EQ(keys->size(), kRoles.size());
  EXPECT_EQ(admin.OrderKeys({.action = KeysAction::kRevoke, .key = "nobody's"}).status().code(), StatusCode::kNotFound);
  EXPECT_TRUE(admin.ShutDownService().ok());
  coordinator_->WaitUntilStopped();
}

TEST_F(KeysOfServiceTest, EveryClientListsDatasetsAndOnlyAdminsChangeThem) {
  Client client = ConnectAs(Role::kClient), admin = ConnectAs(Role::kAdmin);
  for (Client* either : {&client, &admin}) {
    const Result<std::vector<DatasetStatus>> list = either->OrderData({});
    ASSERT_TRUE(list.ok()) << list.status().message();
    EXPECT_EQ(list->size(), 1U);
  }
  const std::string file = directory_ / "more.nrrd";
  ASSERT_TRUE(WriteVolume(*volume_, file).ok());
  const DataOrder orders[] = {{.action = DataAction::kAdd, .items = {"more=" + file}},
                              {.action = DataAction::kAdd, .items = {directory_.path()}},
                              {.action = DataAction::kReload, .items = {"ball"}},
                              {.action = DataAction::kRemove, .items = {"ball"}}};
  for (const DataOrder& order : orders) {
    const Status refused = client.OrderData(order).status();
    EXPECT_EQ(refused.code(), StatusCode::kInvalidArgument);
    EXPECT_THAT(refused.message(), HasSubstr("needs the service file of role admin, not client"));
    EXPECT_EQ(client.OrderData({})->size(), 1U) << "nothing has changed";
  }
  EXPECT_THAT(client.Steer({.dataset = "ball"}).status().message(), HasSubstr("no simulation holds it")) << "any client may steer one";
  EXPECT_EQ(admin.OrderData(orders[0])->size(), 2U);
  EXPECT_EQ(admin.OrderData(orders[2])->size(), 2U);
  EXPECT_EQ(admin.OrderData(orders[3])->size(), 1U);
  EXPECT_EQ(client.OrderData({})->front().name, "more");
}

TEST_F(KeysOfServiceTest, ARevokedKeyIsRefusedAndItsConnectionsEnd) {
  StartWorkers(1);
  const ServiceFile old_file = FileOf(Role::kClient);
  Client old_client = ConnectWith(old_file).value(), admin = ConnectAs(Role::kAdmin);
  ASSERT_TRUE(old_client.Render(TestRequest(Splatting(), 0)).ok());
  ASSERT_TRUE(admin.OrderKeys({.action = KeysAction::kRotate, .role = Role::kClient}).ok());
  EXPECT_TRUE(old_client.Render(TestRequest(Splatting(), 10)).ok()) << "the old key holds until it is revoked";
  const Result<std::vector<AdmittedKey>> keys = admin.OrderKeys({.action = KeysAction::kRevoke, .key = old_file.own.public_key});
  ASSERT_TRUE(keys.ok());
  EXPECT_EQ(keys->size(), kRoles.size());
  EXPECT_FALSE(old_client.QueryStatus(seconds(2)).ok());
  EXPECT_THAT(ConnectWith(old_file, seconds(2)).status().message(), HasSubstr("refuses the key"));
  Client new_client = ConnectAs(Role::kClient);
  EXPECT_TRUE(new_client.Render(TestRequest(Splatting(), 20)).ok());
}

TEST_F(KeysOfServiceTest, AKeyOfAPersonIsAdmittedAtOnceAndRevokedAlone) {
  Client admin = ConnectAs(Role::kAdmin), other = ConnectAs(Role::kClient);
  ServiceFile annas = FileOf(Role::kClient);
  annas.own = MakeKeyPair();
  const KeysOrder issue{.action = KeysAction::kIssue, .role = Role::kClient, .key = annas.own.public_key, .name = "anna"};
  EXPECT_EQ(other.OrderKeys(issue).status().code(), StatusCode::kInvalidArgument);
  Result<std::vector<AdmittedKey>> keys = admin.OrderKeys(issue);
  ASSERT_TRUE(keys.ok()) << keys.status().message();
  EXPECT_EQ(keys->back().name, "anna");
  EXPECT_FALSE(keys->back().silent_ms) << "nobody has come with it";
  Client anna = ConnectWith(annas).value();
  ASSERT_TRUE(anna.QueryStatus().ok());
  keys = admin.OrderKeys({});
  ASSERT_TRUE(keys.ok());
  EXPECT_TRUE(keys->back().silent_ms);
  ASSERT_TRUE(admin.OrderKeys({.action = KeysAction::kRevoke, .key = "anna"}).ok());
  EXPECT_FALSE(anna.QueryStatus(seconds(2)).ok());
  EXPECT_TRUE(other.QueryStatus().ok());
}

TEST_F(KeysOfServiceTest, AWorkerWhoseKeyIsRevokedIsLostAndEnds) {
  StartWorkers(2);
  Client admin = ConnectAs(Role::kAdmin);
  ASSERT_TRUE(admin.Render(TestRequest(Splatting(), 0)).ok());
  ASSERT_TRUE(admin.OrderKeys({.action = KeysAction::kRevoke, .key = FileOf(Role::kWorker).own.public_key}).ok());
  const Time limit = MonotonicNow() + seconds(60);
  while (!admin.QueryStatus()->workers.empty() && MonotonicNow() < limit) {
  }
  EXPECT_TRUE(admin.QueryStatus()->workers.empty());
  for (const auto& worker : workers_) {
    worker->WaitUntilStopped();
    EXPECT_THAT(worker->ended().message(), HasSubstr("refuses the key: it was revoked"));
  }
}

TEST_F(KeysOfServiceTest, AWorkerThatIsToldToEndHasNothingToSay) {
  StartWorkers(1);
  workers_[0]->RequestStop();
  workers_[0]->WaitUntilStopped();
  EXPECT_TRUE(workers_[0]->ended().ok()) << workers_[0]->ended().message();
}

TEST_F(KeysOfServiceTest, KeysOutliveTheCoordinator) {
  const ServiceFile before = FileOf(Role::kClient);
  coordinator_.reset();
  StartCoordinator();
  EXPECT_EQ(FileOf(Role::kClient).own, before.own);
  EXPECT_NE(FileOf(Role::kClient).epoch, before.epoch);
  EXPECT_TRUE(ConnectWith(before).ok());
}

}  // namespace
}  // namespace slabstream
