// `up`, `status`, `render`, `down`: a service of real processes, on endpoints that no other test can meet.
#include <gmock/gmock.h>
#include <signal.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>

#include "common/json/json.h"
#include "tests/end_to_end/picture_file.h"
#include "tests/end_to_end/program.h"
#include "tests/support/full_disk.h"
#include "tests/support/loopback_listener.h"

namespace slabstream {
namespace {

// A zombie does not run: who started it may be gone, and nobody may be left to reap it.
bool Runs(pid_t pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/stat");
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  const std::size_t close = text.rfind(')');
  return close != std::string::npos && text[close + 2] != 'Z' && text[close + 2] != 'X';
}

class ServiceTest : public EndToEndTest {
 protected:
  ServiceTest() : ball_(MakeSphere("ball.nrrd", 2, 32)), endpoint_("ipc://" + Path("s")) {}

  ProgramResult Up(const std::string& endpoint) const {
    return MustRun({"up", "--detach", "--workers", "2", "--listen", endpoint, "--data", "ball=" + ball_});
  }
  std::vector<pid_t> Pids() const {
    const Json status = Json::Parse(MustRun({"status", "--json"}).out).value();
    std::vector<pid_t> pids = {status["pid"].get<pid_t>()};
    for (const Json& worker : status["workers"]) pids.push_back(worker["pid"].get<pid_t>());
    return pids;
  }

