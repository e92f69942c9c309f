// LimitedLog: lines about what others send, which may come by the thousand. Some are written at once, then one at a time; the next one
// tells how many were left out. One thread at a time.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "common/base/log.h"
#include "common/base/time.h"

namespace slabstream {

class LimitedLog {
 public:
  // So many lines at once, and then one for each `each`, > 0.
  explicit LimitedLog(std::int64_t at_once = kAtOnce, Duration each = kEach) : at_once_(at_once), each_(each), allowed_(at_once) {}

  void Write(LogLevel level, std::string_view message) {
    if (const std::optional<std::string> line = LineFor(message, MonotonicNow())) Log(level, *line);
  }
  void Warning(std::string_view message) { Write(LogLevel::kWarning, message); }

  // What to write for a message at `now`; nullopt: it is left out.
  std::optional<std::string> LineFor(std::string_view message, Time now) {
    const auto earned = std::int64_t((now - last_) / each_);
    if (earned > 0) {
      allowed_ = std::min(at_once_, allowed_ + earned);
      last_ = allowed_ == at_once_ ? now : last_ + earned * each_;
    }
    if (allowed_ == 0) {
      ++left_out_;
      return std::nullopt;
    }
    --allowed_;
    std::string line(message);
    if (left_out_ > 0) line += " (" + std::to_string(std::exchange(left_out_, 0)) + " more were left out before)";
    return line;
  }

  static constexpr std::int64_t kAtOnce = 10;  // lines
  static constexpr Duration kEach = std::chrono::seconds(1);

 private:
  std::int64_t at_once_;
  Duration each_;
  std::int64_t allowed_;
  std::uint64_t left_out_ = 0;
  Time last_{};  // up to when lines were earned
};

}  // namespace slabstream
