#include "client/cli/log_lines.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <utility>

namespace slabstream {
namespace {

constexpr std::string_view kShape = "dddd-dd-dd dd:dd:dd.ddd";  // d: a digit
constexpr std::size_t kMostAtOnce = std::size_t{4} << 20;

}  // namespace

std::vector<std::string> LogFile::ReadMore() {
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(path_, error);
  if (error) return {};
  if (bytes < offset_) offset_ = 0;
  std::ifstream file(path_, std::ios::binary);
  file.seekg(std::streamoff(offset_));
  std::string text(std::size_t(std::min<std::uintmax_t>(bytes - offset_, kMostAtOnce)), '\0');
  file.read(text.data(), std::streamsize(text.size()));
  text.resize(std::size_t(file.gcount()));
  std::size_t end = text.rfind('\n') + 1;  // 0: none; the last line may still be under way
  if (end == 0 && text.size() == kMostAtOnce) end = text.size();
  offset_ += end;
  std::vector<std::string> lines;
  for (std::size_t begin = 0; begin < end;) {
    const std::size_t newline = std::min(text.find('\n', begin), end);
    lines.push_back(text.substr(begin, newline - begin));
    begin = newline + 1;
  }
  return lines;
}

std::string TimeOfLogLine(const std::string& line) {
  const auto fits = [](char shape, char c) { return shape == 'd' ? std::isdigit(static_cast<unsigned char>(c)) != 0 : shape == c; };
  const bool has_time = line.size() >= kShape.size() && std::equal(kShape.begin(), kShape.end(), line.begin(), fits);
  return has_time ? line.substr(0, kShape.size()) : std::string();
}

std::string LogTime(double seconds_ago) {
  using namespace std::chrono;
  const auto then = system_clock::now() - duration_cast<system_clock::duration>(duration<double>(seconds_ago));
  const auto ms = duration_cast<milliseconds>(then.time_since_epoch()).count() % 1000;
  return fmt::format("{:%Y-%m-%d %H:%M:%S}.{:03}", fmt::localtime(system_clock::to_time_t(then)), ms);
}

std::vector<std::string> MergeLogLines(const std::vector<std::vector<std::string>>& files, const std::string& since) {
  std::vector<std::pair<std::string, const std::string*>> timed;
  for (const std::vector<std::string>& lines : files) {
    std::string time;
    for (const std::string& line : lines) {
      if (std::string own = TimeOfLogLine(line); !own.empty()) time = std::max(time, own);  // a clock that was set back moves no line
      if (time >= since) timed.emplace_back(time, &line);
    }
  }
  std::ranges::stable_sort(timed, {}, &decltype(timed)::value_type::first);
  std::vector<std::string> merged;
  merged.reserve(timed.size());
  for (const auto& [time, line] : timed) merged.push_back(*line);
  return merged;
}

}  // namespace slabstream
