#include "client/experiment/report/axis.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <utility>

namespace slabstream {
namespace {

constexpr double kWantedIntervals = 5;

// 1, 2 or 5 times a power of ten, at least `step`.
double RoundStep(double step) {
  const double power = std::pow(10, std::floor(std::log10(step)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= step * (1 - 1e-9)) return factor * power;
  }
  return 10 * power;
}

// Marks at 1, 2 and 5 times powers of ten that enclose [low, high]; only the powers where that would be too many.
std::vector<double> LogMarks(double low, double high) {
  std::vector<double> marks;
  const int first = int(std::floor(std::log10(low) + 1e-9)), last = int(std::ceil(std::log10(high) - 1e-9));
  const std::array<double, 3> all = {1, 2, 5};
  const std::size_t factors = last - first > 3 ? 1 : all.size();
  const int every = std::max(1, (last - first + 7) / 8);  // powers
  for (int exponent = first; exponent <= last; exponent += every) {
    for (std::size_t i = 0; i < factors; ++i) marks.push_back(all[i] * std::pow(10, exponent));
  }
  if (marks.back() < high) marks.push_back(marks.back() * std::pow(10, every));
  while (marks.size() > 2 && marks[1] <= low * (1 + 1e-9)) marks.erase(marks.begin());
  while (marks.size() > 2 && marks[marks.size() - 2] >= high * (1 - 1e-9)) marks.pop_back();
  return marks;
}

}  // namespace

ChartAxis::ChartAxis(AxisSpec spec, const std::vector<double>& values) : spec_(std::move(spec)) {
  std::vector<double> shown;
  std::ranges::copy_if(values, std::back_inserter(shown), [this](double value) { return Shows(value); });
  const bool log = spec_.scale == AxisScale::kLog;
  double low = shown.empty() ? (log ? 1 : 0) : *std::ranges::min_element(shown);
  double high = shown.empty() ? (log ? 10 : 1) : *std::ranges::max_element(shown);
  if (log) {
    if (high <= low) high = low * 2;
    marks_ = LogMarks(low, high);
    low_ = std::log10(marks_.front());
    high_ = std::log10(marks_.back());
    return;
  }
  if (spec_.from_zero) {
    low = std::min(low, 0.0);
    high = std::max(high, 0.0);
  }
  if (high <= low) high = low + std::max(1e-9, std::abs(low) * 0.1 + (low == 0 ? 1 : 0));
  const double step = RoundStep((high - low) / kWantedIntervals);
  const auto first = std::int64_t(std::floor(low / step + 1e-9)), last = std::int64_t(std::ceil(high / step - 1e-9));
  for (std::int64_t i = first; i <= last; ++i) marks_.push_back(double(i) * step);
  low_ = spec_.tight ? low : marks_.front();
  high_ = spec_.tight ? high : marks_.back();
  std::erase_if(marks_, [this](double mark) { return mark < low_ || mark > high_; });
}

bool ChartAxis::Shows(double value) const { return std::isfinite(value) && (spec_.scale == AxisScale::kLinear || value > 0); }

double ChartAxis::At(double value) const {
  if (!Shows(value)) return 0;
  const double place = spec_.scale == AxisScale::kLog ? std::log10(value) : value;
  return std::clamp((place - low_) / (high_ - low_), 0.0, 1.0);
}

std::string ChartAxis::Title() const { return spec_.unit.empty() ? spec_.label : fmt::format("{} ({})", spec_.label, spec_.unit); }

}  // namespace slabstream
