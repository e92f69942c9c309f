#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "laboratory/experiments/paper/setup.h"
#include "laboratory/experiments/plots.h"
#include "laboratory/measure/splat_loops.h"
#include "laboratory/measure/thread_time.h"
#include "laboratory/report/charts.h"

namespace slabstream {
namespace {

constexpr std::array<int, 6> kWidths = {3, 5, 9, 13, 17, 25};  // k
constexpr int kRuns = 3, kFigureWorkers = 10;
constexpr int kWide = 9;  // k from which a voxel's footprint costs more than all its other work
// Class II reaches 52 % of the cube at most.
constexpr std::array<double, 6> kOccupancies = {0.05, 0.1, 0.2, 0.3, 0.4, 0.5};

Json WidthKey(int side, int k) { return {{"what", "footprint"}, {"N", side}, {"k", k}}; }

// A footprint of k taps is cut at three sigma on both sides.
double SigmaOf(int k) { return (k - 0.5) / 6; }

Trial MeasureWidth(int side, int k) {
  const auto run = [=]() -> Json {
    DenseSlice slice(side, SigmaOf(k), 1);
    return Json{{"plain_seconds", MedianSecondsOf(kRuns, [&] { slice.SplatPlainly(); })},
                {"kernel_seconds", MedianSecondsOf(kRuns, [&] { slice.SplatByKernels(); })},
                {"taps", slice.taps()}};
  };
  return {WidthKey(side, k), run, 0.05 + double(side) * side * k * k * 1e-8};
}

FrameCase OccupancyFrame(const PaperSetup& setup, double occupancy) {
  FrameCase frame = setup.Frame(Splatting(), setup.large_size(), kFigureWorkers);
  frame.volume = SphereCase({SphereClass::kFilled, setup.large_size(), occupancy}, kTranslucentSphere);
  return frame;
}

// The paper's splatting stage turns voxels into pixels of sheets; ours also finds where these pixels are.
double SplatSeconds(const MeasuredFrame::Cost& box) {
  return box.stage_seconds[std::size_t(Stage::kTransform)] + box.stage_seconds[std::size_t(Stage::kSplat)];
}
// Milliseconds of the slowest slab.
Estimate SlowestSplat(const PaperSetup& setup, const FrameCase& frame) {
  const std::vector<MeasuredFrame> repeats = RecallRepeats(setup.context(), frame);
  std::vector<double> slowest;
  for (const MeasuredFrame& repeat : repeats) {
    double& most = slowest.emplace_back(0);
    for (const MeasuredFrame::Cost& box : repeat.boxes) most = std::max(most, SplatSeconds(box) * 1e3);
  }
  return MedianOf(std::move(slowest));
}
LinePoint PointOf(double x, const Estimate& y) { return {x, y.median, y.low, y.high}; }

// Exponent of y as a power of x: least squares of log y on log x, over wide footprints.
double Exponent(std::vector<LinePoint> points) {
  std::erase_if(points, [](const LinePoint& point) { return point.x < kWide; });
  double sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (const LinePoint& p : points) {
    const double x = std::log(p.x), y = std::log(p.y);
    sx += x;
    sy += y;
    sxx += x * x;
    sxy += x * y;
  }
  const auto n = double(points.size());
  return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

}  // namespace

std::vector<Trial> FootprintTrials(const PaperSetup& setup) {
  std::vector<Trial> trials;
  trials.reserve(std::size(kWidths) + 2 * std::size(kOccupancies));
  for (const int k : kWidths) trials.push_back(MeasureWidth(setup.large_size(), k));
  for (const double occupancy : kOccupancies) {
    trials.push_back(BoxCostTrial(setup.context(), OccupancyFrame(setup, occupancy)));
    trials.push_back(FinishTrial(setup.context(), OccupancyFrame(setup, occupancy)));
  }
  return trials;
}

Section FootprintSection(const PaperSetup& setup) {
  Table table{"figure-8-splatting", "Figure 8 in numbers", {"curve", "N", "p", "k", "C (%)", "time (ms)"}, {}};

  LineChart by_workers{"Figure 8a: splatting a worker's slab", WorkersAxis(AxisScale::kLinear), {"time", "ms", AxisScale::kLog}, {}};
  for (const int size : setup.sizes()) {
    LineSeries series{fmt::format("N = {}", size), Origin::kMeasured, {}};
    for (const int p : setup.workers()) {
      const Estimate ms = SlowestSplat(setup, setup.Frame(Splatting(), size, p));
      series.points.push_back(PointOf(p, ms));
      table.rows.push_back({"a: slab", Chosen(size), Chosen(p), {}, {}, Measured(ms)});
    }
    by_workers.series.push_back(std::move(series));
  }

  LineChart by_width{"Figure 8b: a filled slice against footprint width",
                     {"footprint width k", "voxels", AxisScale::kLog},
                     {"time of a slice", "ms", AxisScale::kLog},
                     {}};
  LineSeries plain{"k x k additions a voxel", Origin::kMeasured, {}}, kernels{"k + k by our kernels", Origin::kMeasured, {}};
  for (const int k : kWidths) {
    const Json key = WidthKey(setup.large_size(), k);
    for (auto [series, number] : {std::pair{&plain, "plain_seconds"}, {&kernels, "kernel_seconds"}}) {
      const Estimate ms = EstimateOf(setup.context().log(), key, number).Times(1e3);
      series->points.push_back(PointOf(k, ms));
      table.rows.push_back({"b: " + series->name, Chosen(setup.large_size()), {}, Chosen(k), {}, Measured(ms)});
    }
  }
  const double plain_power = Exponent(plain.points), kernel_power = Exponent(kernels.points);
  by_width.series = {plain, kernels};

  LineChart by_occupancy{fmt::format("Figure 8c: splatting against occupancy, N = {}, p = {}", setup.large_size(), kFigureWorkers),
                         {"occupied voxels C", "%"},
                         {"time of the slowest slab", "ms", AxisScale::kLinear, true},
                         {}};
  LineSeries occupancy{"class II", Origin::kMeasured, {}};
  for (const double c : kOccupancies) {
    const Estimate ms = SlowestSplat(setup, OccupancyFrame(setup, c));
    occupancy.points.push_back(PointOf(c * 100, ms));
    table.rows.push_back({"c: occupancy", Chosen(setup.large_size()), Chosen(kFigureWorkers), {}, Chosen(c * 100), Measured(ms)});
  }
  const double growth = occupancy.points.back().y / occupancy.points.front().y,
               occupied = occupancy.points.back().x / occupancy.points.front().x;
  by_occupancy.series = {occupancy};

  Section section;
  section.title = "Splatting: figure 8";
  section.question = "How does the splatting stage grow with the workers, with the width of the footprint and with occupancy?";
  section.method = fmt::format(
      "a: class-I spheres in equal slabs; the slab that takes longest, rendered alone on one thread (places of voxels and splatting). b: a "
      "filled slice of "
      "{0} x {0} voxels at a pixel a voxel, through the kernels of the pipeline, which filter along one axis and then along the other, and "
      "through the loop that "
      "adds k x k pixels for each voxel as the paper does. c: class-II spheres of growing occupancy.",
      setup.large_size());
  section.answer = fmt::format(
      "From k = {} on plain splatting grows as k to the power of {:.2f} (the paper: quadratic), our kernels as k to the power of {:.2f}; "
      "from "
      "{:.0f} % to {:.0f} % "
      "of occupied voxels, {:.0f} times as many, the time grows {:.1f} times (the paper: linear).",
      kWide, plain_power, kernel_power, occupancy.points.front().x, occupancy.points.back().x, occupied, growth);
  section.blocks = {
      Figure{"figure-8a-splatting", DrawLines(by_workers), "The slab that takes longest. The paper prints its curve without numbers."},
      Figure{"figure-8b-footprint", DrawLines(by_width), "Both axes logarithmic, so a straight line is a power of k."},
      Figure{
          "figure-8c-occupancy", DrawLines(by_occupancy),
          "One sphere in p slabs, and the slowest of them. The paper gave every processor C N³ / p voxels and went up to C = 1; a sphere "
          "in a cube ends at 52 %."},
      std::move(table)};
  return section;
}

}  // namespace slabstream
