// The commands that the laboratory adds to the program: `bench` and `experiment`.
#pragma once

#include <span>

#include "client/cli/command_line.h"

namespace slabstream {

std::span<const DeclareCommand> LaboratoryCommands();

}  // namespace slabstream
