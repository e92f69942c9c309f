#include "common/cli/help_formatter.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstddef>
#include <map>
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

// CLI11 asks for each part of a help text.
class HelpFormatter : public CLI::Formatter {
 public:
  HelpFormatter() {
    column_width(kNameWidth);
    label("Positionals", "Arguments");
    label("SUBCOMMAND", "COMMAND");
  }

  std::string make_help(const CLI::App* app, std::string name, CLI::AppFormatMode mode) const override {
    const auto page = pages.find(app);
    if (mode != CLI::AppFormatMode::Normal || page == pages.end() || page->second.options.empty()) {
      return CLI::Formatter::make_help(app, std::move(name), mode);
    }
    const std::string full_name = name.empty() ? app->get_name() : name;
    return make_description(app) + make_usage(app, name) + make_positionals(app) + FirstOptions(*app, full_name) + "\n" + make_footer(app);
  }

  std::string make_footer(const CLI::App* app) const override {
    const auto page = pages.find(app);
    if (page == pages.end() || page->second.examples.empty()) return CLI::Formatter::make_footer(app);
    std::string text = "Examples:\n";
    for (const HelpExample& example : page->second.examples)
      text.append("  ").append(example.command).append("\n      ").append(example.purpose).append("\n");
    return text;
  }

  std::string make_option_name(const CLI::Option* option, bool is_positional) const override {
    if (is_positional) return option->get_name(true, false);
    std::string names;
    for (const std::string& name : option->get_snames()) names += (names.empty() ? "-" : ", -") + name;
    for (const std::string& name : option->get_lnames()) names += (names.empty() ? "--" : ", --") + name;
    return names;
  }

  std::string make_option_opts(const CLI::Option* option) const override {
    const std::string type = option->get_positional() ? "" : option->get_type_name();
    return type.empty() ? "" : " " + type;
  }

  std::string make_option_desc(const CLI::Option* option) const override { return Wrapped(TextOf(*option)); }

  // Lists of choices follow the first line, so notes about the whole option go there.
  static std::string TextOf(const CLI::Option& option) {
    std::string text = option.get_description();
    const std::size_t end = std::min(text.find('\n'), text.size());
    if (option.get_required()) {
      text.insert(end, " (required)");
    } else if (!option.get_default_str().empty()) {
      text.insert(end, " (default: " + option.get_default_str() + ")");
    }
    return text;
  }

  std::map<const CLI::App*, HelpPage> pages;

 private:
  std::string FirstOptions(const CLI::App& app, const std::string& name) const {
    std::stringstream out;
    out << "\nOptions:\n";
    for (const std::string_view shown : pages.at(&app).options) {
      const CLI::Option& option = *app.get_option_no_throw("--" + std::string(shown));
      CLI::detail::format_help(out, make_option_name(&option, false) + make_option_opts(&option), Wrapped(Shortened(TextOf(option))),
                               column_width_);
    }
    const auto all = app.get_options([](const CLI::Option* option) { return option->nonpositional() && !option->get_group().empty(); });
    out << "\nAll " << all.size() << " options: " << name << " --help-all\n";
    return out.str();
  }
};

HelpFormatter* FormatterOf(const Command& command) { return dynamic_cast<HelpFormatter*>(command.cli().get_formatter().get()); }

}  // namespace

std::string OptionTitle(Option option) {
  const HelpFormatter formatter;
  return formatter.make_option_name(&option.cli(), option.is_argument()) + formatter.make_option_opts(&option.cli());
}

std::string OptionText(Option option) { return HelpFormatter::TextOf(option.cli()); }

void SetHelpPage(const Command& command, HelpPage page) {
  for (const std::string_view name : page.options) {
    CHECK(command.FindOption("--" + std::string(name))) << command.name() << " has no option --" << name;
  }
  HelpFormatter* const formatter = FormatterOf(command);
  CHECK(formatter != nullptr);
  formatter->pages[&command.cli()] = std::move(page);
}

const HelpPage* HelpPageOf(const Command& command) {
  const HelpFormatter* const formatter = FormatterOf(command);
  if (formatter == nullptr) return nullptr;
  const auto found = formatter->pages.find(&command.cli());
  return found == formatter->pages.end() ? nullptr : &found->second;
}

std::shared_ptr<CLI::FormatterBase> MakeHelpFormatter() { return std::make_shared<HelpFormatter>(); }

}  // namespace slabstream
