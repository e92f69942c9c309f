#include "common/base/log.h"

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <atomic>

#include "common/text/url.h"

namespace slabstream {
namespace {

spdlog::level::level_enum ToSpdlog(LogLevel level) {
  using namespace spdlog::level;
  constexpr level_enum kLevels[] = {debug, info, warn, err, off};  // in the order of LogLevel
  return kLevels[int(level)];
}

std::atomic<LogLevel> least_level = LogLevel::kWarning;

// Until InitLog, only warnings and errors are written, so that a library user sees no chatter.
spdlog::logger& Logger() {
  static spdlog::logger logger = [] {
    spdlog::logger fresh("slabstream", std::make_shared<spdlog::sinks::stderr_sink_mt>());
    fresh.set_level(spdlog::level::warn);
    return fresh;
  }();
  return logger;
}

}  // namespace

const std::map<std::string, LogLevel>& LogLevelNames() {
  static const std::map<std::string, LogLevel> names = {{"debug", LogLevel::kDebug},
                                                        {"info", LogLevel::kInfo},
                                                        {"warning", LogLevel::kWarning},
                                                        {"error", LogLevel::kError},
                                                        {"off", LogLevel::kOff}};
  return names;
}

void InitLog(std::string_view process, LogLevel level) {
  Logger().set_pattern("%Y-%m-%d %H:%M:%S.%e %L [" + std::string(process) + "] %v");
  Logger().set_level(ToSpdlog(level));
  least_level = level;
}

LogLevel LeastLogLevel() { return least_level; }

void Log(LogLevel level, std::string_view message) { Logger().log(ToSpdlog(level), "{}", Redacted(std::string(message))); }

}  // namespace slabstream
