#include "client/cli/command_line.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <iostream>
#include <memory>
#include <optional>
#include <vector>

#include "client/cli/completion.h"
#include "client/cli/option_groups.h"
#include "client/request/option_description.h"
#include "common/base/log.h"
#include "common/base/version.h"
#include "common/cli/man_page.h"
#include "common/cli/program.h"
#include "common/kernels/simd_target.h"

namespace slabstream {
namespace {

// Also behind the name of the command, where its help does not mention it.
void AllowLogLevel(const Command& command, std::string& level) {
  if (!command.FindOption("--log-level")) AddLogLevel(command, level).Group(kHidden);
  for (const Command& sub : command.commands()) AllowLogLevel(sub, level);
}

// Declares a command about another one, which its arguments name; `act` gets that.
Command DeclareAbout(const CommandLine& line, const std::string& name, const std::string& purpose,
                     const std::function<void(const Command& found)>& act) {
  const Command sub = line.app.AddCommand(name, purpose);
  auto names = std::make_shared<std::vector<std::string>>();
  sub.AddTexts("COMMAND", *names, fmt::format("Which one, such as: {0} render, {0} experiment sweep", name));
  sub.OnTyped([app = line.app, &run = line.run, names, act] {
    run = [app, names, act] {
      Command found = app;
      for (const std::string& part : *names) {
        const Command named = found.FindCommand(part);
        if (!named) return NoCommand(found, part);
        found = named;
      }
      act(found);
      return Status::Ok();
    };
  });
  return sub;
}

// `help COMMAND`, the same as COMMAND --help.
void DeclareHelp(const CommandLine& line) {
  DeclareAbout(line, "help", "Explain a command and its options", [](const Command& found) { std::cout << found.HelpText(); });
}

// `options COMMAND`, for programs.
Command DeclareOptions(const CommandLine& line) {
  return DeclareAbout(line, "options", "Print the options of a command as JSON",
                      [](const Command& found) { std::cout << DescribeOptions(found).dump(1) << "\n"; });
}

// `man COMMAND`, for the build, which makes manual pages.
Command DeclareMan(const CommandLine& line) {
  return DeclareAbout(line, "man", "Print the manual page of a command",
                      [](const Command& found) { std::cout << ManPage(found, found.full_name()); });
}

// A number after --local is its value, as with --local=4; anything else is not, so that a SOURCE after a bare --local stays the source.
std::vector<std::string> Arguments(int argc, const char* const* argv) {
  std::vector<std::string> arguments;
  for (int i = 1; i < argc; ++i) {
    const std::string text = argv[i];
    const bool number = !text.empty() && std::all_of(text.begin(), text.end(), [](unsigned char c) { return std::isdigit(c) != 0; });
    if (number && !arguments.empty() && arguments.back() == "--local") {
      arguments.back() += "=" + text;
    } else {
      arguments.push_back(text);
    }
  }
  return arguments;
}

}  // namespace

int RunCommandLine(int argc, const char* const* argv, std::span<const DeclareCommand> commands) {
  const Program app("Slabstream renders volumes on CPUs, by any number of worker processes.", "slabstream",
                    fmt::format("slabstream {}", Version()));
  app.AddHelpAll();
  app.TakeCommand(false);  // so that words after a command are never taken for another command
  std::function<Status()> run;
  const std::string typed = fmt::format("{}", fmt::join(argv, argv + argc, " "));
  std::string log_level;
  AddLogLevel(app, log_level).Default("warning");
  const CommandLine line{app, run, typed, log_level};
  for (const DeclareCommand declare : commands) declare(line);
  DeclareHelp(line);
  DeclareOptions(line).Group(kHidden);
  DeclareMan(line).Group(kHidden);
  for (const Command& sub : app.commands()) {
    if (sub.group() != kHidden) sub.Group("Commands");
    AllowLogLevel(sub, log_level);
  }
  if (argc > 1 && argv[1] == kCompleteCommand) {  // before the parse: the words need not be complete
    return Finish("slabstream", RunComplete(app, std::vector<std::string>(argv + 2, argv + argc)));
  }

  if (const std::optional<int> ended = Parse(app, Arguments(argc, argv))) return *ended;
  if (!run) {
    std::cout << app.HelpText();
    return 0;
  }
  InitLog(CommandName(app), log_level.empty() ? LogLevel::kWarning : LogLevelNames().at(log_level));
  Status status = LimitSimdTargetByEnvironment();
  if (status.ok()) status = run();
  return Finish(CommandName(app), status);
}

}  // namespace slabstream
