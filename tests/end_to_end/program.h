// Runs the programs under test and keeps what they leave behind in a directory that vanishes with the test.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/types.h>

#include <chrono>
#include <string>
#include <vector>

#include "tests/support/temporary_directory.h"

namespace slabstream {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

struct ProgramResult {
  int exit_status = -1;  // 128 + signal if a signal ended it, as shells count
  std::string out, err;
  std::vector<std::string> err_lines() const;
};

// The bound on everything that a test waits for: far above what is needed, so that only a hang meets it.
inline constexpr std::chrono::seconds kProgramTimeout{120};

// A program that was started and not waited for yet. The destructor kills it.
class RunningProgram {
 public:
  RunningProgram(const std::vector<std::string>& command, const std::string& directory);
  ~RunningProgram();
  RunningProgram(const RunningProgram&) = delete;
  RunningProgram& operator=(const RunningProgram&) = delete;

  pid_t pid() const { return pid_; }
  // Reads stdout (or stderr) until `text` appears in it; false if the program ends first or the time is over.
  bool WaitForOutput(const std::string& text);
  bool WaitForError(const std::string& text);
  void Signal(int signal) const;
  // To its end; after kProgramTimeout it is killed, which the exit status shows.
  ProgramResult Wait();

 private:
  bool Pump(int timeout_ms);  // false: both outputs are closed
  bool WaitForText(const std::string& collected, const std::string& text);

  pid_t pid_ = -1;
  int out_ = -1, err_ = -1;
  ProgramResult result_;
};

// A test with a directory of its own. Programs run there, and their service state is kept there.
class EndToEndTest : public testing::Test {
 protected:
  EndToEndTest();
  ~EndToEndTest() override;  // ends a service that is still up

  std::string Path(const std::string& name) const { return directory_ + "/" + name; }
  std::vector<std::string> Command(std::vector<std::string> arguments) const;  // slabstream and its arguments
  ProgramResult Slabstream(std::vector<std::string> arguments) const;
  // The same, and fails the test unless it exits with 0.
  ProgramResult MustRun(std::vector<std::string> arguments) const;
  // Fails the test unless slabstream refuses bad input as it must: exit status 2, nothing on stdout, one line on stderr that holds `why`,
  // and no file that was not there before.
  void ExpectRefused(const std::vector<std::string>& arguments, const std::string& why) const;
  // The same for each of several command lines that begin alike.
  struct Refusal {
    std::vector<std::string> more;  // arguments
    std::string why;
  };
  void ExpectEachRefused(const std::vector<std::string>& beginning, const std::vector<Refusal>& refusals) const;
  // The sphere as `name` in the directory; returns its path.
  std::string MakeSphere(const std::string& name, int sphere_class, int size) const;
  std::string ReadFile(const std::string& name) const;
  std::vector<std::string> Files() const;  // names of regular files in the directory, sorted

  TemporaryDirectory temporary_{"/tmp"};
  const std::string directory_ = temporary_.path();
};

}  // namespace slabstream
