// A service that a test plays, for clients.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "client/client.h"
#include "common/image/run_image.h"
#include "common/transport/socket.h"
#include "common/wire/any_message.h"
#include "common/wire/other_version.h"
#include "common/wire/payload.h"

namespace slabstream {

using std::chrono::milliseconds;
using std::chrono::seconds;

struct Answer {
  AnyMessage message;
  Bytes payload;
};

// Binds an endpoint of its own and answers what comes by a function, which is called in the service's thread.
class FakeService {
 public:
  using Handler = std::function<std::vector<Answer>(const AnyMessage&)>;

  FakeService(Context& context, const std::string& endpoint, Handler handler, const SocketOptions& options = {})
      : handler_(std::move(handler)), socket_(Socket::Router(context, options).value()) {
    endpoint_ = socket_.Bind(endpoint).value();
    thread_ = std::jthread([this](const std::stop_token& stop) { Run(stop); });
  }
  ~FakeService() {
    thread_.request_stop();
    wakeup_.Notify();
  }
  const std::string& endpoint() const { return endpoint_; }
  // From now on it answers as a service of another release does.
  void SpeakAnotherVersion() { speaks_another_version_ = true; }
  static constexpr std::uint32_t kAnotherVersion = kWireVersion + 1;

 private:
  void Run(const std::stop_token& stop) {
    const std::array<Socket*, 1> sockets = {&socket_};
    while (!stop.stop_requested()) {
      Wait(sockets, &wakeup_, seconds(60));
      while (const std::optional<Incoming> incoming = socket_.TryReceive()) {
        if (speaks_another_version_) {
          std::vector<std::byte> notice = VersionNotice();
          notice.back() = std::byte{kAnotherVersion};
          (void)socket_.Send(incoming->identity, std::move(notice));
          continue;
        }
        const Result<AnyMessage> message = Decode(incoming->header());
        ASSERT_TRUE(message.ok()) << message.status().message();
        for (const Answer& answer : handler_(*message)) (void)socket_.Send(incoming->identity, Encode(answer.message), answer.payload);
      }
    }
  }

  Handler handler_;
  std::atomic<bool> speaks_another_version_ = false;
  Wakeup wakeup_;
  Socket socket_;
  std::string endpoint_;
  std::jthread thread_;
};

// Knows every request that it is asked about.
inline ClientPong PongTo(const ClientPing& ping) { return {.epoch = 1, .nonce = ping.nonce, .known = ping.open}; }

// Answers pings, and questions and orders by `handler`.
inline FakeService::Handler Answering(FakeService::Handler handler) {
  return [handler = std::move(handler)](const AnyMessage& message) -> std::vector<Answer> {
    if (const auto* ping = std::get_if<ClientPing>(&message)) return {{PongTo(*ping), {}}};
    return handler(message);
  };
}

inline FrameRequest SmallRequest() {
  FrameRequest request;
  request.dataset = "ball";
  request.size = {32, 24};
  return request;
}

// A reply whose picture is half transparent on a rectangle.
inline Answer ReplyTo(RequestId request, std::uint32_t groups_done = 1, std::uint32_t group_count = 1, Codec codec = Codec::kZstd) {
  LocalImage image = MakeLocalImage(PixelFormat::kRgba, {4, 6, 20, 18});
  for (std::size_t i = 0; i < image.rgba.size(); ++i) image.rgba[i] = i % 4 == 3 ? 0.5F : 0.001F * float(i % 97);
  RunImage runs = EncodeRuns(image, {0, 32 * 24}, 32);
  FrameReply reply{.request = request, .size = {32, 24}, .groups_done = groups_done, .group_count = group_count, .shares = {{}}};
  reply.statistics.renderer = "raycast";
  reply.statistics.decomposition = "slab";
  reply.statistics.axis = "z";
  reply.statistics.combine = "fan-in";
  reply.shares.front().runs.image = runs.header;
  const Bytes payload = PackRuns(Bytes(std::move(runs.payload)), codec, reply.shares.front().runs);
  return {reply, payload};
}

class ClientTest : public testing::Test {
 protected:
  Context context_;
  const ClientTiming quick_ = {.ping = milliseconds(20), .silence = milliseconds(400)};
};

}  // namespace slabstream
