#include "laboratory/report/axis.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <iterator>
#include <utility>

namespace slabstream {
namespace {

constexpr double kWantedIntervals = 5;
constexpr std::size_t kMostValueMarks = 12;

// 1, 2 or 5 times a power of ten, at least `step`.
double RoundStep(double step) {
  const double power = std::pow(10, std::floor(std::log10(step)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= step * (1 - 1e-9)) return factor * power;
  }
  return 10 * power;
}

// Marks at these factors times powers of ten; the outer two enclose [low, high].
std::vector<double> EnclosingMarks(double low, double high, std::initializer_list<double> factors) {
  std::vector<double> marks;
  const int first = int(std::floor(std::log10(low) + 1e-9)), last = int(std::ceil(std::log10(high) - 1e-9));
  for (int exponent = first; exponent <= last; ++exponent) {
    for (const double factor : factors) marks.push_back(factor * std::pow(10, exponent));
  }
  while (marks.size() > 2 && marks[1] <= low * (1 + 1e-9)) marks.erase(marks.begin());
  while (marks.size() > 2 && marks[marks.size() - 2] >= high * (1 - 1e-9)) marks.pop_back();
  return marks;
}

// Marks at 1, 2 and 5 times powers of ten, closer ones if these are too few. If they are too many, only powers between the outer two marks,
// and none too close to an outer one.
std::vector<double> LogMarks(double low, double high) {
  constexpr std::size_t kLeast = 4, kMost = 9;
  constexpr double kCrowded = 0.05;  // of the axis
  std::vector<double> marks = EnclosingMarks(low, high, {1, 2, 5});
  if (marks.size() < kLeast) marks = EnclosingMarks(low, high, {1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8});
  const double begin = marks.front(), end = marks.back();
  const auto thin_out = [&](auto&& unwanted) {
    std::erase_if(marks, [&](double mark) { return mark != begin && mark != end && unwanted(std::log10(mark)); });
  };
  if (marks.size() > kMost) thin_out([](double exponent) { return std::abs(exponent - std::round(exponent)) > 1e-6; });
  const int first = int(std::floor(std::log10(begin))), every = int(marks.size()) / int(kMost + 1) + 1;
  thin_out([&](double exponent) { return every > 1 && (int(std::round(exponent)) - first) % every != 0; });
  const double length = std::log10(end / begin);
  thin_out([&](double exponent) { return std::min(exponent - std::log10(begin), std::log10(end) - exponent) < kCrowded * length; });
  return marks;
}

}  // namespace

ChartAxis::ChartAxis(AxisSpec spec, const std::vector<double>& values) : spec_(std::move(spec)) {
  std::vector<double> shown;
  std::ranges::copy_if(values, std::back_inserter(shown), [this](double value) { return Shows(value); });
  const bool log = spec_.scale == AxisScale::kLog;
  if (spec_.at_values) {
    std::vector<double> distinct = shown;
    std::ranges::sort(distinct);
    distinct.erase(std::unique(distinct.begin(), distinct.end()), distinct.end());
    if (distinct.size() >= 2 && distinct.size() <= kMostValueMarks) {
      marks_ = std::move(distinct);
      low_ = log ? std::log10(marks_.front()) : marks_.front();
      high_ = log ? std::log10(marks_.back()) : marks_.back();
      return;
    }
  }
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
