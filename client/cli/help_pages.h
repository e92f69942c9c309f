// What `--help` of each command shows: the options that most users want, where a command has many, and examples, which manual pages show,
// too. client_commands.cpp declares the options.
#pragma once

#include "client/cli/command_line.h"

namespace slabstream {

// Of the program and its commands, which are declared already.
void DeclareHelpPages(const CommandLine& line);

}  // namespace slabstream
