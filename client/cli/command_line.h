// From argv to a subcommand and its exit status. The names of options are stable: scripts rely on them.
#pragma once

namespace slabstream {

// 0: done. 1: the service or the frame failed. 2: bad arguments or input. 130: stopped by Ctrl-C. Unless 0 exactly one line on stderr says
// why: "slabstream render: --zoom 0 is out of range [0.001, 10000]".
int RunCommandLine(int argc, const char* const* argv);

}  // namespace slabstream
