#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "laboratory/report/charts.h"
#include "laboratory/report/plot_area.h"
#include "laboratory/report/text.h"

namespace slabstream {
namespace {

bool IsPlain(const BarChart& chart) { return chart.parts.empty(); }

Legend LegendOf(const BarChart& chart) {
  Legend legend{Legend::Swatch::kBar, {}, {}};
  for (const std::string& part : chart.parts) legend.entries.push_back({part, Origin::kMeasured});
  if (IsPlain(chart)) {
    for (const BarGroup& group : chart.groups) {
      for (const Bar& bar : group.bars) {
        if (std::ranges::find(legend.entries, bar.label, &Legend::Entry::name) == legend.entries.end())
          legend.entries.push_back({bar.label, bar.origin});
      }
    }
  }
  for (const Origin origin : kOrigins) {
    const auto has = [&](const BarGroup& group) {
      return std::ranges::any_of(group.bars, [&](const Bar& bar) { return bar.origin == origin; });
    };
    if (std::ranges::any_of(chart.groups, has)) legend.origins.push_back(origin);
  }
  return legend;
}

double Sum(const Bar& bar) { return std::accumulate(bar.parts.begin(), bar.parts.end(), 0.0); }

}  // namespace

std::string DrawBars(const BarChart& chart) {
  std::vector<double> heights;
  std::size_t most_bars = 1;
  double longest_label = 0, longest_group = 0;
  for (const BarGroup& group : chart.groups) {
    most_bars = std::max(most_bars, group.bars.size());
    longest_group = std::max(longest_group, TextWidth(group.label));
    for (const Bar& bar : group.bars) {
      heights.push_back(Sum(bar));
      if (!IsPlain(chart)) longest_label = std::max(longest_label, TextWidth(bar.label));
    }
  }
  AxisSpec spec = chart.y;
  spec.from_zero = true;
  const ChartAxis y(spec, heights);
  const Legend legend = LegendOf(chart);
  const double below_bars = longest_label > 0 ? longest_label + 10 : 4;  // labels of bars are written vertically under them
  const double group_width = PlaceBeside(legend).width / double(std::max<std::size_t>(1, chart.groups.size()));
  const bool upright = longest_group > group_width;  // labels of groups, too
  const double below_groups = below_bars + (upright ? longest_group + 8 : 14);
  const PlotArea area = PlaceBeside(legend, below_groups + 34);
  SvgCanvas canvas(area.total_width, area.total_height, chart.title);
  DrawFrame(canvas, area, chart.title, y);

  const double bottom = area.y + area.height;
  const double slot = std::min(40.0, 0.84 * group_width / double(most_bars)), bar_width = 0.82 * slot;
  for (std::size_t g = 0; g < chart.groups.size(); ++g) {
    const BarGroup& group = chart.groups[g];
    const double middle = area.x + (double(g) + 0.5) * group_width;
    for (std::size_t b = 0; b < group.bars.size(); ++b) {
      const Bar& bar = group.bars[b];
      const double left = middle + (double(b) - double(group.bars.size()) / 2) * slot + (slot - bar_width) / 2;
      double below = 0;
      for (std::size_t part = 0; part < bar.parts.size(); ++part) {
        const double height = (y.At(below + bar.parts[part]) - y.At(below)) * area.height;
        const std::string hint = fmt::format("{} {}{}: {} {} ({})", group.label, bar.label, IsPlain(chart) ? "" : ", " + chart.parts[part],
                                             FormatNumber(bar.parts[part]), chart.y.unit, ToString(bar.origin));
        const int color = IsPlain(chart) ? legend.ColorOf(bar.label) : int(part);
        if (height > 0) canvas.Bar(left, bottom - y.At(below) * area.height - height, bar_width, height, color, bar.origin, hint);
        below += bar.parts[part];
      }
      if (!IsPlain(chart) && !bar.label.empty())
        canvas.VerticalText({left + bar_width / 2 + 4, bottom + 6}, bar.label, TextAnchor::kEnd, "small");
    }
    if (upright) {
      canvas.VerticalText({middle + 4, bottom + below_bars}, group.label, TextAnchor::kEnd);
    } else {
      canvas.Text({middle, bottom + below_groups}, group.label, TextAnchor::kMiddle);
    }
  }
  canvas.Text({area.x + area.width / 2, bottom + below_groups + 20}, chart.group_axis, TextAnchor::kMiddle);
  DrawLegend(canvas, legend, {area.x + area.width, area.y});
  return std::move(canvas).Finish();
}

}  // namespace slabstream
