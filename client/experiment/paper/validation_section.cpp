#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "client/experiment/machines.h"
#include "client/experiment/paper/setup.h"
#include "client/experiment/report/charts.h"

namespace slabstream {

Result<Section> ValidationSection(const PaperSetup& setup) {
  Table table{"validation",
              "Simulated and measured frames",
              {{"pipeline", ""}, {"N", ""}, {"p", ""}, {"measured", "ms"}, {"simulated", "ms"}, {"error", "%"}},
              {}};
  LineChart chart{"Simulated against measured", {"measured frame", "ms", AxisScale::kLog}, {"simulated frame", "ms", AxisScale::kLog}, {}};
  std::map<int, std::vector<double>> errors_by_workers;
  for (const int p : setup.MeasuredWorkers()) {
    for (const RendererKind renderer : {RendererKind::kSplat, RendererKind::kZBuffer}) {
      LineSeries series{fmt::format("{}, p = {}", NameOf(renderer), p), Origin::kSimulated, {}};
      for (const int size : setup.sizes()) {
        const FrameCase frame = setup.Frame(renderer, size, p);
        const Estimate measured = EstimateOf(setup.context().log(), ServiceKey(frame), "latency_ms");
        const Result<MeasuredFrame> costs = Recall(setup.context(), frame);
        if (!costs.ok()) return costs.status();
        const Result<Timeline> timeline = Simulate(*costs, ThisMachine(setup.context(), frame));
        if (!timeline.ok()) return timeline.status();
        const double simulated = timeline->frames.front().latency() * 1e3, error = 100 * (simulated / measured.median - 1);
        errors_by_workers[p].push_back(std::abs(error));
        table.rows.push_back({std::string(NameOf(renderer)), Cell::Parameter(size), Cell::Parameter(p), Cell(measured, Origin::kMeasured),
                              Cell(simulated, Origin::kSimulated), Cell(error, Origin::kSimulated)});
        series.points.push_back({measured.median, simulated});
      }
      std::ranges::sort(series.points, {}, &LinePoint::x);
      chart.series.push_back(std::move(series));
    }
  }
  LineSeries equal{"if both agreed", Origin::kMeasured, {}};
  for (const LineSeries& series : chart.series) {
    for (const LinePoint& point : series.points) equal.points.push_back({point.x, point.x});
  }
  std::ranges::sort(equal.points, {}, &LinePoint::x);
  chart.series.push_back(std::move(equal));
  Section section;
  section.title = "How far to trust the simulation";
  section.question = "Where this machine can run the workers, does the simulation say what the service does?";
  section.method =
      "The same frames by the service inside this process, one and two workers of one thread each, one frame in flight, in the same run; "
      "and simulated from the costs of their "
      "slabs on a model of this machine, whose constants are measured by themselves: operators, hand-overs on frames that hold next to "
      "nothing, and how much two "
      "renderers slow each other down. Nothing of the service's own times enters the simulation. What the simulation leaves out: lost "
      "messages, hiding by groups in front, whatever else the "
      "machine does.";
  for (const auto& [workers, errors] : errors_by_workers) {
    section.answer +=
        fmt::format("{}With {} the simulated time differs from the measured one by {:.0f} % in the median ({:.0f} % at most).",
                    section.answer.empty() ? "" : " ", workers == 1 ? "one worker" : fmt::format("{} workers", workers),
                    MedianOf(errors).median, *std::ranges::max_element(errors));
  }
  section.blocks = {Figure{"validation", DrawLines(chart),
                           "Times of the service along the horizontal axis; where both agree, a point lies on the solid line."},
                    std::move(table)};
  return section;
}

}  // namespace slabstream
