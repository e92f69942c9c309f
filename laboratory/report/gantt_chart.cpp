#include <fmt/format.h>

#include <algorithm>

#include "laboratory/report/charts.h"
#include "laboratory/report/plot_area.h"
#include "laboratory/report/text.h"

namespace slabstream {
namespace {

constexpr double kTop = 40, kWidth = 600, kBottom = 48;
constexpr double kLabelledLane = 16;  // height of lanes in which labels have room

}  // namespace

std::string DrawGantt(const GanttChart& chart) {
  std::vector<double> times = {0};
  double names = 0;
  for (const GanttLane& lane : chart.lanes) {
    names = std::max(names, TextWidth(lane.name));
    for (const GanttSpan& span : lane.spans) times.push_back(span.end);
  }
  const ChartAxis time({"time", "ms", AxisScale::kLinear, true, true}, times);
  Legend legend{Legend::Swatch::kBar, {}, {}};
  for (const std::string& kind : chart.kinds) legend.entries.push_back({kind, Origin::kMeasured});
  const double lane_height = chart.lanes.size() > 48 ? 9 : kLabelledLane;
  PlotArea area{names + 20, kTop, kWidth, lane_height * double(chart.lanes.size()), 0, 0};
  area.total_width = area.x + kWidth + LegendWidth(legend);
  area.total_height = kTop + std::max(area.height + kBottom, LegendHeight(legend));

  SvgCanvas canvas(area.total_width, area.total_height, chart.title);
  canvas.Text({8, 20}, chart.title, TextAnchor::kStart, "title");
  for (const double mark : time.marks()) {
    const double x = area.x + time.At(mark) * area.width;
    canvas.Line({x, area.y}, {x, area.y + area.height}, "grid");
  }
  for (std::size_t i = 0; i < chart.lanes.size(); ++i) {
    const GanttLane& lane = chart.lanes[i];
    const double top = area.y + double(i) * lane_height;
    canvas.Text({area.x - 8, top + lane_height / 2 + 4}, lane.name, TextAnchor::kEnd, "small");
    for (const GanttSpan& span : lane.spans) {
      const double x = area.x + time.At(span.begin) * area.width, width = (time.At(span.end) - time.At(span.begin)) * area.width;
      canvas.Bar(x, top + 2, std::max(width, 0.4), lane_height - 4, span.kind, Origin::kMeasured,
                 fmt::format("{}: {}, {} to {} ms", lane.name, span.hint, FormatNumber(span.begin), FormatNumber(span.end)));
      if (lane_height >= kLabelledLane && width > TextWidth(span.label) + 2)
        canvas.Text({x + width / 2, top + lane_height / 2 + 3.4}, span.label, TextAnchor::kMiddle, "mark");
    }
  }
  canvas.Line({area.x, area.y}, {area.x, area.y + area.height}, "axis");
  canvas.Line({area.x, area.y + area.height}, {area.x + area.width, area.y + area.height}, "axis");
  DrawHorizontalAxis(canvas, area, time);
  canvas.Text({8, area.y + area.height + 38}, OriginWords(Origin::kSimulated), TextAnchor::kStart, "small");
  DrawLegend(canvas, legend, {area.x + area.width, area.y});
  return std::move(canvas).Finish();
}

}  // namespace slabstream