  std::string ball_, endpoint_;
};

TEST_F(ServiceTest, RendersTheSamePictureAsThisProcessAlone) {
  EXPECT_THAT(Up(endpoint_).out, AllOf(HasSubstr("slabstream is up at " + endpoint_), HasSubstr("slabstream render")));
  const Json before = Json::Parse(MustRun({"status", "--json", "--endpoint", endpoint_}).out).value();
  EXPECT_EQ(before["workers"].size(), 2U);
  EXPECT_EQ(before["datasets"][0]["name"], "ball");
  EXPECT_EQ(before["datasets"][0]["state"], "unloaded");

  // Without --endpoint the service that was started last is meant.
  MustRun({"render", "ball", "-o", "service.exr", "--size", "64"});
  MustRun({"render", ball_, "--local=1", "-o", "local.exr", "--size", "64"});
  EXPECT_LE(LargestDifference(ReadPicture(Path("service.exr")), ReadPicture(Path("local.exr"))), 2e-5 + 1.0 / 1024);

  const Json after = Json::Parse(MustRun({"status", "--json"}).out).value();
  EXPECT_EQ(after["frames_done"], 1);
  EXPECT_EQ(after["datasets"][0]["size"], (Json{32, 32, 32}));
  EXPECT_THAT(MustRun({"status"}).out, AllOf(HasSubstr("workers      2"), HasSubstr("ball ready 32 x 32 x 32")));
}

// To the last byte, with annotations and record: the service sends what they need, and neither says where a picture was made.
TEST_F(ServiceTest, PictureFilesDoNotTellWhereTheyWereMade) {
  MustRun({"up", "--detach", "--workers", "2", "--listen", endpoint_, "--data", "ball.nrrd=" + ball_});
  const std::vector<std::string> options = {"--size",      "200",         "--renderer", "zbuffer",     "--projection",
                                            "perspective", "--elevation", "20",         "--scale-bar", "--orientation-marker",
                                            "--title",     "A ball"};
  const auto render = [&](const std::string& output, std::vector<std::string> more) {
    std::vector<std::string> arguments = {"render", "ball.nrrd", "-o", output};
    arguments.insert(arguments.end(), options.begin(), options.end());
    arguments.insert(arguments.end(), more.begin(), more.end());
    MustRun(arguments);
    return ReadFile(output);
  };
  for (const std::string ending : {".png", ".exr"}) {
    const std::string at_service = render("a" + ending, {});
    EXPECT_TRUE(render("b" + ending, {"--local=3", "--threads", "1"}) == at_service) << ending;
    EXPECT_TRUE(render("c" + ending, {"--endpoint", endpoint_}) == at_service) << ending;
    for (const std::string& place : {directory_, endpoint_, std::string("b.png")}) EXPECT_EQ(at_service.find(place), std::string::npos);
  }
}

TEST_F(ServiceTest, NeitherThreadsNorPackingChangeThePicture) {
  MustRun({"up", "--detach", "--workers", "1", "--threads", "3", "--compress", "--listen", endpoint_, "--data", "ball=" + ball_});
  EXPECT_EQ(Json::Parse(MustRun({"status", "--json"}).out).value()["workers"][0]["threads"], 3);
  MustRun({"render", "ball", "-o", "service.exr", "--size", "64"});
  MustRun({"render", ball_, "--local=1", "--threads", "1", "-o", "local.exr", "--size", "64"});
  EXPECT_EQ(LargestDifference(ReadPicture(Path("service.exr")), ReadPicture(Path("local.exr"))), 0);
}

TEST_F(ServiceTest, DownEndsTheWorkersOfACoordinatorThatWasKilledAndKeepsTheLogs) {
  Up(endpoint_);
  const std::vector<pid_t> pids = Pids();
  ASSERT_EQ(::kill(pids.front(), SIGKILL), 0);
  const ProgramResult render = Slabstream({"render", "ball", "-o", "a.png", "--endpoint", endpoint_});
  EXPECT_EQ(render.exit_status, 1);
  ::setenv("SLABSTREAM_ENDPOINT", "ipc:///nobody/here", 1);  // another service is meant
  EXPECT_EQ(Slabstream({"down"}).exit_status, 1);
  ::unsetenv("SLABSTREAM_ENDPOINT");
  for (std::size_t i = 1; i < pids.size(); ++i) EXPECT_TRUE(Runs(pids[i]));
  const std::string down = MustRun({"down"}).out;
  EXPECT_THAT(down, AllOf(HasSubstr("had already ended; stopped its 2 workers"), HasSubstr("logs are in ")));
  for (const pid_t pid : pids) EXPECT_FALSE(Runs(pid));
  const std::size_t begin = down.find("logs are in ") + 12;
  EXPECT_TRUE(std::filesystem::exists(down.substr(begin, down.find('\n') - begin) + "/coordinator.log"));
  EXPECT_EQ(Slabstream({"down"}).exit_status, 1);
}

TEST_F(ServiceTest, TooFewFilesAreToldBeforeItIsReady) {
  rlimit few{}, before{};
  ASSERT_EQ(::getrlimit(RLIMIT_NOFILE, &before), 0);
  few = {24, before.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &few), 0);
  Up(endpoint_);  // more are allowed, so it takes more
  MustRun({"down"});
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &before), 0);
  const std::string shell = "ulimit -n 24 && exec \"$0\" \"$@\"";
  std::vector<std::string> command = Command({"up", "--detach", "--workers", "1", "--listen", endpoint_});
  command.insert(command.begin(), {"/bin/sh", "-c", shell});
  const ProgramResult up = RunningProgram(command, directory_).Wait();
  EXPECT_EQ(up.exit_status, 1);
  EXPECT_THAT(up.err, HasSubstr("this process may open 24 files and sockets, but needs at least 128 (ulimit -n)"));
}

TEST_F(ServiceTest, SocketFilesOfKilledWorkersAreRemoved) {
  Up(endpoint_);
  for (const pid_t pid : Pids()) ::kill(pid, SIGKILL);
  const auto sockets = [&] {
    int count = 0;
    for (const auto& entry : std::filesystem::directory_iterator(directory_)) count += entry.is_socket();
    return count;
  };
  EXPECT_GT(sockets(), 3) << "those of the coordinator, and one of each worker";
  MustRun({"down"});
  Up(endpoint_);
  MustRun({"down"});
  EXPECT_EQ(sockets(), 0);
}

TEST_F(ServiceTest, AFullDiskEndsATurntableAndKeepsTheOlderPictures) {
  Up(endpoint_);
  MustRun({"turntable", "ball", "--frames", "2", "-o", "f%d.png", "--size", "64"});
  const std::string before = ReadFile("f0.png");
  const ProgramResult result = OnFullDisk(1000, [&] {
    return Slabstream({"turntable", "ball", "--frames", "2", "-o", "f%d.png", "--size", "64", "--azimuth", "45"});
  });
  EXPECT_EQ(result.exit_status, 1);
  EXPECT_EQ(result.out, "");
  // Two frames are in flight, and either may be the first to be written.
  EXPECT_THAT(result.err, testing::ContainsRegex("cannot write 'f[01].png': File too large"));
  EXPECT_EQ(ReadFile("f0.png"), before);
  EXPECT_EQ(Files(), (std::vector<std::string>{"ball.nrrd", "f0.png", "f1.png"}));
}

