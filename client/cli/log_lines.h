// Log files that several processes write, as one log: lines in the order of their times.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace slabstream {

// A file that another process appends to. Missing files are empty; one that has become shorter is read from its beginning.
class LogFile {
 public:
  explicit LogFile(std::string path) : path_(std::move(path)) {}
  // The whole lines that were added since the last call, at most some MiB at a time: an empty answer means that there are no more.
  std::vector<std::string> ReadMore();

 private:
  std::string path_;
  std::uint64_t offset_ = 0;
};

// What a log line begins with (common/base/log.h): "2026-11-22 10:00:00.123". Texts compare like times. Empty: it has no time.
std::string TimeOfLogLine(const std::string& line);
// The same, for the time `seconds_ago` before now.
std::string LogTime(double seconds_ago);

// The lines of all files in the order of their times, those of one file as they were. A line without a time goes with the one before it.
// Drops lines before `since` (a LogTime; empty: none), and those without a time behind them.
std::vector<std::string> MergeLogLines(const std::vector<std::vector<std::string>>& files, const std::string& since = {});

}  // namespace slabstream
