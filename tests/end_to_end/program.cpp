#include "tests/end_to_end/program.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <iterator>
#include <sstream>

#include "common/base/check.h"
#include "tests/support/whole_file.h"

namespace slabstream {

std::vector<std::string> ProgramResult::err_lines() const {
  std::istringstream stream(err);
  std::vector<std::string> lines;
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

RunningProgram::RunningProgram(const std::vector<std::string>& command, const std::string& directory) {
  std::vector<char*> arguments;
  for (const std::string& argument : command) arguments.push_back(const_cast<char*>(argument.c_str()));
  arguments.push_back(nullptr);
  int out[2], err[2];
  CHECK(::pipe2(out, O_CLOEXEC) == 0 && ::pipe2(err, O_CLOEXEC) == 0);
  pid_ = ::fork();
  CHECK_GE(pid_, 0);
  if (pid_ == 0) {
    ::dup2(::open("/dev/null", O_RDONLY), STDIN_FILENO);
    ::dup2(out[1], STDOUT_FILENO);
    ::dup2(err[1], STDERR_FILENO);
    if (::chdir(directory.c_str()) == 0) ::execv(arguments[0], arguments.data());
    ::_exit(127);
  }
  ::close(out[1]);
  ::close(err[1]);
  out_ = out[0];
  err_ = err[0];
}

RunningProgram::~RunningProgram() {
  if (pid_ > 0) {
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
  }
  ::close(out_);
  ::close(err_);
}

void RunningProgram::Signal(int signal) const { CHECK_EQ(::kill(pid_, signal), 0); }

bool RunningProgram::Pump(int timeout_ms) {
  pollfd descriptors[] = {{out_, POLLIN, 0}, {err_, POLLIN, 0}};
  std::string* texts[] = {&result_.out, &result_.err};
  ::poll(descriptors, 2, timeout_ms);
  for (int i = 0; i < 2; ++i) {
    if (descriptors[i].revents == 0) continue;
    char buffer[4096];
    const ssize_t count = ::read(descriptors[i].fd, buffer, sizeof buffer);
    if (count > 0) {
      texts[i]->append(buffer, std::size_t(count));
    } else {
      int& descriptor = i == 0 ? out_ : err_;
      ::close(descriptor);
      descriptor = -1;  // poll passes over it
    }
  }
  return out_ >= 0 || err_ >= 0;
}

bool RunningProgram::WaitForText(const std::string& collected, const std::string& text) {
  const auto deadline = std::chrono::steady_clock::now() + kProgramTimeout;
  while (collected.find(text) == std::string::npos) {
    if (std::chrono::steady_clock::now() > deadline || !Pump(100)) return false;
  }
  return true;
}

bool RunningProgram::WaitForOutput(const std::string& text) { return WaitForText(result_.out, text); }
bool RunningProgram::WaitForError(const std::string& text) { return WaitForText(result_.err, text); }

ProgramResult RunningProgram::Wait() {
  const auto deadline = std::chrono::steady_clock::now() + kProgramTimeout;
  while (Pump(100)) {
    if (std::chrono::steady_clock::now() > deadline) ::kill(pid_, SIGKILL);
  }
  int how = 0;
  CHECK_EQ(::waitpid(pid_, &how, 0), pid_);
  pid_ = -1;
  result_.exit_status = WIFEXITED(how) ? WEXITSTATUS(how) : 128 + WTERMSIG(how);
  return result_;
}

EndToEndTest::EndToEndTest() {
  ::setenv("XDG_RUNTIME_DIR", directory_.c_str(), 1);
  ::setenv("XDG_CACHE_HOME", (directory_ + "/cache").c_str(), 1);
  ::unsetenv("SLABSTREAM_ENDPOINT");
}

EndToEndTest::~EndToEndTest() {
  if (std::filesystem::exists(directory_ + "/slabstream")) Slabstream({"down"});
}

std::vector<std::string> EndToEndTest::Command(std::vector<std::string> arguments) const {
  arguments.insert(arguments.begin(), SLABSTREAM_PROGRAM);
  return arguments;
}

ProgramResult EndToEndTest::Slabstream(std::vector<std::string> arguments) const {
  return RunningProgram(Command(std::move(arguments)), directory_).Wait();
}

ProgramResult EndToEndTest::MustRun(std::vector<std::string> arguments) const {
  const std::string name = arguments.front();
  ProgramResult result = Slabstream(std::move(arguments));
  EXPECT_EQ(result.exit_status, 0) << name << ": " << result.err;
  return result;
}

void EndToEndTest::ExpectRefused(const std::vector<std::string>& arguments, const std::string& why) const {
  std::string shown;
  for (const std::string& argument : arguments) shown += argument + " ";
  const std::vector<std::string> files = Files();
  const ProgramResult result = Slabstream(arguments);
  EXPECT_EQ(result.exit_status, 2) << shown << "\n" << result.err;
  EXPECT_EQ(result.err_lines().size(), 1U) << shown << "\n" << result.err;
  EXPECT_TRUE(result.err.starts_with("slabstream")) << shown << "\n" << result.err;
  EXPECT_NE(result.err.find(why), std::string::npos) << shown << "\nmust say: " << why << "\nbut says: " << result.err;
  EXPECT_EQ(result.out, "") << shown;
  EXPECT_EQ(Files(), files) << shown;
}

void EndToEndTest::ExpectEachRefused(const std::vector<std::string>& beginning, const std::vector<Refusal>& refusals) const {
  for (const auto& [more, why] : refusals) {
    std::vector<std::string> arguments = beginning;
    arguments.insert(arguments.end(), more.begin(), more.end());
    ExpectRefused(arguments, why);
  }
}

std::string EndToEndTest::MakeSphere(const std::string& name, int sphere_class, int size) const {
  MustRun({"sphere", "--class", std::to_string(sphere_class), "--size", std::to_string(size), "--occupancy",
           sphere_class == 1 ? "0.05" : "0.3", "-o", name});
  return Path(name);
}

std::string EndToEndTest::ReadFile(const std::string& name) const { return slabstream::ReadFile(Path(name)); }

std::vector<std::string> EndToEndTest::Files() const {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(directory_)) {
    if (entry.is_regular_file()) names.push_back(entry.path().filename());
  }
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace slabstream
