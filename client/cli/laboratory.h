// `bench` and `experiment`: commands of the laboratory, a program of its own that lies beside this one. This program lists them, and
// becomes that one for all else about them: their options, help, manual pages and completion.
#pragma once

#include <span>
#include <string_view>

#include "client/cli/command_line.h"

namespace slabstream {

struct LaboratoryCommand {
  std::string_view name, purpose;
};
inline constexpr LaboratoryCommand kBenchCommand = {"bench", "Measure how fast this machine or a service renders"},
                                   kExperimentCommand = {"experiment",
                                                         "Compare ways of dividing, combining and streaming, and write the results"};

// Declares them without options: for lists of commands.
void DeclareLaboratory(const CommandLine& line);

// Whether the words after the name of the program call one of these commands or ask for its help: `bench --size 64`,
// `help experiment sweep`.
bool IsOfLaboratory(std::span<const char* const> words);

// Becomes the laboratory, with the same arguments. Returns only if it cannot. NotFound: it is missing.
Status BecomeLaboratory(char* const* argv);

}  // namespace slabstream
