#include "client/cli/progress_bar.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <iostream>

namespace slabstream {

ProgressBar::ProgressBar(bool wanted, double total) : wanted_(wanted), terminal_(::isatty(STDERR_FILENO) == 1), total_(total) {}

void ProgressBar::Clear() {
  if (terminal_ && !last_.empty()) std::cerr << "\r\033[K" << std::flush;
  last_.clear();
}

void ProgressBar::Show(double done, const std::string& text) {
  if (!wanted_ || text == last_) return;
  last_ = text;
  if (!terminal_) {
    std::cerr << text << std::endl;
    return;
  }
  constexpr int kWidth = 30;  // characters
  const int filled = std::clamp(int(std::lround(kWidth * done / total_)), 0, kWidth);
  std::cerr << fmt::format("\r\033[K[{:=<{}}{:.<{}}] {}", "", filled, "", kWidth - filled, text) << std::flush;
}

}  // namespace slabstream
