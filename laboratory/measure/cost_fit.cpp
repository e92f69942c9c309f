#include "laboratory/measure/cost_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numeric>
#include <utility>

namespace slabstream {
namespace {

constexpr std::size_t kSamplesATerm = 3;
constexpr int kFolds = 5;

using Units = unsigned;  // a set of work units, a bit each

bool Has(Units units, std::size_t unit) { return (units >> unit & 1U) != 0; }

double Measured(const CostSample& sample, Stage stage) { return double(sample.stage_ns[std::size_t(stage)]) * 1e-9; }

// The normal equations of a stage. Of the system that they are made of, each sample is a row: its amounts of work over its time. Constants
// that fit it make each row 1, so residuals are relative. Columns are scaled to length 1: their units differ by ten orders of magnitude.
struct System {
  Units units = 0;  // the stage's
  double rows = 0;
  WorkUnits lengths{}, sums{};  // by column: its length, and the sum of its scaled values
  std::array<WorkUnits, kWorkUnitCount> products{};
};

System MakeSystem(const StageModel& stage, std::span<const CostSample* const> samples) {
  System system{.rows = double(samples.size())};
  for (const WorkUnit unit : stage.units) system.units |= 1U << unsigned(unit);
  for (const CostSample* sample : samples) {
    const double time = Measured(*sample, stage.stage);
    for (std::size_t i = 0; i < system.sums.size(); ++i) {
      system.sums[i] += sample->work[i] / time;
      for (std::size_t k = 0; k < system.sums.size(); ++k) system.products[i][k] += sample->work[i] * sample->work[k] / (time * time);
    }
  }
  for (std::size_t i = 0; i < system.sums.size(); ++i) {
    system.lengths[i] = system.products[i][i] > 0 ? std::sqrt(system.products[i][i]) : 1;
  }
  for (std::size_t i = 0; i < system.sums.size(); ++i) {
    system.sums[i] /= system.lengths[i];
    for (std::size_t k = 0; k < system.sums.size(); ++k) system.products[i][k] /= system.lengths[i] * system.lengths[k];
  }
  return system;
}

// The 97.5 % quantile of Student's t (Abramowitz and Stegun, 26.7.5): within 1 % for 3 degrees of freedom, better for more.
double StudentQuantile(double freedom) {
  constexpr double z = 1.959964;
  constexpr double z3 = z * z * z, z5 = z3 * z * z, z7 = z5 * z * z;
  const double n = freedom;
  return z + (z3 + z) / (4 * n) + (5 * z5 + 16 * z3 + 3 * z) / (96 * n * n) + (3 * z7 + 19 * z5 + 17 * z3 - 15 * z) / (384 * n * n * n);
}

struct Solution {
  Units units = 0;                // those that are not held at 0
  WorkUnits seconds{}, widths{};  // widths: half of each constant's 95 % interval
  double squares = 0;             // the sum of squared residuals
};

// Least squares with constants of `units` alone. Units that depend on those before them are held at 0.
Solution Solve(const System& system, Units units) {
  // Inverts the products of the chosen columns in place, by Gauss and Jordan.
  constexpr double kDependent = 1e-10;  // of a column's squared length, when the columns before it are taken out
  auto m = system.products;
  for (std::size_t k = 0; k < m.size(); ++k) {
    if (!Has(units, k)) continue;
    const double pivot = m[k][k];
    if (pivot < kDependent) {
      units &= ~(1U << k);
      continue;
    }
    m[k][k] = 1;
    for (double& value : m[k]) value /= pivot;
    for (std::size_t i = 0; i < m.size(); ++i) {
      if (i == k) continue;
      const double factor = std::exchange(m[i][k], 0);
      for (std::size_t j = 0; j < m.size(); ++j) m[i][j] -= factor * m[k][j];
    }
  }
  Solution solution{.units = units, .squares = system.rows};
  const auto of_units = [&](auto&& function) {
    for (std::size_t i = 0; i < m.size(); ++i) {
      if (Has(units, i)) function(i);
    }
  };
  of_units([&](std::size_t i) {
    double scaled = 0;
    of_units([&](std::size_t k) { scaled += m[i][k] * system.sums[k]; });
    solution.seconds[i] = scaled / system.lengths[i];
    solution.squares -= scaled * system.sums[i];
  });
  solution.squares = std::max(solution.squares, 0.0);
  const double freedom = system.rows - std::popcount(units);
  if (freedom < 1) return solution;
  of_units([&](std::size_t i) {
    solution.widths[i] = StudentQuantile(freedom) * std::sqrt(solution.squares / freedom * m[i][i]) / system.lengths[i];
  });
  return solution;
}

// Least squares with no constant below 0: the best of the solutions with some units that have none.
Solution SolveNonNegative(const System& system) {
  Solution best{.squares = system.rows};
  for (Units units = system.units; units != 0; units = (units - 1) & system.units) {
    const Solution solution = Solve(system, units);
    const bool allowed = std::ranges::all_of(solution.seconds, [](double seconds) { return seconds >= 0; });
    if (allowed && solution.squares < best.squares) best = solution;
  }
  return best;
}

std::vector<TermFit> MakeTerms(const StageModel& stage, const System& system, const Solution& fit) {
  // A constant held at 0 gets the upper bound of the fit with all columns.
  const Solution unconstrained = Solve(system, system.units);
  std::vector<TermFit> terms;
  for (const WorkUnit unit : stage.units) {
    const auto i = std::size_t(unit);
    const Solution& upper = Has(fit.units, i) ? fit : unconstrained;
    terms.push_back(
        {unit, fit.seconds[i], std::max(fit.seconds[i] - fit.widths[i], 0.0), std::max(upper.seconds[i] + upper.widths[i], 0.0)});
  }
  return terms;
}

// Each sample's time as predicted by the fit to the other folds; sample i is in fold i mod kFolds.
std::vector<double> CrossPredict(const StageModel& stage, std::span<const CostSample* const> samples) {
  std::vector<double> predicted(samples.size());
  for (int fold = 0; fold < kFolds; ++fold) {
    std::vector<const CostSample*> others;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      if (int(i % kFolds) != fold) others.push_back(samples[i]);
    }
    const WorkUnits seconds = SolveNonNegative(MakeSystem(stage, others)).seconds;
    for (std::size_t i = std::size_t(fold); i < samples.size(); i += kFolds)
      predicted[i] = std::inner_product(seconds.begin(), seconds.end(), samples[i]->work.begin(), 0.0);
  }
  return predicted;
}

}  // namespace

Result<StageFit> FitStage(const StageModel& stage, std::span<const CostSample> samples) {
  std::vector<const CostSample*> used;
  for (const CostSample& sample : samples) {
    if (Measured(sample, stage.stage) > 0) used.push_back(&sample);
  }
  if (used.size() < kSamplesATerm * stage.units.size()) {
    return Status::InvalidArgument(fmt::format("the stage {} took time in {} samples, but {} constants need at least {}",
                                               ToString(stage.stage), used.size(), stage.units.size(), kSamplesATerm * stage.units.size()));
  }
  const System system = MakeSystem(stage, used);
  const Solution fit = SolveNonNegative(system);
  const std::vector<double> predicted = CrossPredict(stage, used);
  double missed = 0, measured = 0;
  for (std::size_t i = 0; i < used.size(); ++i) {
    const double time = Measured(*used[i], stage.stage);
    missed += std::abs(predicted[i] - time);
    measured += time;
  }
  return StageFit{
      .terms = MakeTerms(stage, system, fit), .residual = std::sqrt(fit.squares / system.rows), .prediction_error = missed / measured};
}

}  // namespace slabstream
