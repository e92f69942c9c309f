// libslabstream.so, as other programs use it: its header and nothing else of ours, and a service of real processes.
#include <gmock/gmock.h>
#include <slabstream/client.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <thread>

#include "tests/end_to_end/program.h"
#include "tests/support/text_of.h"

namespace slabstream {
namespace {

using testing::ElementsAre;

class ClientLibraryTest : public EndToEndTest {
 protected:
  ClientLibraryTest() : endpoint_("ipc://" + Path("s")) {
    MustRun({"up", "--detach", "--workers", "2", "--listen", endpoint_, "--data", "ball=" + MakeSphere("ball.nrrd", 2, 32)});
  }

  std::string endpoint_;
};

// What a call throws: its code; and its message, in `said`.
template <class Call>
ErrorCode CodeOf(const Call& call, std::string* said = nullptr) {
  try {
    call();
  } catch (const Error& error) {
    if (said != nullptr) *said = error.what();
    return error.code();
  }
  ADD_FAILURE() << "nothing was thrown";
  return ErrorCode::kInternal;
}

TEST_F(ClientLibraryTest, MakesTheFileOfTheCommandLine) {
  MustRun({"render", "ball", "--endpoint", endpoint_, "-o", "there.png", "--size", "60x40", "--azimuth", "30", "--background", "white",
           "--color-bar=HU"});
  Service service = Service::Connect({endpoint_});
  const Image image = service.Render("ball", {{"size", "60x40"}, {"azimuth", "30"}, {"background", "white"}, {"color-bar", "HU"}});
  EXPECT_EQ(TextOf(image.Png()), ReadFile("there.png"));
  image.Save(Path("here.png"));
  EXPECT_EQ(ReadFile("here.png"), ReadFile("there.png"));
  EXPECT_THAT(TextOf(image.Jpeg()), AllOf(testing::StartsWith("\xff\xd8"), testing::EndsWith("\xff\xd9")));
}

TEST_F(ClientLibraryTest, GivesPremultipliedPixelsOfTheWholePicture) {
  Service service = Service::Connect({endpoint_});
  const Image image = service.Render("ball", {{"size", "60x40"}, {"renderer", "zbuffer"}});
  ASSERT_EQ(image.width(), 60);
  ASSERT_EQ(image.height(), 40);
  EXPECT_TRUE(image.final());
  EXPECT_GT(image.latency().count(), 0);
  const std::vector<float> rgba = image.Rgba(), depth = image.Depth();
  ASSERT_EQ(rgba.size(), 4U * 60 * 40);
  ASSERT_EQ(depth.size(), 60U * 40);
  for (std::size_t i = 0; i < depth.size(); ++i) {
    EXPECT_EQ(rgba[4 * i + 3] > 0, std::isfinite(depth[i]));
    EXPECT_LE(rgba[4 * i], rgba[4 * i + 3]);
  }
  EXPECT_GT(std::count_if(depth.begin(), depth.end(), [](float d) { return std::isfinite(d); }), 0);
  EXPECT_EQ(rgba[3], 0);  // of a corner
  EXPECT_TRUE(service.Render("ball", {{"size", "20"}, {"renderer", "splat"}}).Depth().empty());
}

TEST_F(ClientLibraryTest, TellsProgressAndShowsPreviews) {
  Service service = Service::Connect({endpoint_});
  int previews = 0, news = 0;
  RenderCall call;
  call.on_progress = [&](const Progress& progress) {
    ++news;
    EXPECT_LE(progress.groups_done, progress.group_count);
  };
  call.on_preview = [&](const Image& image) {
    ++previews;
    EXPECT_FALSE(image.final());
    EXPECT_LT(image.groups_done(), image.group_count());
    EXPECT_EQ(image.Rgba().size(), 4U * 64 * 64);
  };
  const Image image = service.Render("ball", {{"size", "64"}, {"groups", "4"}}, call);
  EXPECT_TRUE(image.final());
  EXPECT_GT(news, 0);
  EXPECT_GT(previews, 0);
}

TEST_F(ClientLibraryTest, CallsEndEarly) {
  Service service = Service::Connect({endpoint_});
  RenderCall call;
  call.on_progress = [&](const Progress&) { call.cancellation.Cancel(); };
  EXPECT_EQ(CodeOf([&] { service.Render("ball", {}, call); }), ErrorCode::kCancelled);

  RenderCall throwing;
  throwing.on_progress = [](const Progress&) { throw std::logic_error("of the caller"); };
  EXPECT_THROW(service.Render("ball", {}, throwing), std::logic_error);

  RenderCall none;
  none.deadline = std::chrono::milliseconds(0);
  EXPECT_EQ(CodeOf([&] { service.Render("ball", {}, none); }), ErrorCode::kInvalidArgument);

  EXPECT_EQ(service.Render("ball", {{"size", "16"}}).width(), 16);  // the connection is as good as before
}

TEST_F(ClientLibraryTest, ErrorsNameWhatIsWrong) {
  Service service = Service::Connect({endpoint_});
  std::string said;
  EXPECT_EQ(CodeOf([&] { service.Render("head"); }, &said), ErrorCode::kNotFound);
  EXPECT_THAT(said, HasSubstr("no dataset \"head\""));
  EXPECT_EQ(CodeOf([&] { service.Render("ball", {{"azimuth", "north"}}); }, &said), ErrorCode::kInvalidArgument);
  EXPECT_THAT(said, HasSubstr("--azimuth 'north'"));
  EXPECT_EQ(CodeOf([&] { service.Render("ball", {{"deepness", "2"}}); }, &said), ErrorCode::kInvalidArgument);
  EXPECT_THAT(said, HasSubstr("there is no option 'deepness'"));
  const Image image = service.Render("ball", {{"size", "16"}});
  EXPECT_EQ(CodeOf([&] { image.Save(Path("a.gif")); }), ErrorCode::kInvalidArgument);
  EXPECT_EQ(CodeOf([&] { image.Jpeg(0); }), ErrorCode::kInvalidArgument);
  EXPECT_EQ(CodeOf([&] { Service::Connect({"ipc://" + Path("nobody")}, std::chrono::milliseconds(50)); }), ErrorCode::kUnavailable);
  EXPECT_EQ(CodeOf([&] { Service::Connect({"", Path("none.json")}); }), ErrorCode::kNotFound);
}

TEST_F(ClientLibraryTest, SimulationsAreSteered) {
  Service service = Service::Connect({endpoint_});
  RunningProgram simulation({SLABSTREAM_STEERED_SIMULATION, endpoint_, "rho"}, directory_);
  for (const auto end = std::chrono::steady_clock::now() + kProgramTimeout;
       service.StatusJson().find("\"simulation\"") == std::string::npos && std::chrono::steady_clock::now() < end;) {
  }
  service.Steer("rho", {{"level", 200}, {"unused", -1}});
  EXPECT_THAT(service.StatusJson(), testing::ContainsRegex("\"level\",[^}]*\"value\": 200"));
  std::string said;
  EXPECT_EQ(CodeOf([&] { service.Steer("rho", {{"unused", 2}}); }, &said), ErrorCode::kInvalidArgument);
  EXPECT_EQ(said, "\"rho\": unused is 2, must be in [-1, 1]");
}

TEST_F(ClientLibraryTest, SeveralThreadsShareAService) {
  Service service = Service::Connect({endpoint_});
  const std::vector<float> alone = service.Render("ball", {{"size", "32"}}).Rgba();
  std::atomic<int> same = 0;
  std::vector<std::thread> threads;
  for (int i = 0; i < 3; ++i) threads.emplace_back([&] { same += service.Render("ball", {{"size", "32"}}).Rgba().size() == alone.size(); });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(same, 3);
  EXPECT_THAT(service.Datasets(), ElementsAre("ball"));
  EXPECT_THAT(service.StatusJson(), HasSubstr("\"workers\""));
}

}  // namespace
}  // namespace slabstream
