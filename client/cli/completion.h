// Completion of the command line. Scripts for bash, zsh and fish ask this program which words can stand at the cursor.
//
//   eval "$(slabstream completion bash)"; slabstream render --rend<Tab>      # the script calls `slabstream complete render --rend`
#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "client/cli/command_line.h"
#include "client/service/service_choice.h"

namespace slabstream {

inline constexpr std::string_view kCompleteCommand = "complete";

struct Candidate {
  std::string word, purpose;  // the purpose is one line, or empty
  friend bool operator==(const Candidate&, const Candidate&) = default;
};

// Names of the datasets at a service; empty if it does not answer soon.
using DatasetNames = std::function<std::vector<std::string>(const ServiceChoice& service)>;

// What the last of `words`, which follow the name of the program, may become, by the commands and options of `program`. Empty: perhaps the
// name of a file. Calls `datasets` only if that word may be a dataset.
std::vector<Candidate> Complete(const Command& program, std::span<const std::string> words, const DatasetNames& datasets);

// Prints the candidates, one a line: the word, a tab, and its purpose.
Status RunComplete(const Command& program, std::span<const std::string> words);

// `completion SHELL`: prints the script.
void DeclareCompletion(const CommandLine& line);

}  // namespace slabstream
