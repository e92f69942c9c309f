#include <fmt/format.h>

#include <algorithm>

#include "laboratory/report/charts.h"
#include "laboratory/report/legend.h"
#include "laboratory/report/plot_area.h"
#include "laboratory/report/text.h"

namespace slabstream {
namespace {

Legend LegendOf(const LineChart& chart) {
  Legend legend;
  for (const LineSeries& series : chart.series) {
    if (std::ranges::find(legend.entries, series.name, &Legend::Entry::name) == legend.entries.end())
      legend.entries.push_back({series.name, series.reference ? std::nullopt : std::optional(series.origin)});
  }
  for (const Origin origin : kOrigins) {
    if (std::ranges::any_of(chart.series, [&](const LineSeries& series) { return !series.reference && series.origin == origin; }))
      legend.origins.push_back(origin);
  }
  return legend;
}

bool HasSpread(const LinePoint& point) { return point.low < point.high; }

}  // namespace

std::string DrawLines(const LineChart& chart) {
  std::vector<double> xs, ys;
  for (const LineSeries& series : chart.series) {
    for (const LinePoint& point : series.points) {
      xs.push_back(point.x);
      ys.push_back(point.y);
      if (HasSpread(point)) ys.insert(ys.end(), {point.low, point.high});
    }
  }
  const ChartAxis x(chart.x, xs), y(chart.y, ys);
  const Legend legend = LegendOf(chart);
  const PlotArea area = PlaceBeside(legend);
  SvgCanvas canvas(area.total_width, area.total_height, chart.title);
  DrawFrame(canvas, area, chart.title, y);
  DrawHorizontalAxis(canvas, area, x);

  const auto place = [&](double at_x, double at_y) {
    return SvgPoint{area.x + x.At(at_x) * area.width, area.y + (1 - y.At(at_y)) * area.height};
  };
  for (const LineSeries& series : chart.series) {
    const int color = legend.ColorOf(series.name);
    std::vector<LinePoint> shown;
    std::ranges::copy_if(series.points, std::back_inserter(shown), [&](const LinePoint& p) { return x.Shows(p.x) && y.Shows(p.y); });
    std::vector<SvgPoint> curve;
    curve.reserve(shown.size());
    for (const LinePoint& point : shown) curve.push_back(place(point.x, point.y));
    canvas.Polyline(curve, color, series.reference ? std::nullopt : std::optional(series.origin));
    if (series.reference) continue;
    for (std::size_t i = 0; i < shown.size(); ++i) {
      const LinePoint& point = shown[i];
      std::string hint = fmt::format("{}, {} = {}: {} {} ({})", series.name, chart.x.label, FormatNumber(point.x), FormatNumber(point.y),
                                     chart.y.unit, ToString(series.origin));
      if (HasSpread(point)) {
        canvas.Spread(curve[i].x, place(point.x, point.low).y, place(point.x, point.high).y, color);
        hint += fmt::format(", {} to {}", FormatNumber(point.low), FormatNumber(point.high));
      }
      canvas.Marker(curve[i], color, series.origin, hint);
    }
  }
  DrawLegend(canvas, legend, {area.x + area.width, area.y});
  return std::move(canvas).Finish();
}

}  // namespace slabstream
