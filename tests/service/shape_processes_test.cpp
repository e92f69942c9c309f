// Workers as processes draw tiles of shapes for each other: pictures stay as they are, also if some are killed.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "tests/service/multi_process_fixture.h"
#include "tests/support/random_combining.h"
#include "tests/support/renderers.h"
#include "tests/worker/shapes/shape_pictures.h"

namespace slabstream {
namespace {

void WritePly(const Shape& shape, const std::filesystem::path& path) {
  std::ofstream file(path);
  file << fmt::format("ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n",
                      shape.positions.size());
  file << fmt::format("element face {}\nproperty list uchar int vertex_indices\nend_header\n", shape.triangles.size());
  for (const auto& p : shape.positions)
    file << fmt::format("{} {} {}\n", shape.origin.x + double(p[0]), shape.origin.y + double(p[1]), shape.origin.z + double(p[2]));
  for (const auto& t : shape.triangles) file << fmt::format("3 {} {} {}\n", t[0], t[1], t[2]);
}

class ShapeProcesses : public MultiProcessTest {
 protected:
  // A ball in a larger one, which is translucent.
  void StartWithBalls() {
    WritePly(testing::SphereMesh({32, 32, 32}, 20, 40), directory_ / "core.ply");
    WritePly(testing::SphereMesh({30, 34, 32}, 30, 60), directory_ / "shell.ply");
    StartCoordinator("tcp://127.0.0.1:*", "tcp://127.0.0.1:*",
                     {"--data", "core=" + (directory_ / "core.ply").string(), "--data", "shell=" + (directory_ / "shell.ply").string()});
    for (int i = 0; i < 4; ++i) StartWorker();
    client_.emplace(Connect());
    AwaitWorkers(*client_, 4);
  }
  static FrameRequest RequestOf(const RendererKind* renderer, double azimuth, int groups) {
    FrameRequest request = TestRequest(renderer, azimuth, groups);
    request.size = {320, 300};
    request.shapes = {{.shape = "core"}, {.shape = "shell", .opacity = 0.5}};
    return request;
  }
  LocalImage Render(const FrameRequest& request) {
    Result<Picture> picture = client_->Render(request, seconds(60));
    CHECK(picture.ok()) << picture.status().message();
    return *picture->image.floats();
  }
  static void ExpectSame(const LocalImage& a, const LocalImage& b) {
    ASSERT_EQ(a.bounds, b.bounds);
    float largest = 0;
    for (std::size_t i = 0; i < a.rgba.size(); ++i) largest = std::max(largest, std::abs(a.rgba[i] - b.rgba[i]));
    EXPECT_LE(largest, 2e-6F);
  }

  std::optional<Client> client_;
};

TEST_F(ShapeProcesses, PicturesDoNotDependOnWhoDrawsForWhom) {
  StartWithBalls();
  std::vector<FrameRequest> requests;
  std::vector<LocalImage> pictures;
  for (const RendererKind* renderer : {FindRenderer("raycast"), FindRenderer("splat"), FindRenderer("zbuffer"), FindRenderer("mip")}) {
    for (int groups = 1; groups <= 3; ++groups) {
      FrameRequest request = RequestOf(renderer, random_.Integer(0, 359), groups);
      request.termination = 0;
      request.policy.combine = RandomCombining(random_);
      pictures.push_back(Render(request));
      requests.push_back(request);
    }
  }
  while (workers_.size() > 1) KillWorker(0);
  AwaitStatus(*client_, [](const StatusReply& status) { return status.workers.size() == 1; });
  for (std::size_t i = 0; i < requests.size(); ++i) ExpectSame(Render(requests[i]), pictures[i]);
}

TEST_F(ShapeProcesses, KilledWorkersCostNoFrameAndChangeNoPicture) {
  StartWithBalls();
  for (int round = 0; round < 6; ++round) {
    const FrameRequest request = RequestOf(FindRenderer("raycast"), random_.Integer(0, 359), random_.Integer(1, 3));
    const auto victim = std::size_t(random_.Integer(0, int(workers_.size()) - 1));
    SCOPED_TRACE(::testing::Message() << "round " << round << ": worker " << victim << " of " << workers_.size() << " killed");
    const RequestId id = client_->Submit(request, seconds(100));
    KillWorker(victim);
    const Result<Picture> picture = Await(*client_, id, [] {});
    ASSERT_TRUE(picture.ok()) << picture.status().message();
    ExpectSame(Render(request), *picture->image.floats());
    while (workers_.size() < 4) StartWorker();
  }
}

}  // namespace
}  // namespace slabstream
