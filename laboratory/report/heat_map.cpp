#include <fmt/format.h>

#include <algorithm>

#include "laboratory/report/charts.h"
#include "laboratory/report/legend.h"
#include "laboratory/report/svg.h"
#include "laboratory/report/text.h"

namespace slabstream {
namespace {

constexpr double kPanel = 210, kLeft = 34, kTop = 62, kGap = 44, kBottom = 46, kScaleWidth = 16, kRight = 100;
constexpr int kScaleSteps = 40;

void DrawPanel(SvgCanvas& canvas, const HeatPanel& panel, SvgPoint corner, double top_value) {
  const double scale = kPanel / std::max(panel.width, panel.height), width = panel.width * scale, height = panel.height * scale;
  const double x = corner.x, y = corner.y + (kPanel - height) / 2;
  canvas.Rect(x, y, width, height, "back");
  for (const HeatRect& rect : panel.rects) {
    canvas.Cell(x + rect.x_begin * scale, y + height - rect.y_end * scale, (rect.x_end - rect.x_begin) * scale,
                (rect.y_end - rect.y_begin) * scale, top_value > 0 ? rect.value / top_value : 0, rect.hint);
  }
  // Outlines last, so that neighbours do not cover them.
  for (const HeatRect& rect : panel.rects) {
    canvas.Rect(x + rect.x_begin * scale, y + height - rect.y_end * scale, (rect.x_end - rect.x_begin) * scale,
                (rect.y_end - rect.y_begin) * scale, "outline");
  }
  canvas.Text({x + width / 2, corner.y - 8}, panel.title, TextAnchor::kMiddle);
  canvas.Text({x + width / 2, y + height + 18}, panel.x_label, TextAnchor::kMiddle, "small");
  canvas.VerticalText({x - 8, y + height / 2}, panel.y_label, TextAnchor::kMiddle, "small");
}

}  // namespace

std::string DrawHeatMap(const HeatMap& map) {
  double top_value = 0;
  for (const HeatPanel& panel : map.panels) {
    for (const HeatRect& rect : panel.rects) top_value = std::max(top_value, rect.value);
  }
  const double scale_x = kLeft + double(map.panels.size()) * (kPanel + kGap);
  SvgCanvas canvas(scale_x + kScaleWidth + kRight, kTop + kPanel + kBottom, map.title);
  canvas.Text({8, 20}, map.title, TextAnchor::kStart, "title");
  for (std::size_t i = 0; i < map.panels.size(); ++i) {
    DrawPanel(canvas, map.panels[i], {kLeft + double(i) * (kPanel + kGap), kTop}, top_value);
  }
  for (int step = 0; step < kScaleSteps; ++step) {
    const double height = kPanel / kScaleSteps;
    // A little higher than a step, so that no gaps show between them.
    canvas.Cell(scale_x, kTop + kPanel - (step + 1) * height - 0.3, kScaleWidth, height + 0.3, (step + 0.5) / kScaleSteps);
  }
  canvas.Text({scale_x + kScaleWidth + 6, kTop + 10}, FormatNumber(top_value));
  canvas.Text({scale_x + kScaleWidth + 6, kTop + kPanel}, "0");
  canvas.VerticalText({scale_x + kScaleWidth + 22, kTop + kPanel / 2}, map.value_label);
  canvas.Text({8, kTop + kPanel + kBottom - 6}, OriginWords(Origin::kMeasured), TextAnchor::kStart, "small");
  return std::move(canvas).Finish();
}

}  // namespace slabstream
