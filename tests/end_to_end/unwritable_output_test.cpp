// Standard output that cannot be written, as on a full disk: every program says so in one line and exits with 1.
#include <filesystem>
#include <sstream>

#include "tests/end_to_end/program.h"

namespace slabstream {
namespace {

class UnwritableOutputTest : public EndToEndTest {
 protected:
  // Runs a program of the folder of slabstream with a standard output that takes no byte.
  ProgramResult Run(const std::string& program, const std::vector<std::string>& arguments) const {
    const std::filesystem::path folder = std::filesystem::path(Command({}).front()).parent_path();
    std::vector<std::string> command = {"/bin/sh", "-c", "exec \"$0\" \"$@\" > /dev/full", folder / program};
    command.insert(command.end(), arguments.begin(), arguments.end());
    return RunningProgram(command, directory_).Wait();
  }

  void ExpectFailure(const std::string& program, const std::vector<std::string>& arguments) const {
    SCOPED_TRACE(program + " " + testing::PrintToString(arguments));
    const ProgramResult result = Run(program, arguments);
    EXPECT_EQ(result.exit_status, 1);
    ASSERT_EQ(result.err_lines().size(), 1U) << result.err;
    EXPECT_TRUE(result.err.starts_with(program)) << result.err;
    EXPECT_NE(result.err.find("standard output cannot be written"), std::string::npos) << result.err;
  }
};

TEST_F(UnwritableOutputTest, HelpAndVersions) {
  for (const std::string program : {"slabstream", "slabstream-coordinator", "slabstream-worker", "slabstream-gateway"}) {
    ExpectFailure(program, {"--help"});
    ExpectFailure(program, {"--version"});
  }
  EXPECT_NE(Run("slabstream", {"--help"}).err.find("written: No space left on device"), std::string::npos);
  std::istringstream commands(MustRun({"help"}).out.substr(MustRun({"help"}).out.find("Commands:")));
  int count = 0;
  for (std::string line; std::getline(commands, line) && !line.starts_with("Examples:");) {
    std::istringstream words(line);
    std::string name;
    if (!line.starts_with("  ") || line.starts_with("   ") || !(words >> name)) continue;
    ExpectFailure("slabstream", {name, "--help"});
    ExpectFailure("slabstream", {"options", name});
    ++count;
  }
  EXPECT_GT(count, 15);
}

TEST_F(UnwritableOutputTest, Commands) {
  const std::string sphere = MakeSphere("sphere.nrrd", 1, 16);
  MustRun({"render", sphere, "--local=1", "--size", "16", "-o", "picture.png"});
  const std::vector<std::vector<std::string>> commands = {
      {"info", sphere},
      {"info", sphere, "--json"},
      {"info", "picture.png"},
      {"info", "picture.png", "--json"},
      {"transfer", "gray-ramp", sphere},
      {"sphere", "--class", "1", "--size", "8", "-o", "other.nrrd"},
      {"convert", sphere, "copy.mha"},
      {"render", sphere, "--local=1", "--size", "16", "-o", "again.png"},
      {"slice", sphere, "--local=1", "-o", "slice.png"},
      {"turntable", sphere, "--local=1", "--size", "16", "--frames", "2", "-o", "frame_%d.png"},
      {"experiment", "--list"},
      {"bench", "--list"},
      {"up", "--listen", "tcp://127.0.0.1:*", "--workers", "1"},
      {"up", "--listen", "tcp://127.0.0.1:*", "--workers", "1", "--detach"},
      {"view", sphere, "--no-browser"},
  };
  for (const std::vector<std::string>& command : commands) ExpectFailure("slabstream", command);
  // Whoever reads the ports of a coordinator waits for a line that never comes: it does not go on.
  ExpectFailure("slabstream-coordinator", {"--listen", "tcp://127.0.0.1:*"});
}

TEST_F(UnwritableOutputTest, QuestionsToAService) {
  const std::string sphere = MakeSphere("sphere.nrrd", 1, 16);
  MustRun({"up", "--detach", "--workers", "1", "--listen", "tcp://127.0.0.1:*", "--data", "sphere=" + sphere});
  const std::vector<std::vector<std::string>> commands = {
      {"status"}, {"status", "--json"}, {"data", "list"}, {"data", "list", "--json"}, {"value", "sphere", "--at", "8,8,8"},
      {"logs"},   {"logs", "--follow"},
  };
  for (const std::vector<std::string>& command : commands) ExpectFailure("slabstream", command);
  ExpectFailure("slabstream-gateway", {});
  ExpectFailure("slabstream", {"down"});
}

}  // namespace
}  // namespace slabstream
