// The progress of some work on stderr: on a terminal, a bar that is redrawn; otherwise a line for each change.
#pragma once

#include <string>

namespace slabstream {

class ProgressBar {
 public:
  ProgressBar(bool wanted, double total);  // total > 0: the value of `done` at the end
  ~ProgressBar() { Clear(); }
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  void Show(double done, const std::string& text);
  void Clear();  // before other output on a terminal

 private:
  bool wanted_, terminal_;
  double total_;
  std::string last_;  // the last text, so that nothing is printed twice
};

}  // namespace slabstream
