// Log lines go to stderr, one a line, with date, time (of this host's zone) and level. A small front so that only log.cpp pays for the
// logging library. Thread-safe.
#pragma once

#include <map>
#include <string>
#include <string_view>

namespace slabstream {

enum class LogLevel { kDebug, kInfo, kWarning, kError, kOff };

// What --log-level takes.
const std::map<std::string, LogLevel>& LogLevelNames();

// `process` names the writer in each line ("coordinator", "worker 3"). Called once, by main.
void InitLog(std::string_view process, LogLevel level);

// Lines of this level and above are written.
LogLevel LeastLogLevel();

void Log(LogLevel level, std::string_view message);
inline void LogDebug(std::string_view message) { Log(LogLevel::kDebug, message); }
inline void LogInfo(std::string_view message) { Log(LogLevel::kInfo, message); }
inline void LogWarning(std::string_view message) { Log(LogLevel::kWarning, message); }
inline void LogError(std::string_view message) { Log(LogLevel::kError, message); }

}  // namespace slabstream