TEST_F(ServiceTest, VoxelsStayWithTheWorkersAcrossClients) {
  Up(endpoint_);
  MustRun({"render", "ball", "-o", "a.png", "--size", "64", "--stats", "first.json"});
  MustRun({"render", "ball", "-o", "b.png", "--size", "64", "--azimuth", "70", "--stats", "second.json"});
  EXPECT_GT(Json::Parse(ReadFile("first.json")).value()["bytes"]["voxels"].get<double>(), 0);
  EXPECT_EQ(Json::Parse(ReadFile("second.json")).value()["bytes"]["voxels"], 0);
}

TEST_F(ServiceTest, DownLeavesNothingBehind) {
  Up(endpoint_);
  const std::vector<pid_t> pids = Pids();
  ASSERT_EQ(pids.size(), 3U);
  for (const pid_t pid : pids) EXPECT_TRUE(Runs(pid));
  EXPECT_THAT(MustRun({"down"}).out, HasSubstr("is down (2 workers)"));
  for (const pid_t pid : pids) EXPECT_FALSE(Runs(pid)) << pid;
  EXPECT_TRUE(std::filesystem::is_empty(Path("slabstream")));

  const ProgramResult again = Slabstream({"down", "--endpoint", endpoint_});
  EXPECT_EQ(again.exit_status, 1);
  EXPECT_THAT(again.err_lines(), testing::ElementsAre("slabstream down: no service runs at " + endpoint_));
}

// None is named, and this user has started none: no command asks whoever listens at the usual port, or waits for somebody.
TEST_F(ServiceTest, WithoutAServiceEachCommandSaysSoInALine) {
  for (const std::vector<std::string>& command : {std::vector<std::string>{"status"},
                                                  {"down"},
                                                  {"render", "ball", "-o", "x.png"},
                                                  {"turntable", "ball", "--frames", "2", "-o", "x%d.png"},
                                                  {"value", "ball", "--at", "1,1,1"},
                                                  {"measure", "ball", "--distance", "0,0,0:1,1,1"},
                                                  {"view", "ball", "--no-browser"},
                                                  {"data", "list"},
                                                  {"data", "add", "x=" + ball_},
                                                  {"data", "remove", "ball"},
                                                  {"steer", "ball"},
                                                  {"keys", "list"}}) {
    const ProgramResult result = Slabstream(command);
    EXPECT_EQ(result.exit_status, 1) << command[0];
    EXPECT_THAT(result.err_lines(), testing::ElementsAre(testing::AnyOf(
                                        HasSubstr("no service is named, and `slabstream up` of this user has started none here"),
                                        HasSubstr("no service runs here"))))
        << command[0];
    EXPECT_EQ(result.out, "") << command[0];
  }
  RunningProgram gateway({Command({}).front() + "-gateway"}, directory_);
  const ProgramResult refused = gateway.Wait();
  EXPECT_EQ(refused.exit_status, 1);
  EXPECT_THAT(refused.err_lines(), testing::ElementsAre(HasSubstr("slabstream-gateway: no service is named")));
}

// A port or a path where nobody listens refuses at once, which the answer tells: else it would be that nobody answers within 4 s.
TEST_F(ServiceTest, StatusAndDownDoNotWaitWhereNobodyListens) {
  const LoopbackListener listener = ListenOnLoopback();
  ::close(listener.socket);
  for (const std::string& endpoint :
       {"tcp://127.0.0.1:" + std::to_string(listener.port), "tcp://localhost:" + std::to_string(listener.port), endpoint_}) {
    for (const std::string command : {"status", "down"}) {
      const ProgramResult result = Slabstream({command, "--endpoint", endpoint});
      EXPECT_EQ(result.exit_status, 1);
      EXPECT_THAT(result.err_lines(), testing::ElementsAre("slabstream " + command + ": no service runs at " + endpoint));
    }
  }
}

