// Garbage on every plane of a running service: it is dropped, memory stays, and a client beside it gets the right pictures.
#include <gtest/gtest.h>
#include <malloc.h>

#include <array>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>
#include <zmq.hpp>

#include "client/client.h"
#include "common/service/service_file.h"
#include "coordinator/service/service.h"
#include "tests/common/wire/samples.h"
#include "tests/service/pictures.h"
#include "tests/support/random.h"
#include "tests/support/raw_peer.h"
#include "tests/support/renderers.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/text_of.h"
#include "worker/service/service.h"

namespace slabstream {
namespace {

using std::chrono::seconds;

#ifdef __SANITIZE_ADDRESS__
constexpr bool kMemoryIsMeasured = false;  // the sanitizer keeps what was freed
#else
constexpr bool kMemoryIsMeasured = true;
#endif

std::int64_t ResidentBytes() {
  std::ifstream statm("/proc/self/statm");
  std::int64_t all = 0, resident = 0;
  statm >> all >> resident;
  return resident * ::sysconf(_SC_PAGESIZE);
}

// A socket that listens and what it is for.
template <class Messages>
bool Takes(const AnyMessage& message) {
  return Decode<Messages>(Encode(message), ExpectedPayloadBytes(message)).ok();
}

struct Port {
  std::string endpoint;
  bool (*takes)(const AnyMessage& message);
  std::optional<ClientKeys> keys;  // the best that an attacker may have
  bool admits = true;              // whether they are enough to get as far as messages
};

class HostilePeers : public testing::TestWithParam<bool> {
 protected:
  bool has_keys() const { return GetParam(); }

  void SetUp() override {
    CoordinatorOptions options;
    options.client_endpoint = options.worker_endpoint = options.voxels_endpoint = "tcp://127.0.0.1:*";
    if (has_keys()) options.keys_folder = directory_ / "keys";
    options.catalogue["ball"] = [volume = volume_]() -> Result<std::shared_ptr<const Volume>> { return volume; };
    coordinator_ = CoordinatorService::Start(coordinator_context_, std::move(options)).value();
    const Welcome welcome = RegisterAndLeave();
    epoch_ = welcome.epoch;
    for (std::size_t i = 0; i < workers_.size(); ++i) {
      WorkerOptions worker;
      worker.coordinator_endpoint = coordinator_->worker_endpoint();
      worker.images_endpoint = "tcp://127.0.0.1:*";
      worker.share_memory = false;  // images pass through the sockets
      worker.keys = KeysOf(Role::kWorker);
      workers_[i] = WorkerService::Start(worker_contexts_[i], std::move(worker)).value();
    }
    for (const auto& worker : workers_) worker->WaitUntilRegistered();

    ports_ = {{coordinator_->client_endpoint(), Takes<ClientToCoordinator>, KeysOf(Role::kClient)},
              {coordinator_->worker_endpoint(), Takes<WorkerToCoordinator>, KeysOf(Role::kWorker)},
              {welcome.voxels_endpoint, Takes<WorkerToVoxels>, KeysOf(Role::kWorker)}};
    // The keys of images planes are known to the workers of a group alone.
    for (const auto& worker : workers_)
      ports_.push_back({worker->images_endpoint(), Takes<WorkerToWorker>, KeysOf(Role::kWorker), !has_keys()});
    client_.emplace(Client::Connect(client_context_, {coordinator_->client_endpoint(), KeysOf(Role::kClient)}, seconds(30)).value());
    ASSERT_EQ(client_->QueryStatus()->workers.size(), workers_.size());
  }

  std::optional<ClientKeys> KeysOf(Role role) const {
    if (!has_keys()) return std::nullopt;
    return ReadServiceFile(directory_ / "keys/" + std::string(NameOf(role)) + ".json")->keys();
  }

