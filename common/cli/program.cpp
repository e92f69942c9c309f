#include "common/cli/program.h"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <iostream>
#include <memory>
#include <new>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "common/base/did_you_mean.h"
#include "common/base/log.h"
#include "common/base/printable.h"
#include "common/base/process_limits.h"
#include "common/cli/add_option.h"
#include "common/cli/help_formatter.h"
#include "common/cli/man_page.h"
#include "common/files/open_files.h"
#include "common/memory/large_buffers.h"
#include "common/text/url.h"
#include "common/threads/background_tasks.h"

namespace slabstream {

namespace {

// The command that was typed last: `keys rotate` of `slabstream`.
const CLI::App& LastCommand(const CLI::App& app) {
  const CLI::App* last = &app;
  for (auto used = last->get_subcommands(); !used.empty(); used = last->get_subcommands()) last = used.back();
  return *last;
}

std::string FullName(const CLI::App& app) {
  return app.get_parent() == nullptr ? app.get_name() : FullName(*app.get_parent()) + " " + app.get_name();
}

std::vector<std::string> CommandNames(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands(nullptr)) {
    if (!command->get_group().empty()) names.push_back(command->get_name());
  }
  return names;
}

std::string Joined(const std::vector<std::string>& names) {
  std::string joined;
  for (const std::string& name : names) joined += (joined.empty() ? "" : ", ") + name;
  return joined;
}

Status NoOption(const CLI::App& command, const std::string& typed) {
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back(name);
  }
  const std::string name = typed.substr(0, typed.find('='));
  const std::string_view bare = std::string_view(name).substr(std::min(name.find_first_not_of('-'), name.size()));
  const std::string_view meant = MostAlike(bare, std::vector<std::string_view>(names.begin(), names.end()));
  return Status::InvalidArgument("`" + FullName(command) + "` has no option '" + Printable(name) + "'" +
                                 (meant.empty() ? "" : "; did you mean '--" + std::string(meant) + "'?"));
}

// What CLI11 says of arguments that nothing takes, and of a command that is missing, names neither the culprit nor what was meant.
Status WhatIsWrong(const CLI::App& app, const CLI::ParseError& error) {
  const CLI::App& command = LastCommand(app);
  const std::vector<std::string> left = app.remaining(true);
  // A misspelled option is also one that is missing, so it comes first.
  const auto option = std::ranges::find_if(left, [](const std::string& text) { return text.size() > 1 && text.starts_with('-'); });
  if (option != left.end()) return NoOption(command, *option);
  const bool needs_command = command.get_require_subcommand_min() > 0 && dynamic_cast<const CLI::RequiredError*>(&error) != nullptr;
  if (needs_command && left.empty()) return Status::InvalidArgument("a command is needed: " + Joined(CommandNames(command)));
  const bool not_taken = dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr;
  if (left.empty() || !(not_taken || needs_command)) return Status::InvalidArgument(error.what());
  if (!CommandNames(command).empty()) return NoCommand(command, left.front());
  return Status::InvalidArgument("'" + Printable(left.front()) + "' is one argument too many");
}

// CLI11 would take the next argument for the value of "--isovalue=".
Status CheckValues(const std::vector<std::string>& arguments) {
  for (const std::string& argument : arguments) {
    if (argument == "--") break;
    if (argument.starts_with("--") && argument.find('=') + 1 == argument.size()) {
      return Status::InvalidArgument(argument.substr(0, argument.size() - 1) + " has no value behind its '='");
    }
  }
  return Status::Ok();
}

}  // namespace

int RunMain(const std::string& name, const std::function<int()>& program) {
  KeepFrameBuffers();
  int exit_status = 1;
  try {
    exit_status = program();
  } catch (const std::bad_alloc&) {
    std::cerr << name << ": there is no memory for this" << LimitsOf(Scarce::kMemory) << std::endl;
  } catch (const std::system_error& error) {
    const bool no_thread = error.code() == std::errc::resource_unavailable_try_again;
    std::cerr << name << ": " << (no_thread ? "no further thread can be started" + LimitsOf(Scarce::kThreads) : Redacted(error.what()))
              << std::endl;
  } catch (const std::exception& error) {
    std::cerr << name << ": " << Redacted(error.what()) << std::endl;
  }
  const Status written = FlushOutput();
  if (exit_status == 0) exit_status = Finish(name, written);
  if (BackgroundTasks::AnyRunning()) std::_Exit(exit_status);  // a load that takes long does not keep the process
  return exit_status;
}

