// Formats the help texts: an option's description ends with its default or "required" in words, not in the parser's notation. The help of
// a command with many options shows those that most users want, and examples; --help-all shows all of them.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "common/cli/command.h"

namespace CLI {
class FormatterBase;
}

namespace slabstream {

// The names of an option and its type: "-o, --output FILE"; of an argument its name.
std::string OptionTitle(Option option);

// The description of an option with its default or "required"; not wrapped.
std::string OptionText(Option option);

struct HelpExample {
  std::string_view command, purpose;  // as it is typed; what it does
};

struct HelpPage {
  std::vector<std::string_view> options = {};  // names without dashes, of those that --help shows; empty: it shows all
  std::vector<HelpExample> examples;
};

// What the help of this command of a Program with a name shows beside its arguments. Its options exist already.
void SetHelpPage(const Command& command, HelpPage page);
// Null: the command has no page, and its help shows all of its options.
const HelpPage* HelpPageOf(const Command& command);

std::shared_ptr<CLI::FormatterBase> MakeHelpFormatter();  // for Program

}  // namespace slabstream
