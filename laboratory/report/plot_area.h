// PlotArea: the rectangle of a chart where data is drawn, with its frame and axes round it.
#pragma once

#include <string>

#include "laboratory/report/axis.h"
#include "laboratory/report/legend.h"
#include "laboratory/report/svg.h"

namespace slabstream {

struct PlotArea {
  double x = 0, y = 0, width = 0, height = 0;  // pixels; y downwards
  double total_width = 0, total_height = 0;    // of the drawing
};

// The usual size, with the legend on its right. `below`: pixels under it for labels of the horizontal axis.
PlotArea PlaceBeside(const Legend& legend, double below = 50);

// Draws the title and the vertical axis with its grid.
void DrawFrame(SvgCanvas& canvas, const PlotArea& area, const std::string& title, const ChartAxis& y);
void DrawHorizontalAxis(SvgCanvas& canvas, const PlotArea& area, const ChartAxis& x);

}  // namespace slabstream
