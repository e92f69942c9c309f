#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "laboratory/experiments/paper/printed.h"
#include "laboratory/experiments/paper/setup.h"
#include "laboratory/experiments/plots.h"
#include "laboratory/measure/thread_time.h"
#include "laboratory/measure/transform_loops.h"
#include "laboratory/report/charts.h"
#include "laboratory/report/text.h"

namespace slabstream {
namespace {

constexpr TransformMatrix kMatrix = {{{0.7F, -0.4F, 0.2F, 80.0F}, {0.1F, 0.6F, -0.7F, 150.0F}, {0.5F, 0.4F, 0.8F, 10.0F}}};
constexpr int kRuns = 3;

struct Loop {
  std::string_view name;
  void (*store)(const TransformMatrix&, const Index3&, TransformedPoints&);
};
constexpr Loop kProduct = {"product", StoreProductScalar}, kProductVector = {"product in vectors", StoreProductVector},
               kIncrements = {"increments in vectors", StoreIncrementsVector};

// The slab of the worker with the most slices.
Index3 SlabOf(int size, int workers) { return {size, size, (size + workers - 1) / workers}; }

Json Key(int size, int workers, std::string_view loop) {
  return {{"what", "transform"}, {"N", size}, {"workers", workers}, {"loop", loop}};
}

Trial Measure(int size, int workers, const Loop& loop) {
  const auto run = [=]() -> Json {
    const Index3 slab = SlabOf(size, workers);
    TransformedPoints points(slab);
    loop.store(kMatrix, slab, points);  // allocates the memory
    return Json{{"seconds", MedianSecondsOf(kRuns, [&] { loop.store(kMatrix, slab, points); })}};
  };
  return {Key(size, workers, loop.name), run, 0.02 + double(size) * size * size / workers * 2e-8};
}

// The power of N in time = c N^power, through two sizes.
double PowerOf(double small, double small_seconds, double large, double large_seconds) {
  return std::log(large_seconds / small_seconds) / std::log(large / small);
}

}  // namespace

std::vector<Trial> TransformTrials(const PaperSetup& setup) {
  std::vector<Trial> trials;
  for (const int p : setup.workers()) {
    for (const int size : setup.sizes()) trials.push_back(Measure(size, p, kIncrements));
    for (const Loop& loop : {kProduct, kProductVector, kIncrements}) trials.push_back(Measure(setup.table_size(), p, loop));
  }
  return trials;
}

Section TransformSection(const PaperSetup& setup) {
  const TrialLog& log = setup.context().log();
  const auto estimate = [&](int size, int p, const Loop& loop) { return EstimateOf(log, Key(size, p, loop.name), "seconds"); };

  LineChart chart{"Figure 7: transforming a worker's slab", WorkersAxis(AxisScale::kLinear), {"time", "ms", AxisScale::kLog}, {}};
  for (const int size : setup.sizes()) {
    LineSeries series{fmt::format("N = {}", size), Origin::kMeasured, {}};
    for (const int p : setup.workers()) {
      const Estimate e = estimate(size, p, kIncrements);
      series.points.push_back({double(p), e.median * 1e3, e.low * 1e3, e.high * 1e3});
    }
    chart.series.push_back(std::move(series));
  }
  LineSeries paper{fmt::format("N = {}", setup.table_size()), Origin::kPaper, {}};
  for (std::size_t i = 0; i < printed::kWorkers.size(); ++i) {
    paper.points.push_back({double(printed::kWorkers[i]), printed::kTransformIncrements[i] * 1e3});
  }
  chart.series.push_back(std::move(paper));

  Table table{"table-1-transform",
              fmt::format("Table 1. Transform of a slab, N = {}", setup.table_size()),
              {"p", "product (ms)", "product in vectors (ms)", "increments in vectors (ms)", "speed-up", "speed-up over vectors",
               "paper: product (ms)", "paper: increments (ms)", "paper: speed-up"},
              {}};
  std::vector<double> over_scalar, over_vector;  // time of a product over that of increments
  for (const int p : setup.workers()) {
    const Estimate product = estimate(setup.table_size(), p, kProduct), vectors = estimate(setup.table_size(), p, kProductVector),
                   increments = estimate(setup.table_size(), p, kIncrements);
    over_scalar.push_back(product.median / increments.median);
    over_vector.push_back(vectors.median / increments.median);
    std::vector<Cell> row = {Chosen(p),
                             Measured(product.Times(1e3)),
                             Measured(vectors.Times(1e3)),
                             Measured(increments.Times(1e3)),
                             Measured(over_scalar.back()),
                             Measured(over_vector.back())};
    if (const auto found = std::ranges::find(printed::kWorkers, p); found != printed::kWorkers.end()) {
      const auto i = std::size_t(found - printed::kWorkers.begin());
      row.insert(row.end(), {FromPaper(printed::kTransformProduct[i] * 1e3), FromPaper(printed::kTransformIncrements[i] * 1e3),
                             FromPaper(printed::kTransformProduct[i] / printed::kTransformIncrements[i])});
    }
    row.resize(table.columns.size());
    table.rows.push_back(std::move(row));
  }

  const int small = setup.sizes()[setup.sizes().size() / 2 - 1], large = setup.sizes().back();
  const int p = std::ranges::find(setup.workers(), 15) != setup.workers().end() ? 15 : 10;
  const double power = PowerOf(small, estimate(small, p, kIncrements).median, large, estimate(large, p, kIncrements).median);
  std::vector<double> printed_gain;
  for (std::size_t i = 0; i < printed::kWorkers.size(); ++i) {
    printed_gain.push_back(printed::kTransformProduct[i] / printed::kTransformIncrements[i]);
  }
  Section section;
  section.title = "Transform: table 1 and figure 7";
  section.question =
      "How much do running additions gain over a matrix product for every voxel, and how does the transform grow with N and p?";
  section.method =
      "The largest slab of a worker, N x N x N/p voxels, is transformed into three stored arrays of coordinates, on one thread: by a "
      "product a voxel, "
      "compiled without vectors; by the same in vectors; by running additions (along a beam in vectors; from beam to beam and slice to "
      "slice "
      "one coordinate after the other, where the paper adds whole beams and slices). "
      "The transform "
      "needs no communication, so the slab of one worker is measured for every p. Slabstream's renderers do not run it in this form: they "
      "step "
      "through the places of a beam in fixed point and store no coordinates.";
  section.answer = fmt::format(
      "Over all p, increments are from {} to {} as a product a voxel without vectors (the paper: {:.1f} to {:.1f} times as fast), and from "
      "{} to {} as one in vectors. Time grows as N to the power of {:.2f} from "
      "N = {} to {} at p = {} (the paper: {:.2f} ms to {:.2f} ms for N = {} to {} at p = 15, a power of {:.2f}).",
      FormatSpeed(std::ranges::min(over_scalar)), FormatSpeed(std::ranges::max(over_scalar)), std::ranges::min(printed_gain),
      std::ranges::max(printed_gain), FormatSpeed(std::ranges::min(over_vector)), FormatSpeed(std::ranges::max(over_vector)), power, small,
      large, p, printed::kCubicSeconds[0] * 1e3, printed::kCubicSeconds[1] * 1e3, printed::kCubicSizes[0], printed::kCubicSizes[1],
      PowerOf(printed::kCubicSizes[0], printed::kCubicSeconds[0], printed::kCubicSizes[1], printed::kCubicSeconds[1]));
  section.blocks = {Figure{"figure-7-transform", DrawLines(chart),
                           "Time of the incremental transform of one worker's slab. Whiskers: intervals of the median."},
                    std::move(table)};
  return section;
}

}  // namespace slabstream
