#include "client/cli/laboratory.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include "client/cli/completion.h"
#include "common/files/program_beside.h"

namespace slabstream {
namespace {

constexpr const char* kLaboratoryProgram = "slabstream-laboratory";
constexpr std::array kLaboratoryCommands = {kBenchCommand, kExperimentCommand};
constexpr std::array<std::string_view, 3> kAboutOthers = {"help", "options", "man"};  // commands about those that follow

}  // namespace

void DeclareLaboratory(const CommandLine& line) {
  for (const LaboratoryCommand& command : kLaboratoryCommands) {
    (void)line.app.AddCommand(std::string(command.name), std::string(command.purpose));
  }
}

bool IsOfLaboratory(std::span<const char* const> words) {
  // The word at the cursor need not be complete.
  if (!words.empty() && words.front() == kCompleteCommand) words = words.subspan(1, std::max<std::size_t>(words.size(), 2) - 2);
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::string_view word = words[i];
    if (word == "--log-level") {
      ++i;  // its value
    } else if (!word.starts_with('-') && std::ranges::find(kAboutOthers, word) == kAboutOthers.end()) {
      return std::ranges::find(kLaboratoryCommands, word, &LaboratoryCommand::name) != kLaboratoryCommands.end();
    }
  }
  return false;
}

Status BecomeLaboratory(char* const* argv) {
  const Result<std::string> program = ProgramBeside(kLaboratoryProgram);
  if (!program.ok()) {
    return Status::NotFound(program.status().message() + ", and the package slabstream-lab has this one");
  }
  ::execv(program->c_str(), argv);
  return Status::Unavailable(fmt::format("'{}' does not start: {}", *program, std::strerror(errno)));
}

}  // namespace slabstream
