#include "client/cli/command_line.h"
#include "client/cli/commands.h"
#include "client/cli/laboratory.h"
#include "common/cli/program.h"

int main(int argc, char** argv) {
  return slabstream::RunMain("slabstream", [&] {
    if (slabstream::IsOfLaboratory({argv + 1, argv + argc})) return slabstream::Finish("slabstream", slabstream::BecomeLaboratory(argv));
    return slabstream::RunCommandLine(argc, argv, slabstream::ClientCommands());
  });
}
