// From argv to a command and its exit status. The names of options are stable: scripts rely on them.
#pragma once

#include <functional>
#include <span>
#include <string>

#include "common/base/status.h"
#include "common/cli/command.h"

namespace slabstream {

// The place where a command declares itself.
struct CommandLine {
  Command app;                   // gets a subcommand with its options
  std::function<Status()>& run;  // set by the subcommand's callback; called after the parse
  const std::string& typed;      // the whole command line
  std::string& log_level;        // --log-level, after the parse; empty: not given
};

// Declares one command. The values of its options must live as long as its callbacks, which may own them.
using DeclareCommand = void (*)(const CommandLine& line);

// Runs one of `commands`, or tells about them: `help`, `options`, `man`, `complete`. 0: done. 1: the service or the frame failed. 2: bad
// arguments or input. 130: stopped by Ctrl-C. Unless 0, exactly one line on stderr says why: "slabstream render: --zoom 0 is out of range
// [0.001, 10000]".
int RunCommandLine(int argc, const char* const* argv, std::span<const DeclareCommand> commands);

}  // namespace slabstream