TEST_F(ServiceTest, DownEndsProcessesThatDoNotAnswer) {
  Up(endpoint_);
  const std::vector<pid_t> pids = Pids();
  for (const pid_t pid : pids) ASSERT_EQ(::kill(pid, SIGSTOP), 0);
  MustRun({"down"});
  for (const pid_t pid : pids) EXPECT_FALSE(Runs(pid)) << pid;
}

TEST_F(ServiceTest, TwoServicesLiveSideBySide) {
  Up(endpoint_);
  const std::string text = Up("tcp://127.0.0.1:*").out;
  const std::string prefix = "slabstream is up at ";
  ASSERT_EQ(text.rfind(prefix, 0), 0U) << text;
  const std::string second = text.substr(prefix.size(), text.find(' ', prefix.size()) - prefix.size());
  MustRun({"render", "ball", "--endpoint", second, "-o", "a.png", "--size", "32"});
  MustRun({"down", "--endpoint", second});
  EXPECT_EQ(Slabstream({"status", "--endpoint", second}).exit_status, 1);
  MustRun({"render", "ball", "--endpoint", endpoint_, "-o", "b.png", "--size", "32"});
}

TEST_F(ServiceTest, ASecondUpOnTheSameEndpointSaysSo) {
  Up(endpoint_);
  const std::vector<pid_t> before = Pids();
  const ProgramResult second = Slabstream({"up", "--detach", "--listen", endpoint_});
  EXPECT_EQ(second.exit_status, 1);
  ASSERT_EQ(second.err_lines().size(), 1U) << second.err;
  EXPECT_THAT(second.err, HasSubstr("a service runs at " + endpoint_ + " already"));
  EXPECT_EQ(Pids(), before);
}

TEST_F(ServiceTest, AWorkerThatIsKilledIsStartedAgainAndDownEndsItToo) {
  Up(endpoint_);
  const std::vector<pid_t> before = Pids();
  ASSERT_EQ(::kill(before.back(), SIGKILL), 0);
  std::vector<pid_t> after;
  for (const auto limit = std::chrono::steady_clock::now() + std::chrono::minutes(1); std::chrono::steady_clock::now() < limit;) {
    after = Pids();
    if (after.size() == 3 && std::ranges::find(after, before.back()) == after.end()) break;
  }
  ASSERT_EQ(after.size(), 3U);
  EXPECT_EQ(std::ranges::find(after, before.back()), after.end());
  MustRun({"render", "ball", "-o", "a.png", "--size", "32"});
  MustRun({"down"});
  for (const pid_t pid : after) EXPECT_FALSE(Runs(pid)) << pid;
}

TEST_F(ServiceTest, LimitsOfMemoryAreSharedOutAndShown) {
  MustRun({"up", "--detach", "--workers", "2", "--memory", "3GiB", "--listen", endpoint_, "--data", "ball=" + ball_});
  const Json status = Json::Parse(MustRun({"status", "--json"}).out).value();
  EXPECT_EQ(status["memory_bytes"], 1 << 30);
  for (const Json& worker : status["workers"]) EXPECT_EQ(worker["memory_bytes"], 1 << 30);
  EXPECT_THAT(MustRun({"status"}).out, HasSubstr("memory limit 1024 MiB"));
  const ProgramResult too_large = Slabstream({"render", "ball", "-o", "a.png", "--size", "8192", "--renderer", "raycast"});
  EXPECT_EQ(too_large.exit_status, 1);
  EXPECT_THAT(too_large.err, AllOf(HasSubstr("size 8192x8192 needs"), HasSubstr("limit 1024 MiB")));
  MustRun({"down"});
  const ProgramResult too_little = Slabstream({"up", "--detach", "--workers", "2", "--memory", "512MiB", "--listen", endpoint_});
  EXPECT_EQ(too_little.exit_status, 2);
  EXPECT_THAT(too_little.err, HasSubstr("memory 512 MiB is too little for a coordinator and 2 workers, which need 768 MiB"));
  MustRun({"up", "--detach", "--memory", "1G", "--listen", endpoint_});
  EXPECT_EQ(Json::Parse(MustRun({"status", "--json"}).out).value()["workers"].size(), 1) << "with any number of cores";
}

