#include "common/cli/help_formatter.h"

#include <algorithm>
#include <sstream>

namespace slabstream {
namespace {

constexpr std::size_t kNameWidth = 32, kTextWidth = 78;  // columns

// Lines of at most kTextWidth columns if words allow it. Continuation lines of an indented line are indented more.
std::string Wrapped(const std::string& text) {
  std::string wrapped;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const std::string indent(line.starts_with("  ") ? 4 : 0, ' ');
    while (line.size() > kTextWidth) {
      const std::size_t at = line.rfind(' ', kTextWidth);
      if (at == std::string::npos || at <= indent.size()) break;
      wrapped += line.substr(0, at) + "\n";
      line.replace(0, at + 1, indent);
    }
    wrapped += line + "\n";
  }
  if (!wrapped.empty()) wrapped.pop_back();
  return wrapped;
}

}  // namespace

HelpFormatter::HelpFormatter() {
  column_width(kNameWidth);
  label("Positionals", "Arguments");
  label("SUBCOMMAND", "COMMAND");
}

std::string HelpFormatter::make_option_name(const CLI::Option* option, bool is_positional) const {
  if (is_positional) return option->get_name(true, false);
  std::string names;
  for (const std::string& name : option->get_snames()) names += (names.empty() ? "-" : ", -") + name;
  for (const std::string& name : option->get_lnames()) names += (names.empty() ? "--" : ", --") + name;
  return names;
}

std::string HelpFormatter::make_option_opts(const CLI::Option* option) const {
  const std::string type = option->get_positional() ? "" : option->get_type_name();
  return type.empty() ? "" : " " + type;
}

// Lists of choices follow the first line, so notes about the whole option go there.
std::string OptionText(const CLI::Option& option) {
  std::string text = option.get_description();
  const std::size_t end = std::min(text.find('\n'), text.size());
  if (option.get_required()) {
    text.insert(end, " (required)");
  } else if (!option.get_default_str().empty()) {
    text.insert(end, " (default: " + option.get_default_str() + ")");
  }
  return text;
}

std::string HelpFormatter::make_option_desc(const CLI::Option* option) const { return Wrapped(OptionText(*option)); }

}  // namespace slabstream
