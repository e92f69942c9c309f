#include "common/cli/program.h"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <iostream>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/background_tasks.h"
#include "common/base/large_buffers.h"
#include "common/base/log.h"
#include "common/base/open_files.h"
#include "common/base/url.h"
#include "common/cli/add_option.h"
#include "common/cli/help_formatter.h"
#include "common/cli/man_page.h"

namespace slabstream {

int RunMain(const std::string& name, const std::function<int()>& program) {
  KeepFrameBuffers();
  int exit_status = 1;
  try {
    exit_status = program();
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

int ParseAndRun(CLI::App& app, int argc, const char* const* argv, const std::function<Status()>& run) {
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& asked) {  // --help, --version
    return app.exit(asked);
  } catch (const CLI::ParseError& error) {
    return Finish(app.get_name(), Status::InvalidArgument(error.what()));
  }
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