TEST_F(ServiceTest, InTheForegroundCtrlCEndsEverything) {
  RunningProgram up(Command({"up", "--workers", "2", "--listen", endpoint_, "--data", "ball=" + ball_}), directory_);
  ASSERT_TRUE(up.WaitForOutput("Ctrl-C ends it."));
  const std::vector<pid_t> pids = Pids();
  up.Signal(SIGINT);
  EXPECT_EQ(up.Wait().exit_status, 0);
  for (const pid_t pid : pids) EXPECT_FALSE(Runs(pid)) << pid;
  EXPECT_TRUE(std::filesystem::is_empty(Path("slabstream")));
}

TEST_F(ServiceTest, InTheForegroundItEndsWithDownAndTellsOfLostWorkers) {
  RunningProgram up(Command({"up", "--workers", "2", "--listen", endpoint_, "--data", "ball=" + ball_}), directory_);
  ASSERT_TRUE(up.WaitForOutput("Ctrl-C ends it."));
  ASSERT_EQ(::kill(Pids().back(), SIGKILL), 0);
  EXPECT_TRUE(up.WaitForError("was killed by signal 9"));
  MustRun({"render", "ball", "-o", "a.png", "--size", "32"});
  MustRun({"down"});
  EXPECT_EQ(up.Wait().exit_status, 0);
}

TEST_F(ServiceTest, UpThatCannotStartSaysWhyAndLeavesNothingBehind) {
  const std::vector<std::vector<std::string>> cases = {{"--data", "ball=" + Path("missing.nrrd")},
                                                       {"--data", "a/b=" + ball_},
                                                       {"--data", "ball=" + ball_, "--data", "ball=" + ball_},
                                                       {"--listen", "tcp://10.1.2.3:7420"},
                                                       {"--workers", "0"}};
  for (const auto& more : cases) {
    std::vector<std::string> arguments = {"up", "--detach"};
    if (more.front() != "--listen") arguments.insert(arguments.end(), {"--listen", endpoint_});
    arguments.insert(arguments.end(), more.begin(), more.end());
    const ProgramResult result = Slabstream(arguments);
    EXPECT_EQ(result.exit_status, 2) << more.back() << ": " << result.err;
    EXPECT_EQ(result.err_lines().size(), 1U) << result.err;
    EXPECT_TRUE(!std::filesystem::exists(Path("slabstream")) || std::filesystem::is_empty(Path("slabstream"))) << more.back();
  }
}

TEST_F(ServiceTest, UpTellsOfEachFileThatCannotBeReadBeforeItStartsAnything) {
  std::ofstream(Path("text.nrrd")) << "no volume";
  const ProgramResult named = Slabstream({"up", "--detach", "--listen", endpoint_, "--data", "a=" + Path("text.nrrd"), "--data",
                                          "ball=" + ball_, "--data", "b=" + Path("missing.nrrd")});
  EXPECT_EQ(named.exit_status, 2);
  EXPECT_THAT(named.err_lines(),
              testing::UnorderedElementsAre(AllOf(HasSubstr("slabstream up: "), HasSubstr("text.nrrd: not a NRRD volume")),
                                            AllOf(HasSubstr("slabstream up: "), HasSubstr("missing.nrrd"), HasSubstr("does not exist"))));
  EXPECT_FALSE(std::filesystem::exists(Path("slabstream")));

  std::filesystem::create_directory(Path("inbox"));
  std::filesystem::rename(Path("text.nrrd"), Path("inbox/text.nrrd"));
  const ProgramResult watched = MustRun({"up", "--detach", "--workers", "1", "--listen", endpoint_, "--data", Path("inbox")});
  EXPECT_THAT(watched.err_lines(),
              testing::ElementsAre(AllOf(HasSubstr("slabstream up: warning: "), HasSubstr("text.nrrd: not a NRRD volume"))));
  const ProgramResult render = Slabstream({"render", "text", "-o", "a.png"});
  EXPECT_EQ(render.exit_status, 2);
  EXPECT_THAT(render.err, HasSubstr("text.nrrd: not a NRRD volume"));
}

