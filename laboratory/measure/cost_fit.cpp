#include "laboratory/measure/cost_fit.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace slabstream {
namespace {

constexpr std::size_t kSamplesATerm = 3;
constexpr int kFolds = 5;

using Eigen::MatrixXd;
using Eigen::VectorXd;

double Measured(const CostSample& sample, Stage stage) { return double(sample.stage_ns[std::size_t(stage)]) * 1e-9; }

// A row a sample: its amounts of work over its time. Constants that fit it make each row 1, so residuals are relative.
MatrixXd MakeSystem(const StageModel& stage, std::span<const CostSample* const> samples) {
  MatrixXd system(Eigen::Index(samples.size()), Eigen::Index(stage.units.size()));
  for (std::size_t row = 0; row < samples.size(); ++row) {
    for (std::size_t column = 0; column < stage.units.size(); ++column) {
      system(Eigen::Index(row), Eigen::Index(column)) =
          samples[row]->work[std::size_t(stage.units[column])] / Measured(*samples[row], stage.stage);
    }
  }
  return system;
}

VectorXd Ones(const MatrixXd& system) { return VectorXd::Ones(system.rows()); }

// Columns are first scaled to the same length: their units differ by ten orders of magnitude.
VectorXd ColumnLengths(const MatrixXd& a) {
  return a.colwise().norm().transpose().unaryExpr([](double n) { return n > 0 ? n : 1.0; });
}

VectorXd SolveOn(const MatrixXd& a, const VectorXd& b, const std::vector<Eigen::Index>& columns) {
  VectorXd x = VectorXd::Zero(a.cols());
  if (columns.empty()) return x;
  const VectorXd part = a(Eigen::all, columns).completeOrthogonalDecomposition().solve(b);
  for (std::size_t i = 0; i < columns.size(); ++i) x[columns[i]] = part[Eigen::Index(i)];
  return x;
}

// Lawson and Hanson's NNLS: argmin |a x - b| with x >= 0, and the columns that are not held at 0.
VectorXd SolveNonNegative(const MatrixXd& a, const VectorXd& b, std::vector<Eigen::Index>& free) {
  const double tolerance = 1e-12 * b.norm();
  VectorXd x = VectorXd::Zero(a.cols());
  free.clear();
  while (Eigen::Index(free.size()) < a.cols()) {
    // Frees the column with the largest gradient.
    const VectorXd gradient = a.transpose() * (b - a * x);
    Eigen::Index best = -1;
    for (Eigen::Index i = 0; i < a.cols(); ++i) {
      if (std::find(free.begin(), free.end(), i) != free.end() || gradient[i] <= tolerance) continue;
      if (best < 0 || gradient[i] > gradient[best]) best = i;
    }
    if (best < 0) break;
    free.push_back(best);
    VectorXd next = SolveOn(a, b, free);
    if (next[best] <= 0) {  // the gradient was rounding
      free.pop_back();
      break;
    }
    // Moves towards the solution as far as all values stay positive. A value that reaches 0 is held there.
    while (std::any_of(free.begin(), free.end(), [&](Eigen::Index i) { return next[i] <= 0; })) {
      double step = 1;
      for (const Eigen::Index i : free) {
        if (next[i] <= 0) step = std::min(step, x[i] / (x[i] - next[i]));
      }
      x += step * (next - x);
      std::erase_if(free, [&](Eigen::Index i) { return x[i] <= 1e-14 && next[i] <= 0; });
      next = SolveOn(a, b, free);
    }
    x = next;
  }
  return x;
}

VectorXd FitConstants(const StageModel& stage, std::span<const CostSample* const> samples, std::vector<Eigen::Index>& free) {
  const MatrixXd system = MakeSystem(stage, samples);
  const VectorXd lengths = ColumnLengths(system);
  return SolveNonNegative(system * lengths.cwiseInverse().asDiagonal(), Ones(system), free).cwiseQuotient(lengths);
}

// The 97.5 % quantile of Student's t (Abramowitz and Stegun, 26.7.5): within 1 % for 3 degrees of freedom, better for more.
double StudentQuantile(double freedom) {
  constexpr double z = 1.959964;
  constexpr double z3 = z * z * z, z5 = z3 * z * z, z7 = z5 * z * z;
  const double n = freedom;
  return z + (z3 + z) / (4 * n) + (5 * z5 + 16 * z3 + 3 * z) / (96 * n * n) + (3 * z7 + 19 * z5 + 17 * z3 - 15 * z) / (384 * n * n * n);
}

// Half the width of each constant's 95 % interval, if `columns` are the ones that were fitted.
VectorXd HalfWidths(const MatrixXd& system, const std::vector<Eigen::Index>& columns, const VectorXd& seconds) {
  VectorXd widths = VectorXd::Zero(seconds.size());
  const double freedom = double(system.rows()) - double(columns.size());
  if (columns.empty() || freedom < 1) return widths;
  const double variance = (system * seconds - Ones(system)).squaredNorm() / freedom;
  const VectorXd lengths = ColumnLengths(system);
  const MatrixXd scaled = (system * lengths.cwiseInverse().asDiagonal())(Eigen::all, columns);
  const MatrixXd covariance = (scaled.transpose() * scaled).completeOrthogonalDecomposition().pseudoInverse();
  for (std::size_t i = 0; i < columns.size(); ++i) {
    widths[columns[i]] =
        StudentQuantile(freedom) * std::sqrt(variance * covariance(Eigen::Index(i), Eigen::Index(i))) / lengths[columns[i]];
  }
  return widths;
}

std::vector<TermFit> MakeTerms(const StageModel& stage, const MatrixXd& system, const VectorXd& seconds,
                               const std::vector<Eigen::Index>& free) {
  const VectorXd widths = HalfWidths(system, free, seconds);
  // A constant held at 0 gets the upper bound of the fit with all columns.
  std::vector<Eigen::Index> all(stage.units.size());
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = Eigen::Index(i);
  const VectorXd unconstrained = SolveOn(system, Ones(system), all);
  const VectorXd all_widths = HalfWidths(system, all, unconstrained);

  std::vector<TermFit> terms;
  for (const Eigen::Index i : all) {
    const bool held = std::find(free.begin(), free.end(), i) == free.end();
    const double high = held ? unconstrained[i] + all_widths[i] : seconds[i] + widths[i];
    terms.push_back({stage.units[std::size_t(i)], seconds[i], std::max(seconds[i] - widths[i], 0.0), std::max(high, 0.0)});
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
    std::vector<Eigen::Index> free;
    const VectorXd seconds = FitConstants(stage, others, free);
    for (std::size_t i = std::size_t(fold); i < samples.size(); i += kFolds) {
      for (std::size_t unit = 0; unit < stage.units.size(); ++unit) {
        predicted[i] += seconds[Eigen::Index(unit)] * samples[i]->work[std::size_t(stage.units[unit])];
      }
    }
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
  std::vector<Eigen::Index> free;
  const VectorXd seconds = FitConstants(stage, used, free);
  const MatrixXd system = MakeSystem(stage, used);
  const std::vector<double> predicted = CrossPredict(stage, used);
  double missed = 0, measured = 0;
  for (std::size_t i = 0; i < used.size(); ++i) {
    const double time = Measured(*used[i], stage.stage);
    missed += std::abs(predicted[i] - time);
    measured += time;
  }
  return StageFit{.terms = MakeTerms(stage, system, seconds, free),
                  .residual = std::sqrt((system * seconds - Ones(system)).squaredNorm() / double(used.size())),
                  .prediction_error = missed / measured};
}

}  // namespace slabstream
