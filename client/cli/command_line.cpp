#include "client/cli/command_line.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/cli/annotate.h"
#include "client/cli/commands.h"
#include "client/cli/completion.h"
#include "client/cli/help_pages.h"
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
void AllowLogLevel(CLI::App& command, std::string& level) {
  if (command.get_option_no_throw("--log-level") == nullptr) AddLogLevel(command, level)->group(kHidden);
  for (CLI::App* sub : command.get_subcommands(nullptr)) AllowLogLevel(*sub, level);
}

// Declares a command about another one, which its arguments name; `act` gets that.
CLI::App* DeclareAbout(const CommandLine& line, const std::string& name, const std::string& purpose,
                       const std::function<void(CLI::App& found, const std::string& full_name)>& act) {
  CLI::App* sub = line.app.add_subcommand(name, purpose);
  auto names = std::make_shared<std::vector<std::string>>();
  sub->add_option("COMMAND", *names, fmt::format("Which one, such as: {0} render, {0} experiment replay", name));
  sub->callback([&app = line.app, &run = line.run, names, act] {
    run = [&app, names, act] {
      CLI::App* found = &app;
      std::string full_name = app.get_name();
      for (const std::string& part : *names) {
        const auto named = found->get_subcommands([&](const CLI::App* command) { return command->get_name() == part; });
        if (named.empty()) return NoCommand(*found, part);
        found = named.front();
        full_name += " " + part;
      }
      act(*found, full_name);
      return Status::Ok();
    };
  });
  return sub;
}

// `help COMMAND`, the same as COMMAND --help.
void DeclareHelp(const CommandLine& line) {
  DeclareAbout(line, "help", "Explain a command and its options", [](CLI::App& found, const std::string& full_name) {
    std::cout << found.get_formatter()->make_help(&found, full_name, CLI::AppFormatMode::Normal);
  });
}

// `options COMMAND`, for programs.
CLI::App* DeclareOptions(const CommandLine& line) {
  return DeclareAbout(line, "options", "Print the options of a command as JSON",
                      [](CLI::App& found, const std::string&) { std::cout << DescribeOptions(found).dump(1) << "\n"; });
}

// `man COMMAND`, for the build, which makes manual pages.
CLI::App* DeclareMan(const CommandLine& line) {
  return DeclareAbout(line, "man", "Print the manual page of a command",
                      [](CLI::App& found, const std::string& full_name) { std::cout << ManPage(found, full_name); });
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

int RunCommandLine(int argc, const char* const* argv, std::span<const DeclareCommand> more) {
  CLI::App app("Slabstream renders volumes on CPUs, by any number of worker processes.", "slabstream");
  SetUp(app, fmt::format("slabstream {}", Version()));
  app.set_help_all_flag("--help-all", "Print all options");
  app.require_subcommand(0, 1);  // so that words after a command are never taken for another command
  std::function<Status()> run;
  const std::string typed = fmt::format("{}", fmt::join(argv, argv + argc, " "));
  std::string log_level;
  AddLogLevel(app, log_level)->default_str("warning");
  const CommandLine line{app, run, typed, log_level};
  for (const DeclareCommand declare : ClientCommands()) declare(line);
  for (const DeclareCommand declare : more) declare(line);
  DeclareCompletion(line);
  DeclareHelp(line);
  const CLI::App *const options = DeclareOptions(line), *const man = DeclareMan(line);
  for (CLI::App* sub : app.get_subcommands(nullptr)) {
    sub->group(sub == options || sub == man || sub->get_name() == kAnnotateCommand ? kHidden : "Commands");
    AllowLogLevel(*sub, log_level);
  }
  AddHelpPages(app);
  if (argc > 1 && argv[1] == kCompleteCommand) {  // before the parse: the words need not be complete
    return Finish("slabstream", RunComplete(app, std::vector<std::string>(argv + 2, argv + argc)));
  }

  if (const std::optional<int> ended = Parse(app, Arguments(argc, argv))) return *ended;
  if (!run) {
    std::cout << app.help();
    return 0;
  }
  InitLog(CommandName(app), log_level.empty() ? LogLevel::kWarning : LogLevelNames().at(log_level));
  Status status = LimitSimdTargetByEnvironment();
  if (status.ok()) status = run();
  return Finish(CommandName(app), status);
}

}  // namespace slabstream
