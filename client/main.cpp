#include "client/cli/command_line.h"
#include "common/cli/program.h"
#include "laboratory/cli/laboratory_commands.h"

int main(int argc, char** argv) {
  return slabstream::RunMain("slabstream", [&] { return slabstream::RunCommandLine(argc, argv, slabstream::LaboratoryCommands()); });
}
