// A file that is sent to a service that the test plays.
#include "client/file_upload.h"

#include <gmock/gmock.h>

#include <future>

#include "tests/client/fake_service.h"

namespace slabstream {
namespace {

// The service is restarted, or its connection breaks: it says that it does not know the file any more.
TEST_F(ClientTest, AFileThatTheServiceHasLostIsToldOf) {
  std::atomic<bool> loses = false;
  FakeService service(context_, "inproc://client-test", [&](const AnyMessage& message) -> std::vector<Answer> {
    if (const auto* order = std::get_if<AddVolume>(&message)) return {{DataReply{.nonce = order->nonce}, {}}};
    const auto* ping = std::get_if<ClientPing>(&message);
    if (ping == nullptr) return {};
    EXPECT_THAT(ping->asked, testing::SizeIs(1));
    ClientPong pong = PongTo(*ping);
    if (loses) pong.lost = ping->asked;
    return {{pong, {}}};
  });
  std::promise<void> there;
  std::promise<Status> ended;
  const FileUpload upload(
      context_, service.endpoint(), "mesh", {"mesh.vtk", 3},
      {.sent = [](std::uint64_t) {}, .changed = [&](const Status& status) { status.ok() ? there.set_value() : ended.set_value(status); }});
  there.get_future().wait();
  loses = true;
  const Status why = ended.get_future().get();
  EXPECT_EQ(why.code(), StatusCode::kUnavailable);
  EXPECT_THAT(why.message(), testing::HasSubstr("has lost what was sent"));
}

}  // namespace
}  // namespace slabstream
