#include "common/cli/program.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <fstream>
#include <iostream>
#include <new>
#include <string_view>
#include <system_error>
#include <utility>

#include "common/base/did_you_mean.h"
#include "common/base/log.h"
#include "common/base/printable.h"
#include "common/cli/add_option.h"
#include "common/memory/large_buffers.h"
#include "common/text/url.h"
#include "common/threads/background_tasks.h"

namespace slabstream {

namespace {

// Lets this process have as many files, sockets included, open as the system allows; returns how many.
std::uint64_t AllowOpenFiles() {
  rlimit limit{};
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0) return 0;
  if (limit.rlim_cur < limit.rlim_max) {
    const rlimit more = {limit.rlim_max, limit.rlim_max};
    if (::setrlimit(RLIMIT_NOFILE, &more) == 0) limit = more;
  }
  return limit.rlim_cur;
}

// Of the control group, such as a container's; empty: there is none.
std::string GroupsThreads() {
  std::ifstream groups("/proc/self/cgroup");
  for (std::string line; std::getline(groups, line);) {
    if (!line.starts_with("0::")) continue;
    std::string most;
    std::ifstream("/sys/fs/cgroup" + line.substr(3) + "/pids.max") >> most;
    return most == "max" ? "" : most;
  }
  return "";
}

enum class Scarce { kMemory, kThreads };

// "; this process may have 200000 KiB of data (ulimit -d)": the limits that somebody has set and that may be the reason. Empty: none is
// set.
std::string LimitsOf(Scarce what) {
  std::string text;
  const auto add = [&](const std::string& limit) { text += (text.empty() ? "; " : ", ") + limit; };
  const auto limit = [](__rlimit_resource_t resource) {
    rlimit found{};
    return ::getrlimit(resource, &found) == 0 ? found.rlim_cur : RLIM_INFINITY;
  };
  if (const rlim_t bytes = limit(RLIMIT_DATA); bytes != RLIM_INFINITY) {
    add(fmt::format("this process may have {} KiB of data (ulimit -d)", bytes >> 10));
  }
  if (const rlim_t bytes = limit(RLIMIT_AS); bytes != RLIM_INFINITY) {
    add(fmt::format("this process may have {} KiB of address space (ulimit -v)", bytes >> 10));
  }
  if (what == Scarce::kMemory) return text;
  if (const rlim_t threads = limit(RLIMIT_NPROC); threads != RLIM_INFINITY) {
    add(fmt::format("this user may have {} processes and threads (ulimit -u)", threads));
  }
  if (const std::string threads = GroupsThreads(); !threads.empty())
    add(fmt::format("its control group may have {} threads (pids.max)", threads));
  return text;
}

// The command that was typed last: `keys rotate` of `slabstream`.
Command LastCommand(const Command& program) {
  Command last = program;
  for (auto used = last.typed(); !used.empty(); used = last.typed()) last = used.back();
  return last;
}

std::vector<std::string> CommandNames(const Command& of) {
  std::vector<std::string> names;
  for (const Command& command : of.commands()) {
    if (!command.group().empty()) names.push_back(command.name());
  }
  return names;
}

std::string Joined(const std::vector<std::string>& names) {
  std::string joined;
  for (const std::string& name : names) joined += (joined.empty() ? "" : ", ") + name;
  return joined;
}

Status NoOption(const Command& command, const std::string& typed) {
  std::vector<std::string> names;
  for (const Option& option : command.options()) {
    for (const std::string& name : option.long_names()) names.push_back(name);
  }
  const std::string name = typed.substr(0, typed.find('='));
  const std::string_view bare = std::string_view(name).substr(std::min(name.find_first_not_of('-'), name.size()));
  const std::string_view meant = MostAlike(bare, std::vector<std::string_view>(names.begin(), names.end()));
  return Status::InvalidArgument("`" + command.full_name() + "` has no option '" + Printable(name) + "'" +
                                 (meant.empty() ? "" : "; did you mean '--" + std::string(meant) + "'?"));
}

// What CLI11 says of arguments that nothing takes, and of a command that is missing, names neither the culprit nor what was meant.
Status WhatIsWrong(const Program& program, const ParseEnd& end) {
  const Command command = LastCommand(program);
  const std::vector<std::string> left = program.not_taken();
  // A misspelled option is also one that is missing, so it comes first.
  const auto option = std::ranges::find_if(left, [](const std::string& text) { return text.size() > 1 && text.starts_with('-'); });
  if (option != left.end()) return NoOption(command, *option);
  const bool needs_command = command.needs_command() && end.kind == ParseEnd::Kind::kMissing;
  if (needs_command && left.empty()) return Status::InvalidArgument("a command is needed: " + Joined(CommandNames(command)));
  const bool not_taken = end.kind == ParseEnd::Kind::kNotTaken;
  if (left.empty() || !(not_taken || needs_command)) return Status::InvalidArgument(end.message);
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
    case StatusCode::kDataLoss:  // of a damaged file
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

Status NoCommand(const Command& command, const std::string& word) {
  const std::vector<std::string> commands = CommandNames(command);
  return Status::NotFound("there is no command '" + Printable(word) + "', but " + Joined(commands) + DidYouMean(word, commands));
}

std::string CommandName(const Command& program) {
  const std::vector<Command> used = program.typed();
  return used.empty() ? program.name() : used.front().full_name();
}

std::optional<int> Parse(const Program& program, std::vector<std::string> arguments) {
  if (Status status = CheckValues(arguments); !status.ok()) return Finish(program.name(), status);
  const ParseEnd end = program.Parse(std::move(arguments));
  if (end.kind == ParseEnd::Kind::kParsed) return std::nullopt;
  if (end.kind == ParseEnd::Kind::kAnswered) return 0;
  return Finish(CommandName(program), WhatIsWrong(program, end));
}

int ParseAndRun(const Program& program, int argc, const char* const* argv, const std::function<Status()>& run) {
  if (const std::optional<int> ended = Parse(program, std::vector<std::string>(argv + 1, argv + argc))) return *ended;
  return Finish(program.name(), run());
}

Option AddLogLevel(const Command& app, std::string& level) {
  std::vector<std::string_view> levels;
  for (const auto& [name, unused] : LogLevelNames()) levels.push_back(name);
  return AddParsed(app, "--log-level", level, OneOf(levels), "Least level logged to stderr: debug, info, warning, error or off")
      .TypeName("NAME")
      .Choices(levels);
}

int RunService(const Program& program, int argc, const char* const* argv, const std::string& log_name,
               const std::function<Status()>& serve) {
  std::string log_level = "warning";
  AddLogLevel(program, log_level).Default(log_level);
  return ParseAndRun(program, argc, argv, [&] {
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
