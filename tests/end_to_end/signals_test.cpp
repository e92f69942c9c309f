// SIGTERM and SIGINT while a program starts: it ends at once, in order.
#include <fcntl.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <functional>

#include "common/threads/stop_signals.h"
#include "tests/end_to_end/program.h"
#include "tests/support/loopback_listener.h"

namespace slabstream {
namespace {

class SignalsTest : public EndToEndTest {
 protected:
  std::string Program(const std::string& name) const { return Command({}).front() + "-" + name; }

  // Starts it, waits until `is_starting` returns, and signals it.
  int ExitStatusOf(const std::vector<std::string>& command, int signal, const std::function<void()>& is_starting) const {
    RunningProgram program(command, directory_);
    is_starting();
    program.Signal(signal);
    return program.Wait().exit_status;
  }
  bool NothingIsLeft() const { return !std::filesystem::exists(Path("slabstream")) || std::filesystem::is_empty(Path("slabstream")); }
};

// What is read at a start may be slow: here nobody writes into a pipe, and a web server does not answer.
TEST_F(SignalsTest, AProgramThatReadsWhatItNeedsEnds) {
  const std::string pipe = Path("pipe");
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  int writer = -1;
  const auto pipe_is_open = [&] { writer = ::open(pipe.c_str(), O_WRONLY | O_CLOEXEC); };
  // Each has a server of its own: one that has ended may have connected twice.
  const auto status_beside_a_server = [&](std::vector<std::string> command, int signal) {
    const LoopbackListener server = ListenOnLoopback();
    command.insert(command.end(), {"--listen", "ipc://" + Path("s"), "--data"});
    command.push_back("far=http://127.0.0.1:" + std::to_string(server.port) + "/far.nrrd");
    int connection = -1;
    const int status = ExitStatusOf(command, signal, [&] {
      connection = ::accept(server.socket, nullptr, nullptr);
      char byte = 0;
      EXPECT_EQ(::recv(connection, &byte, 1, MSG_PEEK), 1);
    });
    ::close(connection);
    ::close(server.socket);
    return status;
  };
  for (const int signal : {SIGTERM, SIGINT}) {
    SCOPED_TRACE(signal);
    for (const std::vector<std::string>& command : {std::vector<std::string>{Program("worker"), "--service", pipe},
                                                    {Program("gateway"), "--service", pipe},
                                                    {Program("gateway"), "--endpoint", "ipc://" + Path("s"), "--token-file", pipe}}) {
      EXPECT_EQ(ExitStatusOf(command, signal, pipe_is_open), 0) << command[0];
      ::close(writer);
    }
    EXPECT_EQ(status_beside_a_server({Program("coordinator")}, signal), 0);
    EXPECT_EQ(status_beside_a_server(Command({"up"}), signal), 130);
    EXPECT_TRUE(NothingIsLeft());
  }
}

// Whenever it comes. No signal can be handled before a program's first line, so they are blocked until there.
TEST_F(SignalsTest, AStartEndsInOrderAtAnyMoment) {
  BlockStopSignals();
  const std::string nobody = "ipc://" + Path("nobody");
  for (int i = 0; i < 24; ++i) {
    SCOPED_TRACE(i);
    const int signal = i % 2 == 0 ? SIGTERM : SIGINT;
    const auto later = [i] { ::usleep(useconds_t(i) * 2000); };
    for (const std::vector<std::string>& command : {std::vector<std::string>{Program("worker"), "--coordinator", nobody},
                                                    {Program("gateway"), "--endpoint", nobody},
                                                    {Program("coordinator"), "--listen", "ipc://" + Path("s")}}) {
      EXPECT_EQ(ExitStatusOf(command, signal, later), 0) << command[0];
    }
  }
  for (int i = 0; i < 12; ++i) {
    const auto later = [i] { ::usleep(useconds_t(i) * 10'000); };
    const int status = ExitStatusOf(Command({"up", "--workers", "1", "--listen", "ipc://" + Path("s")}), SIGTERM, later);
    EXPECT_THAT(status, testing::AnyOf(130, 0)) << "interrupted, or told to end when it was up";
    EXPECT_TRUE(NothingIsLeft());
  }
  const sigset_t signals = StopSignals();
  pthread_sigmask(SIG_UNBLOCK, &signals, nullptr);
}

}  // namespace
}  // namespace slabstream
