// What the main functions of all programs share: the style of their help, one line on stderr for what fails, and the exit status.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/cli/command.h"

namespace slabstream {

// Runs `program`, which returns the exit status, and catches what it throws (mostly a lack of memory). Fails if standard output cannot be
// written. For main alone.
int RunMain(const std::string& name, const std::function<int()>& program);

// Unless the status is ok, writes "who: message" as one line to stderr. Returns the exit status. 0: ok. 1: the service or the frame failed.
// 2: bad arguments or input, such as a damaged file. 130: stopped by Ctrl-C.
int Finish(const std::string& who, const Status& status);

// Flushes standard output, of std::cout and of printf. Unavailable if this fails or has failed before. A program calls this when it has
// printed something that somebody waits for and then goes on; RunMain calls it at the end of every program.
Status FlushOutput();

// Writes every failure but the last one, as Finish does, and returns the last one. Ok if there is no failure.
Status ReportAll(const std::string& who, const std::vector<Status>& failures);

// What a user should know of a command that goes on: one line to stderr, "slabstream: note: message" or "slabstream: warning: message".
void PrintNote(const std::string& message);
void PrintWarning(const std::string& message);

// The program, or the command of it that was parsed: "slabstream render".
std::string CommandName(const Command& program);

// NotFound: the program, or a command of it, has no command `word`. The message says which there are.
Status NoCommand(const Command& command, const std::string& word);

// Parses the arguments, in the order in which they were typed. The exit status, if the program ends here: it has printed the help that was
// asked for, or a line on stderr that says what is wrong. A command or an option that does not exist is told with the one that was meant.
std::optional<int> Parse(const Program& program, std::vector<std::string> arguments);

// Parses, and runs `run`. Returns the exit status.
int ParseAndRun(const Program& program, int argc, const char* const* argv, const std::function<Status()>& run);

// --log-level; the text stays as it is if the option is not given.
Option AddLogLevel(const Command& app, std::string& level);

// A program that is one service: adds --log-level, parses, begins to log as `log_name`, and runs `serve`. Returns the exit status.
int RunService(const Program& program, int argc, const char* const* argv, const std::string& log_name,
               const std::function<Status()>& serve);

}  // namespace slabstream
