#include "common/cli/help_formatter.h"

#include <algorithm>
#include <cstddef>
#include <memory>
#include <sstream>
#include <utility>

#include "common/base/check.h"

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

// Of a list of choices the names alone, behind what comes before them.
std::string Shortened(const std::string& text) {
  std::istringstream lines(text);
  std::string shortened, line;
  std::getline(lines, shortened);
  const char* separator = ": ";
  while (std::getline(lines, line)) {
    const std::size_t colon = line.find(": ");
    if (!line.starts_with("  ") || colon == std::string::npos) continue;
    shortened += separator + line.substr(2, colon - 2);
    separator = ", ";
  }
  return shortened;
}

}  // namespace

HelpFormatter::HelpFormatter() {
  column_width(kNameWidth);
  label("Positionals", "Arguments");
  label("SUBCOMMAND", "COMMAND");
}

void HelpFormatter::SetPage(const CLI::App& command, HelpPage page) {
  for (const std::string_view name : page.options) {
    CHECK(command.get_option_no_throw("--" + std::string(name)) != nullptr) << command.get_name() << " has no option --" << name;
  }
  pages_[&command] = std::move(page);
}

const HelpPage* HelpFormatter::PageOf(const CLI::App& command) {
  const auto formatter = std::dynamic_pointer_cast<const HelpFormatter>(command.get_formatter());
  if (formatter == nullptr) return nullptr;
  const auto found = formatter->pages_.find(&command);
  return found == formatter->pages_.end() ? nullptr : &found->second;
}

std::string HelpFormatter::FirstOptions(const CLI::App& app, const std::string& name) const {
  std::stringstream out;
  out << "\nOptions:\n";
  for (const std::string_view shown : pages_.at(&app).options) {
    const CLI::Option& option = *app.get_option_no_throw("--" + std::string(shown));
    CLI::detail::format_help(out, make_option_name(&option, false) + make_option_opts(&option), Wrapped(Shortened(OptionText(option))),
                             column_width_);
  }
  const auto all = app.get_options([](const CLI::Option* option) { return option->nonpositional() && !option->get_group().empty(); });
  out << "\nAll " << all.size() << " options: " << name << " --help-all\n";
  return out.str();
}

std::string HelpFormatter::make_help(const CLI::App* app, std::string name, CLI::AppFormatMode mode) const {
  const auto page = pages_.find(app);
  if (mode != CLI::AppFormatMode::Normal || page == pages_.end() || page->second.options.empty()) {
    return CLI::Formatter::make_help(app, std::move(name), mode);
  }
  const std::string full_name = name.empty() ? app->get_name() : name;
  return make_description(app) + make_usage(app, name) + make_positionals(app) + FirstOptions(*app, full_name) + "\n" + make_footer(app);
}

std::string HelpFormatter::make_footer(const CLI::App* app) const {
  const auto page = pages_.find(app);
  if (page == pages_.end() || page->second.examples.empty()) return CLI::Formatter::make_footer(app);
  std::string text = "Examples:\n";
  for (const HelpExample& example : page->second.examples)
    text.append("  ").append(example.command).append("\n      ").append(example.purpose).append("\n");
  return text;
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
