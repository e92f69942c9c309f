// ChartAxis: maps values to positions along a line of the plot, and places the labelled marks. Pure.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace slabstream {

enum class AxisScale { kLinear, kLog };

struct AxisSpec {
  std::string label;  // "frame time"
  std::string unit;   // "ms"; empty: a plain number
  AxisScale scale = AxisScale::kLinear;
  bool from_zero = false;  // linear: includes 0, whatever the values
  bool tight = false;      // linear: ends with the values, not at a mark
  bool at_values = false;  // marks at the values themselves if these are few: numbers of workers
};

class ChartAxis {
 public:
  // Covers the values, rounded outwards to marks. A log axis ignores values not above 0. Without values it covers [0, 1] or [1, 10].
  ChartAxis(AxisSpec spec, const std::vector<double>& values);

  double At(double value) const;                               // position in [0, 1], clamped; on a log axis values not above 0 are at 0
  bool Shows(double value) const;                              // finite, and above 0 on a log axis
  const std::vector<double>& marks() const { return marks_; }  // ascending, inside; 2 to 8 or so
  std::string Title() const;                                   // "frame time (ms)"

 private:
  AxisSpec spec_;
  double low_ = 0, high_ = 1;  // log: exponents of 10
  std::vector<double> marks_;
};

}  // namespace slabstream
