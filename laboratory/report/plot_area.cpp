#include "laboratory/report/plot_area.h"

#include <algorithm>

#include "laboratory/report/text.h"

namespace slabstream {
namespace {

constexpr double kWidth = 540, kHeight = 310, kLeft = 74, kTop = 40;
constexpr double kMark = 5;  // length

}  // namespace

PlotArea PlaceBeside(const Legend& legend, double below) {
  return {kLeft, kTop, kWidth, kHeight, kLeft + kWidth + LegendWidth(legend), kTop + std::max(kHeight + below, LegendHeight(legend))};
}

void DrawFrame(SvgCanvas& canvas, const PlotArea& area, const std::string& title, const ChartAxis& y) {
  canvas.Text({8, 20}, title, TextAnchor::kStart, "title");
  for (const double mark : y.marks()) {
    const double at = area.y + (1 - y.At(mark)) * area.height;
    canvas.Line({area.x, at}, {area.x + area.width, at}, "grid");
    canvas.Text({area.x - 8, at + 4}, FormatNumber(mark), TextAnchor::kEnd);
  }
  canvas.Line({area.x, area.y}, {area.x, area.y + area.height}, "axis");
  canvas.Line({area.x, area.y + area.height}, {area.x + area.width, area.y + area.height}, "axis");
  canvas.VerticalText({16, area.y + area.height / 2}, y.Title());
}

void DrawHorizontalAxis(SvgCanvas& canvas, const PlotArea& area, const ChartAxis& x) {
  const double bottom = area.y + area.height;
  for (const double mark : x.marks()) {
    const double at = area.x + x.At(mark) * area.width;
    canvas.Line({at, bottom}, {at, bottom + kMark}, "axis");
    canvas.Text({at, bottom + 18}, FormatNumber(mark), TextAnchor::kMiddle);
  }
  canvas.Text({area.x + area.width / 2, bottom + 38}, x.Title(), TextAnchor::kMiddle);
}

}  // namespace slabstream
