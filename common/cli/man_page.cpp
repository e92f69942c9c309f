#include "common/cli/man_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>
#include <string_view>
#include <vector>

#include "common/base/version.h"
#include "common/cli/help_formatter.h"

namespace slabstream {
namespace {

// What roff would take for its own: backslashes, dots and quotes that begin a line. A minus is one that can be typed. A line may end after
// a comma, also within a word such as FILE,labels=FILE.
std::string Escaped(std::string_view text) {
  std::string escaped;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if ((c == '.' || c == '\'') && (escaped.empty() || escaped.back() == '\n')) escaped += "\\&";
    escaped += c == '\\' ? "\\e" : c == '-' ? "\\-" : std::string(1, c);
    if (c == ',' && i + 1 < text.size() && text[i + 1] != ' ') escaped += "\\:";
  }
  return escaped;
}

std::string PageName(std::string name) {
  std::replace(name.begin(), name.end(), ' ', '-');
  return name;
}

// A text whose indented lines are the entries of a list, each "  name: purpose".
std::string Paragraphs(const std::string& text) {
  std::string page;
  std::istringstream lines(text);
  bool list = false;
  for (std::string line; std::getline(lines, line);) {
    const std::size_t colon = line.find(": ");
    if (!line.starts_with("  ") || colon == std::string::npos) {
      page += Escaped(line) + "\n";
      continue;
    }
    if (!list) page += ".RS\n";
    list = true;
    page += fmt::format(".TP\n.B {}\n{}\n", Escaped(line.substr(2, colon - 2)), Escaped(line.substr(colon + 2)));
  }
  return list ? page + ".RE\n" : page;
}

std::vector<Command> CommandsOf(const Command& app) {
  std::vector<Command> commands = app.commands();
  std::erase_if(commands, [](const Command& command) { return command.group().empty(); });
  return commands;
}

std::vector<Option> OptionsOf(const Command& app, bool arguments, const std::string& group) {
  std::vector<Option> options = app.options();
  std::erase_if(options, [&](const Option& option) {
    return option.is_argument() != arguments || option.group().empty() || (!arguments && option.group() != group);
  });
  return options;
}

std::string Synopsis(const Command& app, const std::string& name) {
  std::string line = fmt::format(".B {}\n[OPTIONS]", Escaped(name));
  for (const Option& option : OptionsOf(app, true, "")) {
    const std::string argument = Escaped(option.argument_name()) + (option.most_values() > 1 ? "..." : "");
    line += option.required() ? " " + argument : " [" + argument + "]";
  }
  if (!CommandsOf(app).empty()) line += app.needs_command() ? " COMMAND" : " [COMMAND]";
  return line + "\n";
}

// A default that comes from the size of the machine is another one elsewhere: "(default: half of this machine's memory: 12053 MiB)".
std::string WithoutMachine(std::string text) {
  constexpr std::string_view kBefore = "this machine's memory";
  const std::size_t at = text.find(std::string(kBefore) + ": ");
  if (at != std::string::npos) text.erase(at + kBefore.size(), text.find(')', at) - at - kBefore.size());
  return text;
}

std::string OptionList(const std::vector<Option>& options) {
  std::string list;
  for (const Option& option : options) {
    list += fmt::format(".TP\n.B {}\n{}", Escaped(OptionTitle(option)), Paragraphs(WithoutMachine(OptionText(option))));
  }
  return list;
}

// `section`: the macro that begins a section, .SH, or within one .SS.
std::string Options(const Command& app, std::string_view section) {
  std::string page;
  const auto add = [&](const std::string& title, const std::vector<Option>& options) {
    if (options.empty()) return;
    page += section == ".SH" ? fmt::format(".SH \"{}\"\n", Escaped(title)) : std::string();
    page += OptionList(options);
  };
  add("Arguments", OptionsOf(app, true, ""));
  for (const std::string& group : app.option_groups()) {
    if (!group.empty()) add(group, OptionsOf(app, false, group));
  }
  return page;
}

// Of a command and of all below it.
std::string Details(const Command& app, const std::string& name) {
  std::string page;
  for (const Command& command : CommandsOf(app)) {
    const std::string full_name = name + " " + command.name();
    page += fmt::format(".SS {}\n{}\n", Escaped(full_name), Paragraphs(command.description() + "."));
    page += fmt::format(".PP\n{}{}{}", Synopsis(command, full_name), Options(command, ".SS"), Details(command, full_name));
  }
  return page;
}

std::string Examples(const Command& app) {
  const HelpPage* const page = HelpPageOf(app);
  if (page == nullptr || page->examples.empty()) return "";
  std::string text = ".SH EXAMPLES\n";
  for (const HelpExample& example : page->examples) {
    text += fmt::format(".TP\n.B {}\n{}.\n", Escaped(example.command), Escaped(example.purpose));
  }
  return text;
}

std::string CommandList(const Command& app, const std::string& name) {
  std::string list;
  for (const Command& command : CommandsOf(app)) {
    const std::string page = PageName(name + " " + command.name());
    list += fmt::format(".TP\n.BR {} (1)\n{}", Escaped(page), Paragraphs(command.description()));
  }
  return list;
}

}  // namespace

std::string ManPage(const Command& app, const std::string& name) {
  const bool program = app.is_program();
  const std::string page_name = PageName(name), text = app.description();
  std::string purpose = text;  // of a program it begins "Slabstream renders" or "Slabstream worker: renders"
  if (const std::size_t colon = text.find(": "); program && colon != std::string::npos) {
    purpose.erase(0, colon + 2);
  } else if (program) {
    purpose.erase(0, text.find(' ') + 1);
  }
  while (purpose.ends_with('.')) purpose.pop_back();
  std::string page = fmt::format(".TH {} 1 \"\" \"slabstream {}\" \"Slabstream\"\n", Escaped(page_name), Version());
  page += fmt::format(".SH NAME\n{} \\- {}\n.SH SYNOPSIS\n{}", Escaped(page_name), Escaped(purpose), Synopsis(app, name));
  page += fmt::format(".SH DESCRIPTION\n{}", Paragraphs(text.ends_with('.') ? text : text + "."));
  page += Options(app, ".SH");
  if (!CommandsOf(app).empty()) page += ".SH COMMANDS\n" + (program ? CommandList(app, name) : Details(app, name));
  page += Examples(app);
  page +=
      ".SH \"EXIT STATUS\"\n0: done. 1: the service or the frame failed. 2: bad arguments or input. 130: stopped by Ctrl\\-C.\n"
      "One line on stderr gives the reason.\n";
  const bool other = !program || !name.starts_with("slabstream-");
  page += fmt::format(".SH \"SEE ALSO\"\n{}\n", program && other ? ".BR slabstream\\-coordinator (1),\n.BR slabstream\\-worker (1),\n.BR "
                                                                   "slabstream\\-gateway (1)"
                                                                 : ".BR slabstream (1)");
  return page;
}

}  // namespace slabstream
