// Owners of voxels as processes of their own, which are stopped, killed and started again, and a coordinator that is: each picture is of
// one time that all had, or says in one line what it lacks.
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "tests/service/multi_process_fixture.h"
#include "tests/service/owned_balls.h"
#include "tests/support/renderers.h"

namespace slabstream {
namespace {

class VanishingOwnersTest : public MultiProcessTest {
 protected:
  void Start(const std::string& how, int stuck = 0) {
    how_ = how;
    ASSERT_NO_FATAL_FAILURE(StartCoordinators());
    for (int i = 0; i < 2; ++i) StartWorker();
    for (std::uint32_t owner = 0; owner < kBalls; ++owner) StartOwner(owner, owner == 1 ? stuck : 0);
    for (std::uint64_t time = 0; time < kBallsPeriod; ++time) {
      right_.push_back(RenderDirectly(Request(), BallsAt(time)));
      without_.push_back(RenderDirectly(Request(), BallsAt(time, 1)));
    }
  }
  void StartCoordinators() {
    coordinator_.reset();
    const std::string clients = client_endpoint_.empty() ? "tcp://127.0.0.1:*" : client_endpoint_;
    const std::string workers = worker_endpoint_.empty() ? "tcp://127.0.0.1:*" : worker_endpoint_;
    coordinator_.emplace(
        std::vector<std::string>{SLABSTREAM_COORDINATOR_PROGRAM, "--listen", clients, "--worker-listen", workers, "--log-level", "error"});
    const std::string ready = coordinator_->ReadLine();
    ASSERT_THAT(ready, HasSubstr("slabstream-coordinator ready"));
    client_endpoint_ = FieldOf(ready, "client");
    worker_endpoint_ = FieldOf(ready, "workers");
    client_.emplace(Connect());
  }
  void StartOwner(std::uint32_t owner, int stuck = 0) {
    owners_[owner].emplace(
        std::vector<std::string>{SLABSTREAM_BALL_OWNER_PROGRAM, worker_endpoint_, std::to_string(owner), how_, std::to_string(stuck)});
  }
  static FrameRequest Request(Missing missing = Missing::kFail) {
    FrameRequest request = TestRequest(FindRenderer("raycast"), 30, 0);
    request.termination = 0;
    request.missing = missing;
    return request;
  }
  // Asks until a frame ends so that `is_it`: owners come and go when they do. What it ends with then.
  template <class IsIt>
  Result<Picture> Await(IsIt&& is_it, Missing missing = Missing::kFail) {
    Result<Picture> picture = Status::Internal("");
    for (const Time end = MonotonicNow() + seconds(60); MonotonicNow() < end;) {
      picture = client_->Render(Request(missing), seconds(30));
      if (picture.ok() && picture->statistics.missing.empty()) ExpectOneOf(*picture, right_);
      if (is_it(picture)) return picture;
    }
    ADD_FAILURE() << "the last frame ended: " << (picture.ok() ? "ok, " + picture->statistics.missing : picture.status().message());
    return picture;
  }
  Result<Picture> AwaitPicture() {
    return Await([](const Result<Picture>& picture) { return picture.ok(); });
  }
  static float Least(const Picture& picture, const std::vector<LocalImage>& images) {
    float least = 1;
    for (const LocalImage& image : images) least = std::min(least, LargestDifference(picture.image, image, Request().size));
    return least;
  }
  static void ExpectOneOf(const Picture& picture, const std::vector<LocalImage>& images) { EXPECT_LE(Least(picture, images), 1e-6F); }

  std::string how_;
  std::optional<Client> client_;
  std::array<std::optional<ChildProcess>, kBalls> owners_;
  std::vector<LocalImage> right_, without_;  // by time % kBallsPeriod; without: what owner 1 holds
};

class OwnersThatVanishTest : public VanishingOwnersTest, public testing::WithParamInterface<const char*> {};

TEST_P(OwnersThatVanishTest, AndComeBack) {
  ASSERT_NO_FATAL_FAILURE(Start(GetParam()));
  Result<Picture> picture = AwaitPicture();
  ASSERT_TRUE(picture.ok());
  std::uint64_t stored = 0, sent = 0;
  for (const RankReport& report : picture->statistics.reports) {
    stored += report.stored_bytes;
    sent += report.sent_bytes;
  }
  const bool in_place = GetParam() == std::string("in-place");
  EXPECT_EQ(stored == 0, in_place) << stored;
  EXPECT_EQ(sent == 0, in_place) << sent;

  owners_[1]->Stop();
  picture = Await([](const Result<Picture>& each) { return each.status().message().find("owner 1 of 3 is silent") != std::string::npos; });
  EXPECT_EQ(picture.status().message().find('\n'), std::string::npos);
  const auto is_known = [](const Result<Picture>& each) { return each.ok() && !each->statistics.missing.empty(); };
  picture = Await(is_known, Missing::kSkip);
  if (picture.ok()) {
    EXPECT_EQ(picture->statistics.missing, "\"ball\": owner 1 of 3 is silent: its voxels show nothing");
    ExpectOneOf(*picture, without_);
  }
  if (in_place) {
    picture = Await(is_known, Missing::kLast);
    if (picture.ok()) {
      EXPECT_EQ(picture->statistics.missing, "\"ball\": owner 1 of 3 is silent: this is the last time before");
      ExpectOneOf(*picture, right_);
    }
  } else {  // from what workers still hold of that time, or not at all
    picture = client_->Render(Request(Missing::kLast), seconds(30));
    if (picture.ok()) ExpectOneOf(*picture, right_);
  }
  owners_[1]->Kill(SIGCONT);
  ASSERT_TRUE(AwaitPicture().ok());

  ASSERT_NO_FATAL_FAILURE(StartCoordinators());
  ASSERT_TRUE(AwaitPicture().ok());

  owners_[1]->Kill(SIGKILL);
  owners_[1]->Wait();
  (void)Await([](const Result<Picture>& each) { return !each.ok(); });
  if (in_place) {
    picture = Await(is_known, Missing::kLast);
    if (picture.ok()) ExpectOneOf(*picture, right_);  // its memory is still mapped
  }
  StartOwner(1);
  ASSERT_TRUE(AwaitPicture().ok());
}

INSTANTIATE_TEST_SUITE_P(Voxels, OwnersThatVanishTest, testing::Values("in-place", "asked"),
                         [](const auto& each) { return each.param == std::string("asked") ? "Asked" : "InPlace"; });

class OwnersThatMakeBoxesTest : public VanishingOwnersTest, public testing::WithParamInterface<int> {};

TEST_P(OwnersThatMakeBoxesTest, VanishMeanwhileAndComeBack) {
  ASSERT_NO_FATAL_FAILURE(Start("on-demand", GetParam()));
  std::jthread viewer([&] {
    const Result<Picture> picture =
        Await([](const Result<Picture>& each) { return each.status().message().find("owner 1 of 3") != std::string::npos; });
    EXPECT_EQ(picture.status().message().find('\n'), std::string::npos);
  });
  EXPECT_EQ(owners_[1]->ReadLine(), "making");
  owners_[1]->Kill(SIGKILL);
  owners_[1]->Wait();
  viewer.join();
  StartOwner(1);
  ASSERT_TRUE(AwaitPicture().ok());
}

// The first making is for the survey that opens the dataset, later ones for pictures.
INSTANTIATE_TEST_SUITE_P(Making, OwnersThatMakeBoxesTest, testing::Values(1, 4));

}  // namespace
}  // namespace slabstream