TEST_F(ServiceTest, DataAddsListsReloadsAndRemoves) {
  Up(endpoint_);
  std::filesystem::create_directory(Path("inbox"));
  const std::string other = MakeSphere("other.nrrd", 2, 24);
  EXPECT_THAT(MustRun({"data", "add", "other=" + other, Path("inbox")}).out, AllOf(HasSubstr("ball"), HasSubstr("other")));
  std::filesystem::copy_file(other, Path("inbox/dropped.nrrd"));
  MustRun({"render", "dropped", "-o", "a.png", "--size", "32"});
  const Json list = Json::Parse(MustRun({"data", "list", "--json"}).out).value();
  ASSERT_EQ(list.size(), 3U);
  EXPECT_EQ(list[1]["name"], "dropped");
  EXPECT_EQ(list[1]["state"], "ready");
  EXPECT_EQ(list[1]["size"], (Json{24, 24, 24}));
  EXPECT_EQ(list[1]["type"], "uint8");
  EXPECT_EQ(list[1]["spacing"], (Json{1, 1, 1}));
  EXPECT_GT(list[1]["memory_bytes"].get<double>(), 0);
  EXPECT_EQ(list[2]["state"], "unloaded");
  EXPECT_THAT(MustRun({"data", "list"}).out, testing::ContainsRegex("dropped +ready +[0-9]+ s +24 x 24 x 24 +uint8 +1 x 1 x 1 +"));
  MustRun({"data", "reload", "dropped", "ball"});
  EXPECT_EQ(Json::Parse(MustRun({"data", "list", "--json"}).out).value()[1]["state"], "unloaded");
  EXPECT_EQ(Json::Parse(MustRun({"data", "remove", "other", Path("inbox"), "--json"}).out).value().size(), 1U);
  EXPECT_EQ(Slabstream({"render", "dropped", "-o", "a.png"}).exit_status, 2);

  const ProgramResult unknown = Slabstream({"data", "remove", "ball", "nonesuch"});
  EXPECT_EQ(unknown.exit_status, 2);
  EXPECT_THAT(unknown.err_lines(), testing::ElementsAre("slabstream data: no dataset \"nonesuch\": the catalogue has ball"));
}

TEST_F(ServiceTest, SteerChangesParametersOfASimulation) {
  Up(endpoint_);
  RunningProgram simulation({SLABSTREAM_STEERED_SIMULATION, endpoint_, "rho"}, directory_);
  const auto known = [&] { return Slabstream({"steer", "rho", "--json"}); };
  ProgramResult told = known();
  for (const auto end = std::chrono::steady_clock::now() + kProgramTimeout;
       told.exit_status != 0 && std::chrono::steady_clock::now() < end;) {
    told = known();
  }
  ASSERT_EQ(told.exit_status, 0) << told.err;
  EXPECT_EQ(Json::Parse(told.out).value()["parameters"][0], (Json{{"name", "level"}, {"value", 100}, {"least", 0}, {"most", 250}}));
  EXPECT_THAT(MustRun({"steer", "rho", "level=200", "unused=-0.5"}).out,
              testing::ContainsRegex("time [0-9]+, simulated [0-9.]+\nNAME .*\nlevel +200 +0 +250\nunused +-0.5 +-1 +1\n"));
  EXPECT_EQ(Json::Parse(known().out).value()["parameters"][1]["value"], -0.5);
  for (const auto& [arguments, why] : std::vector<std::pair<std::vector<std::string>, std::string>>{
           {{"rho", "level=251"}, "\"rho\": level is 251, must be in [0, 250]"},
           {{"rho", "lever=1"}, "\"rho\" has no parameter 'lever', must be one of: level, unused"},
           {{"rho", "level=high"}, "steer level 'high' is not a number"},
           {{"ball", "level=1"}, "\"ball\": no simulation holds it"},
           {{"nonesuch"}, "no dataset \"nonesuch\""}}) {
    std::vector<std::string> command = {"steer"};
    command.insert(command.end(), arguments.begin(), arguments.end());
    const ProgramResult refused = Slabstream(command);
    EXPECT_EQ(refused.exit_status, 2);
    EXPECT_THAT(refused.err_lines(), testing::ElementsAre("slabstream steer: " + why));
  }
}

