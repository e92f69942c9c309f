#include <cstdlib>
#include <exception>
#include <iostream>

#include "client/cli/command_line.h"
#include "common/base/background_tasks.h"
#include "common/base/large_buffers.h"
#include "laboratory/cli/laboratory_commands.h"

int main(int argc, char** argv) {
  slabstream::KeepFrameBuffers();
  int exit_status = 1;
  try {
    return slabstream::RunCommandLine(argc, argv, slabstream::LaboratoryCommands());
  } catch (const std::exception& error) {  // mostly out of memory: all expected errors are returned as a Status
    std::cerr << "slabstream: " << error.what() << "\n";
  }
  if (slabstream::BackgroundTasks::AnyRunning()) {  // an interrupted load of an embedded service
    std::cout.flush();
    std::_Exit(exit_status);
  }
  return exit_status;
}