  // What a worker learns.
  Welcome RegisterAndLeave() {
    Socket worker = Socket::Dealer(client_context_, {.client_keys = KeysOf(Role::kWorker)}).value();
    CHECK(worker.Connect(coordinator_->worker_endpoint()).ok());
    const Register hello{.incarnation = 77, .host = "somewhere", .images_endpoint = "tcp://127.0.0.1:1", .threads = 1};
    CHECK(worker.Send({}, Encode(hello)).ok());
    const std::array<Socket*, 1> sockets = {&worker};
    Wait(sockets, nullptr, seconds(30));
    const auto welcome = std::get<Welcome>(Decode(worker.TryReceive().value().header()).value());
    CHECK(worker.Send({}, Encode(Leave{welcome.epoch, welcome.worker})).ok());
    return welcome;
  }

  // A dealer of a context that has nothing to do with the service's.
  zmq::socket_t Dealer(const Port& port) {
    zmq::socket_t dealer(attackers_, zmq::socket_type::dealer);
    // Where it is admitted, it waits until what it sends is on its way.
    constexpr int kPatience = 30'000;
    dealer.set(zmq::sockopt::linger, port.admits ? kPatience : 0);
    dealer.set(zmq::sockopt::sndtimeo, port.admits ? kPatience : 0);
    dealer.set(zmq::sockopt::sndhwm, 1);
    if (port.keys) {
      dealer.set(zmq::sockopt::curve_serverkey, port.keys->server_key);
      dealer.set(zmq::sockopt::curve_publickey, port.keys->own.public_key);
      dealer.set(zmq::sockopt::curve_secretkey, port.keys->own.secret_key);
    }
    dealer.connect(port.endpoint);
    return dealer;
  }

  // Renders while `attack` runs, and expects the picture that there would be without it.
  template <class Attack>
  void ExpectPictureDuring(int azimuth, Attack&& attack) {
    const FrameRequest request = TestRequest(azimuth % 20 == 0 ? Splatting() : ZBuffer(), azimuth);
    const RequestId id = client_->Submit(request, seconds(120));
    {
      const std::jthread attacker(attack);
      ExpectPicture(request, id);
    }
    // What came last may still lie in the sockets.
    ExpectPicture(request, client_->Submit(request, seconds(120)));
  }
  void ExpectPicture(const FrameRequest& request, RequestId id) {
    const Time limit = MonotonicNow() + seconds(120);
    while (MonotonicNow() < limit) {
      const std::optional<ClientEvent> event = client_->Next(seconds(1));
      if (!event || event->request != id || std::holds_alternative<FrameProgress>(event->what)) continue;
      const auto* picture = std::get_if<slabstream::Picture>(&event->what);
      ASSERT_NE(picture, nullptr) << std::get<Status>(event->what).message();
      EXPECT_LE(LargestDifference(picture->image, RenderDirectly(request, *volume_), request.size), AllowedDifference(request));
      EXPECT_EQ(picture->statistics.attempts, 1U) << "nobody but the coordinator may end a part of a frame";
      return;
    }
    FAIL() << "no picture";
  }
  // Once the services have read what still lies in their sockets.
  void ExpectMemoryBelow(std::int64_t limit) {
    const Time deadline = MonotonicNow() + seconds(30);
    do {
      (void)client_->Next(std::chrono::milliseconds(20));
      (void)::malloc_trim(0);
    } while (ResidentBytes() > limit && MonotonicNow() < deadline);
    EXPECT_LE(ResidentBytes(), limit);
  }
  void ExpectNobodyLost() {
    const Result<StatusReply> status = client_->QueryStatus();
    ASSERT_TRUE(status.ok()) << status.status().message();
    EXPECT_EQ(status->workers_lost, 0U);
    EXPECT_EQ(status->workers.size(), workers_.size());
  }

