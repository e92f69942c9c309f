#include "laboratory/experiments/plots.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <span>

#include "laboratory/report/charts.h"
#include "laboratory/report/text.h"

namespace slabstream {
namespace {

enum Kind { kRenders, kCombines, kEncodes, kMakesPicture, kReceives };

int KindOf(Stage stage) {
  switch (stage) {
    case Stage::kEncode: return kEncodes;
    case Stage::kCombine: return kCombines;
    case Stage::kResolve: return kMakesPicture;
    default: return kRenders;
  }
}

}  // namespace

AxisSpec WorkersAxis(AxisScale scale) { return {.label = "workers p", .scale = scale, .at_values = true}; }

Figure TimelineFigure(const std::string& name, const std::string& title, const Timeline& timeline, double from, double to,
                      const std::string& caption, std::uint32_t most_workers) {
  constexpr double kMilliseconds = 1e3;
  const std::uint32_t workers = std::min(timeline.workers, most_workers);
  GanttChart chart{title, {"render", "combine", "encode", "make the picture", "pixels arrive"}, {}};
  for (std::uint32_t i = 0; i < workers; ++i) {
    for (const char* what : {"renders", "combines", "makes pictures", "receives"})
      chart.lanes.push_back({fmt::format("worker {} {}", i + 1, what), {}});
  }
  const auto add = [&](std::uint32_t worker, std::size_t lane, double begin, double end, int kind, std::uint32_t frame, std::string hint) {
    if (worker >= workers || end <= from || begin >= to) return;
    chart.lanes[4 * worker + lane].spans.push_back({(std::max(begin, from) - from) * kMilliseconds,
                                                    (std::min(end, to) - from) * kMilliseconds, kind, fmt::format("{}", frame + 1),
                                                    std::move(hint)});
  };
  for (const SimulatedSpan& span : timeline.spans) {
    add(span.worker, std::size_t(span.lane), span.begin, span.end, KindOf(span.stage), span.frame,
        fmt::format("frame {}, group {}, {}", span.frame + 1, span.group + 1, ToString(span.stage)));
  }
  for (const SimulatedMessage& message : timeline.messages) {
    add(message.to, 3, message.begin, message.end, kReceives, message.frame,
        fmt::format("frame {}, group {}, {} bytes from worker {}", message.frame + 1, message.group + 1, FormatNumber(message.bytes),
                    message.from + 1));
  }
  // Lanes without spans are left out, except "renders": a worker that does not render is worth seeing.
  std::erase_if(chart.lanes, [](const GanttLane& lane) { return lane.spans.empty() && !lane.name.ends_with("renders"); });
  return {name, DrawGantt(chart), caption};
}

Figure BoxCostFigure(const std::string& name, const std::string& title, const MeasuredFrame& frame, const std::string& caption) {
  HeatMap map{title, "render time of a box (ms)", {}};
  const Index3 size = frame.plan.setup.description.geometry.size;
  struct Cut {
    Axis across, right, up;
    const char* title;
    const char* right_name;
    const char* up_name;
  };
  constexpr std::array<Cut, 3> kCuts = {{{Axis::kX, Axis::kY, Axis::kZ, "cut at the middle x", "y", "z"},
                                         {Axis::kY, Axis::kX, Axis::kZ, "cut at the middle y", "x", "z"},
                                         {Axis::kZ, Axis::kX, Axis::kY, "cut at the middle z", "x", "y"}}};
  for (const Cut& cut : kCuts) {
    HeatPanel panel{cut.title, cut.right_name, cut.up_name, double(size[cut.right]), double(size[cut.up]), {}};
    const std::int32_t middle = size[cut.across] / 2;
    const std::span<const Box> boxes = frame.plan.layout->partition.boxes();
    for (std::size_t id = 0; id < boxes.size(); ++id) {
      const Box& box = boxes[id];
      if (box.begin[cut.across] > middle || box.end[cut.across] <= middle) continue;
      panel.rects.push_back({double(box.begin[cut.right]), double(box.begin[cut.up]), double(box.end[cut.right]), double(box.end[cut.up]),
                             frame.boxes[id].seconds * 1e3, fmt::format("box {}: {} ms", id, FormatNumber(frame.boxes[id].seconds * 1e3))});
    }
    map.panels.push_back(std::move(panel));
  }
  return {name, DrawHeatMap(map), caption};
}

}  // namespace slabstream