void PrintNote(const std::string& message) { std::cerr << "slabstream: note: " << Redacted(message) << std::endl; }
void PrintWarning(const std::string& message) { std::cerr << "slabstream: warning: " << Redacted(message) << std::endl; }

int Finish(const std::string& who, const Status& status) {
  if (status.ok()) return 0;
  std::string message = Redacted(status.message());
  std::replace(message.begin(), message.end(), '\n', ' ');
  std::cerr << who << ": " << message << std::endl;
  switch (status.code()) {
    case StatusCode::kInvalidArgument:
    case StatusCode::kNotFound: return 2;
    case StatusCode::kCancelled: return 130;  // 128 + SIGINT, as shells count
    default: return 1;
  }
}

Status FlushOutput() {
  errno = 0;
  std::cout.flush();
  (void)std::fflush(stdout);
  const int error = errno;
  if (std::cout.good() && std::ferror(stdout) == 0) return Status::Ok();
  const std::string reason = error != 0 ? std::string(": ") + std::strerror(error) : "";  // of an earlier failure it is not known any more
  return Status::Unavailable("standard output cannot be written" + reason);
}

Status ReportAll(const std::string& who, const std::vector<Status>& failures) {
  for (std::size_t i = 0; i + 1 < failures.size(); ++i) (void)Finish(who, failures[i]);
  return failures.empty() ? Status::Ok() : failures.back();
}

void SetUp(CLI::App& app, const std::string& version) {
  app.formatter(std::make_shared<HelpFormatter>());
  app.set_help_flag("-h,--help", "Print this text");
  app.set_version_flag("--version", version, "Print the version");
  // For the build, which makes manual pages.
  const auto print_page = [&app] {
    std::cout << ManPage(app, app.get_name());
    throw CLI::Success();
  };
  app.add_flag_callback("--man", print_page, "Print the manual page")->group("");
}

Status NoCommand(const CLI::App& app, const std::string& word) {
  const std::vector<std::string> commands = CommandNames(app);
  return Status::NotFound("there is no command '" + Printable(word) + "', but " + Joined(commands) + DidYouMean(word, commands));
}

std::string CommandName(const CLI::App& app) {
  const auto used = app.get_subcommands();
  return used.empty() ? app.get_name() : app.get_name() + " " + used.front()->get_name();
}

std::optional<int> Parse(CLI::App& app, std::vector<std::string> arguments) {
  if (Status status = CheckValues(arguments); !status.ok()) return Finish(app.get_name(), status);
  std::ranges::reverse(arguments);  // as CLI11 wants them
  try {
    app.parse(std::move(arguments));
  } catch (const CLI::Success& asked) {  // --help, --version
    return app.exit(asked);
  } catch (const CLI::ParseError& error) {
    return Finish(CommandName(app), WhatIsWrong(app, error));
  }
  return std::nullopt;
}

int ParseAndRun(CLI::App& app, int argc, const char* const* argv, const std::function<Status()>& run) {
  if (const std::optional<int> ended = Parse(app, std::vector<std::string>(argv + 1, argv + argc))) return *ended;
  return Finish(app.get_name(), run());
}

CLI::Option* AddLogLevel(CLI::App& app, std::string& level) {
  std::vector<std::string_view> levels;
  for (const auto& [name, unused] : LogLevelNames()) levels.push_back(name);
  CLI::Option* const option =
      AddParsed(app, "--log-level", level, OneOf(levels), "Least level logged to stderr: debug, info, warning, error or off");
  return NoteChoices(option->type_name("NAME"), levels);
}

int RunService(CLI::App& app, int argc, const char* const* argv, const std::string& log_name, const std::function<Status()>& serve) {
  std::string log_level = "warning";
  AddLogLevel(app, log_level)->default_str(log_level);
  return ParseAndRun(app, argc, argv, [&] {
    InitLog(log_name, LogLevelNames().at(log_level));
    constexpr std::uint64_t kLeastFiles = 128;  // with fewer it would wait for ever for some of its own sockets
    if (const std::uint64_t files = AllowOpenFiles(); files < kLeastFiles) {
      return Status::ResourceExhausted("this process may open " + std::to_string(files) + " files and sockets, but needs at least " +
                                       std::to_string(kLeastFiles) + " (ulimit -n)");
    }
    return serve();
  });
}

}  // namespace slabstream