  const TemporaryDirectory directory_{"/tmp"};
  const std::shared_ptr<const Volume> volume_ = TestSphere(32);
  Context coordinator_context_, client_context_;
  std::array<Context, 2> worker_contexts_;
  zmq::context_t attackers_;
  std::unique_ptr<CoordinatorService> coordinator_;
  std::array<std::unique_ptr<WorkerService>, 2> workers_;
  std::vector<Port> ports_;
  Epoch epoch_ = 0;
  std::optional<Client> client_;
};

INSTANTIATE_TEST_SUITE_P(Transports, HostilePeers, testing::Bool(),
                         [](const auto& with_keys) { return with_keys.param ? "Keys" : "Loopback"; });

void SendParts(zmq::socket_t& socket, const std::vector<std::string>& parts) {
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const zmq::send_flags more = i + 1 < parts.size() ? zmq::send_flags::sndmore : zmq::send_flags::none;
    if (!socket.send(zmq::buffer(parts[i]), more)) return;  // not admitted: nothing leaves
  }
}

std::string Noise(Random& random, std::size_t most) {
  std::string noise(random.Integer<std::size_t>(0, most), '\0');
  for (char& c : noise) c = char(random.Integer(0, 255));
  return noise;
}

// On loopback everybody may be a worker, and end the service.
bool IsHeeded(const std::string& header) {
  const Result<AnyMessage> message = Decode(std::as_bytes(std::span(header)));
  return message.ok() && (std::holds_alternative<Register>(*message) || std::holds_alternative<ShutDown>(*message));
}

// A message, perhaps changed on its way, in frames that may be wrong, or bytes that are none.
std::vector<std::string> Garbage(const std::vector<AnyMessage>& messages, Random& random) {
  std::string header = TextOf(Encode(messages[random.Integer<std::size_t>(0, messages.size() - 1)]));
  const auto place = [&] { return random.Integer<std::size_t>(0, header.size() - 1); };
  switch (random.Integer(0, 4)) {
    case 0: return {Noise(random, 300)};
    case 1: header.resize(place()); break;
    case 2: header[place()] ^= char(1 << random.Integer(0, 7)); break;
    case 3: header += Noise(random, 20); break;
    default: break;
  }
  if (IsHeeded(header)) return {Noise(random, 300)};  // one changed bit makes a ShutDown of a StatusReply
  constexpr std::size_t kPayloadBytes = 160 << 10;
  std::vector<std::string> parts = {std::move(header)};
  if (random.Chance(0.5)) return parts;
  if (random.Chance(0.2)) {
    for (int i = random.Integer(1, 3); i > 0; --i) parts.push_back(Noise(random, 16));
  }
  parts.emplace_back(kPayloadBytes, char(random.Integer(0, 255)));
  return parts;
}

TEST_P(HostilePeers, GarbageIsDroppedAndMemoryStays) {
  Random random(21);
  SCOPED_TRACE(random.trace());
  // What each port is sent after the first round, which fills pools and buffers, is more than what memory may grow by in all.
  constexpr int kRounds = 4, kMessages = 400;
  constexpr std::int64_t kMaxGrowth = 32 << 20;
  const std::vector<AnyMessage> messages = AllSamples();
  std::vector<std::int64_t> sent_bytes(ports_.size());
  std::int64_t resident = 0;
  for (int round = 0; round < kRounds; ++round) {
    if (round == 1) {
      resident = ResidentBytes();
      sent_bytes.assign(ports_.size(), 0);
    }
    ExpectPictureDuring(10 * round, [&] {
      for (std::size_t port = 0; port < ports_.size(); ++port) {
        zmq::socket_t dealer = Dealer(ports_[port]);
        for (int i = 0; i < kMessages; ++i) {
          const std::vector<std::string> parts = Garbage(messages, random);
          if (parts.size() == 2) sent_bytes[port] += std::int64_t(parts[1].size());
          SendParts(dealer, parts);
        }
      }
    });
  }
  for (const std::int64_t bytes : sent_bytes) EXPECT_GT(bytes, kMaxGrowth * 5 / 4);
  if (kMemoryIsMeasured) {
    ExpectMemoryBelow(resident + kMaxGrowth);
  }
  ExpectNobodyLost();
}

// The message as this service's, as far as it names a service.
AnyMessage OfEpoch(AnyMessage message, Epoch epoch) {
  std::visit(
      [epoch](auto& held) {
        if constexpr (requires { held.epoch; }) held.epoch = epoch;
      },
      message);
  return message;
}

// A Ping that says that all frames are over, or a Stop, would end every frame of a worker that takes it from the images plane.
TEST_P(HostilePeers, EachPlaneTakesItsOwnMessagesAlone) {
  constexpr FrameId kLastFrame = FrameId{1} << 63U;
  std::vector<AnyMessage> messages = {Ping{.finished_before = kLastFrame}, Stop{}, Retire{}, ShutDown{}};
  for (const AnyMessage& sample : AllSamples()) messages.push_back(sample);
  ExpectPictureDuring(20, [&] {
    for (const Port& port : ports_) {
      zmq::socket_t dealer = Dealer(port);
      for (const AnyMessage& message : messages) {
        if (port.takes(message)) continue;
        std::vector<std::string> parts = {TextOf(Encode(OfEpoch(message, epoch_)))};
        if (const std::size_t payload = ExpectedPayloadBytes(message); payload > 0 && payload < 1 << 16) parts.emplace_back(payload, 'x');
        SendParts(dealer, parts);
      }
    }
  });
  ExpectNobodyLost();
}

TEST_P(HostilePeers, BytesThatAreNoMessagesOfZeroMQ) {
  Random random(22);
  SCOPED_TRACE(random.trace());
  constexpr std::uint64_t kLargest = ~std::uint64_t{0};
  const std::string ready = RawPeer::Greeting() + RawPeer::Ready();
  const std::string hello = TextOf(Encode(StatusQuery{.nonce = 1}));
  std::string endless;
  for (int i = 0; i < 5000; ++i) endless += RawPeer::Frame("part", true);
  const std::vector<std::string> talks = {
      "",                      // a connection that says nothing
      std::string("\xff", 1),  // or stops in the greeting
      RawPeer::Greeting().substr(0, 40),
      RawPeer::Greeting(),  // or after it
      RawPeer::Greeting("CURVE"),
      RawPeer::Greeting("PLAIN") + RawPeer::Command("HELLO", std::string(100, 'x')),
      RawPeer::Greeting("CURVE") + RawPeer::Command("HELLO", std::string(194, '\x01')),
      RawPeer::Greeting("CURVE") + RawPeer::Command("INITIATE", std::string(120, '\x02')),
      RawPeer::Greeting() + RawPeer::Ready("PUB"),
      RawPeer::Greeting() + RawPeer::Command("READY", std::string("\x0bSocket-Type\xff\xff\xff\xff", 16)),
      RawPeer::Greeting() + std::string("\x06", 1) + std::string(8, '\xff'),  // a command of 2^64 - 1 bytes
      "GET / HTTP/1.1\r\nHost: localhost\r\n\r\n",
      ready + RawPeer::Frame("", false, kLargest),
      ready + RawPeer::Frame("", false, kLargest >> 1U),
      ready + RawPeer::Frame("begun", false, std::uint64_t{1} << 31U),
      ready + RawPeer::Frame("begun", false, (std::uint64_t{2} << 30U) - 1),
      ready + RawPeer::Frame("", true) + RawPeer::Frame("", false),
      ready + RawPeer::Frame(hello, true) + RawPeer::Frame("") + RawPeer::Frame(hello, true),
      ready + endless,
      ready + RawPeer::Command("SUBSCRIBE", "x") + RawPeer::Command("PING", "") + RawPeer::Command("ERROR", "\xff"),
      ready + std::string("\xf8\x05hello", 7),  // flags that do not exist
  };
  constexpr std::int64_t kMaxGrowth = 32 << 20;
  std::int64_t resident = 0;
  for (int round = 0; round < 3; ++round) {
    if (round == 1) resident = ResidentBytes();
    std::vector<RawPeer> connections;  // held open while pictures are made
    connections.reserve(ports_.size() * (talks.size() + 1));
    ExpectPictureDuring(10 * round, [&] {
      for (const Port& port : ports_) {
        for (const std::string& talk : talks) connections.emplace_back(port.endpoint).Send(talk);
        connections.emplace_back(port.endpoint).Send(Noise(random, 100'000));
      }
    });
  }
  if (kMemoryIsMeasured) {
    ExpectMemoryBelow(resident + kMaxGrowth);
  }
  ExpectNobodyLost();
}

TEST(HostileEndpoints, EndpointsAreChecked) {
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
