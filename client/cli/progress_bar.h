// How far some work is, on stderr: a bar that is redrawn if that is a terminal, else a line whenever something changes.
#pragma once

#include <string>

namespace slabstream {

class ProgressBar {
 public:
  ProgressBar(bool wanted, double total);  // total > 0: what `done` reaches
  ~ProgressBar();                          // clears the bar
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  void Show(double done, const std::string& text);

 private:
  bool wanted_, terminal_;
  double total_;
  std::string last_;  // what stands there, so that nothing is said twice
};

}  // namespace slabstream
