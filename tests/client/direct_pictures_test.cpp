// Pictures that workers send straight to the client: whole, in shares, lost, of strangers.
#include "client/direct_pictures.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <thread>
#include <utility>

#include "common/transport/authenticator.h"
#include "tests/client/fake_service.h"

namespace slabstream {
namespace {

// Another share of that picture, all 0.25, that overlaps the first one by a row.
std::pair<PictureShare, Bytes> SecondShare() {
  LocalImage image = MakeLocalImage(PixelFormat::kRgba, {0, 17, 32, 20});
  std::ranges::fill(image.rgba, 0.25F);
  RunImage runs = EncodePicture(image);
  PictureShare share{.runs = {.image = runs.header}};
  const Bytes payload = PackRuns(Bytes(std::move(runs.payload)), Codec::kRaw, share.runs);
  return {share, payload};
}

// A service with keys, and a worker of it that brings pictures, as the test says, under a key that the service names or under another one.
class DirectPicturesTest : public ClientTest {
 protected:
  enum class Brings { kNothing, kPicture, kPictureOfAnother, kPictureFirst, kOneOfTwoShares, kTwoShares };

  // How often the client has asked for the picture, and what it got.
  struct Outcome {
    Result<Picture> picture;
    int asked = 0, asked_with_door = 0;
  };

  Outcome Render(Brings brings) {
    context_.authenticator().AdmitOnly("clients", {client_.public_key});
    Outcome outcome{Status::Internal(""), 0, 0};
    const auto answer = [&](const AnyMessage& message) -> std::vector<Answer> {
      if (const auto* ping = std::get_if<ClientPing>(&message)) {
        ClientPong pong = PongTo(*ping);
        if (!held_) pong.known.clear();  // the frame is over for the service
        if (ping->senders && *ping->senders != 7) pong.senders = PictureSenders{7, {worker_.public_key}};
        if (!held_ || ping->received_bytes < held_->payload.size()) return {{pong, {}}};
        return {{pong, {}}, *std::exchange(held_, std::nullopt)};
      }
      const auto& submit = std::get<SubmitFrame>(message);
      ++outcome.asked;
      Answer reply = ReplyTo(submit.request);
      if (!submit.pictures && hold_) {
        held_ = reply;
        return {};
      }
      if (!submit.pictures) return {reply};
      ++outcome.asked_with_door;
      if (brings != Brings::kNothing) {
        const KeyPair& own = brings == Brings::kPictureOfAnother ? stranger_ : worker_;
        SocketOptions options;
        options.client_keys = ClientKeys{.server_key = submit.pictures->key, .own = own, .sealed = true};
        worker_socket_.emplace(Socket::Dealer(context_, options).value());
        EXPECT_TRUE(worker_socket_->Connect("tcp://127.0.0.1:" + std::to_string(submit.pictures->port)).ok());
        const auto send = [&](const PictureShare& share, const Bytes& payload) {
          EXPECT_TRUE(worker_socket_->Send({}, Encode(SentPicture{share.runs.digest, payload.size()}), payload).ok());
        };
        send(std::get<FrameReply>(reply.message).shares.front(), reply.payload);
        if (brings == Brings::kTwoShares) send(SecondShare().first, SecondShare().second);
        while (brings == Brings::kPictureFirst && !worker_socket_->connected()) std::this_thread::yield();
      }
      std::vector<PictureShare>& shares = std::get<FrameReply>(reply.message).shares;
      shares.front().direct = true;
      if (brings != Brings::kOneOfTwoShares && brings != Brings::kTwoShares) return {{reply.message, {}}};
      const auto [second, payload] = SecondShare();
      shares.push_back(second);
      shares.back().direct = brings == Brings::kTwoShares;
      return {{reply.message, shares.back().direct ? Bytes() : payload}};
    };
    const SocketOptions options{.server_keys = ServerKeys{.secret_key = service_.secret_key, .plane = "clients"}};
    const FakeService service(context_, "tcp://127.0.0.1:*", answer, options);
    const ServiceAddress address(service.endpoint(), ClientKeys{.server_key = service_.public_key, .own = client_});
    Client client = Client::Connect(context_, address, seconds(30), {.ping = milliseconds(20), .lost_picture = lost_after_}).value();
    outcome.picture = client.Render(SmallRequest(), seconds(60));
    return outcome;
  }

  Duration lost_after_ = seconds(60);
  // The service sends a picture again when the client says to have read as many bytes as the lost one had.
  bool hold_ = false;
  std::optional<Answer> held_;
  const KeyPair service_ = MakeKeyPair(), client_ = MakeKeyPair(), worker_ = MakeKeyPair(), stranger_ = MakeKeyPair();
  std::optional<Socket> worker_socket_;
};

TEST_F(DirectPicturesTest, ComeFromAWorkerThatTheServiceNames) {
  for (const Brings brings : {Brings::kPicture, Brings::kPictureFirst}) {
    const Outcome outcome = Render(brings);
    ASSERT_TRUE(outcome.picture.ok()) << outcome.picture.status().message();
    EXPECT_TRUE(outcome.picture->direct);
    EXPECT_EQ(outcome.picture->image.bounds(), (PixelBounds{4, 6, 20, 18}));
    EXPECT_EQ(outcome.picture->image.floats()->rgba[5], 0.001F * 5);
    EXPECT_EQ(outcome.asked, 1);
  }
}

TEST_F(DirectPicturesTest, ArePutTogetherFromTheirShares) {
  for (const Brings brings : {Brings::kOneOfTwoShares, Brings::kTwoShares}) {
    const Outcome outcome = Render(brings);
    ASSERT_TRUE(outcome.picture.ok()) << outcome.picture.status().message();
    EXPECT_EQ(outcome.picture->direct, brings == Brings::kTwoShares);
    const LocalImage& image = *outcome.picture->image.floats();
    EXPECT_EQ(image.bounds, (PixelBounds{0, 6, 32, 20}));
    for (std::int32_t y = 6; y < 20; ++y) {
      for (std::int32_t x = 0; x < 32; ++x) {
        const float alpha = image.rgba[4 * std::size_t((y - 6) * 32 + x) + 3];
        const bool in_first = x >= 4 && x < 20 && y < 18, in_second = y >= 17;
        EXPECT_EQ(alpha, (in_first ? 0.5F : 0) + (in_second ? 0.25F : 0)) << x << ", " << y;
      }
    }
    EXPECT_EQ(outcome.asked, 1);
  }
}

TEST_F(DirectPicturesTest, AreAskedForAgainIfTheyAreLost) {
  lost_after_ = milliseconds(50);
  for (const Brings brings : {Brings::kNothing, Brings::kPictureOfAnother}) {
    const Outcome outcome = Render(brings);
    ASSERT_TRUE(outcome.picture.ok()) << outcome.picture.status().message();
    EXPECT_FALSE(outcome.picture->direct);
    EXPECT_EQ(outcome.picture->image.floats()->rgba[5], 0.001F * 5);
    EXPECT_EQ(outcome.asked, 2);
    EXPECT_EQ(outcome.asked_with_door, 1) << "the second one comes through the coordinator";
  }
}

// The service has counted its bytes as sent. If they stayed unread for ever, it would take the client for one that does not read.
TEST_F(DirectPicturesTest, CountAsReadIfTheyAreLost) {
  lost_after_ = milliseconds(50);
  hold_ = true;
  const Outcome outcome = Render(Brings::kNothing);
  ASSERT_TRUE(outcome.picture.ok()) << outcome.picture.status().message();
  EXPECT_EQ(outcome.asked, 2);
}

}  // namespace
}  // namespace slabstream