TEST_F(ServiceTest, LogsTellWhatHappenedInOrder) {
  MakeSphere("other.nrrd", 2, 16);
  Up(endpoint_);
  MustRun({"render", "ball", "-o", "a.png", "--size", "64"});
  EXPECT_EQ(Slabstream({"render", "nonesuch", "-o", "a.png"}).exit_status, 2);
  const std::string all = MustRun({"logs"}).out;
  std::size_t at = 0;
  for (const char* const line : {"] worker ", "is here: pid", "dataset \"ball\" is loaded: 32 x 32 x 32 voxels", "frame 1 of client",
                                 ": dataset ball, splat, 64x64, ", "attempts 1: done", "is refused: no dataset \"nonesuch\""}) {
    at = all.find(line, at);
    ASSERT_NE(at, std::string::npos) << line << " is missing or out of order in\n" << all;
  }
  EXPECT_THAT(all, AllOf(HasSubstr("[coordinator] "), HasSubstr("registered as worker 1"), HasSubstr("registered as worker 2")));
  EXPECT_EQ(MustRun({"logs", "--since", "1h"}).out, MustRun({"logs"}).out);
  // Lines of what comes, and what is there already.
  RunningProgram follow(Command({"logs", "--follow"}), directory_);
  ASSERT_TRUE(follow.WaitForOutput("frame 1 of client"));
  MustRun({"render", "ball", "-o", "a.png", "--size", "48"});
  ASSERT_TRUE(follow.WaitForOutput("splat, 48x48, "));
  MustRun({"down"});
  EXPECT_EQ(follow.Wait().exit_status, 0);
  const ProgramResult none = Slabstream({"logs"});
  EXPECT_EQ(none.exit_status, 1);
  EXPECT_THAT(none.err_lines(),
              testing::ElementsAre(HasSubstr("slabstream logs: `slabstream up` of this user started no service on this host")));
}

TEST_F(ServiceTest, TheLogLevelIsThatOfAllProcesses) {
  MustRun({"up", "--detach", "--workers", "1", "--listen", endpoint_, "--data", "ball=" + ball_, "--log-level", "warning"});
  MustRun({"render", "ball", "-o", "a.png", "--size", "32", "--log-level", "debug"});
  EXPECT_EQ(MustRun({"logs"}).out, "");
}

TEST_F(ServiceTest, StatusTellsOfRefusedRequests) {
  Up(endpoint_);
  EXPECT_EQ(Slabstream({"render", "nonesuch", "-o", "a.png"}).exit_status, 2);
  const Json status = Json::Parse(MustRun({"status", "--json"}).out).value();
  EXPECT_EQ(status["frames_failed"], 0);
  EXPECT_EQ(status["requests_refused"], (Json{{"bad_request", 0}, {"unknown_dataset", 1}, {"too_large", 0}, {"over_quota", 0}}));
  EXPECT_THAT(MustRun({"status"}).out, HasSubstr("requests     1 refused (0 bad, 1 of unknown datasets, 0 too large, 0 over quota)"));
}

TEST_F(ServiceTest, AnUnknownDatasetIsBadInputAndTheOthersAreNamed) {
  Up(endpoint_);
  const ProgramResult result = Slabstream({"render", "brain", "-o", "a.png"});
  EXPECT_EQ(result.exit_status, 2);
  ASSERT_EQ(result.err_lines().size(), 1U) << result.err;
  EXPECT_THAT(result.err, AllOf(HasSubstr("slabstream render: "), HasSubstr("brain"), HasSubstr("ball")));
}

TEST_F(ServiceTest, AnEndpointWhereNobodyAnswersIsToldSoon) {
  for (const std::vector<std::string>& arguments : std::vector<std::vector<std::string>>{
           {"render", "ball", "-o", "a.png"}, {"status"}, {"turntable", "ball", "--frames", "2", "-o", "%d.png"}}) {
    std::vector<std::string> all = arguments;
    all.insert(all.end(), {"--endpoint", endpoint_});
    const ProgramResult result = Slabstream(all);
    EXPECT_EQ(result.exit_status, 1);
    ASSERT_EQ(result.err_lines().size(), 1U) << result.err;
    EXPECT_THAT(result.err, HasSubstr(endpoint_));
  }
}

}  // namespace
}  // namespace slabstream
