// The kinds of plots in reports, as values. Each is drawn by one function (and file) as an SVG text. Every drawn element carries its
// Origin. A legend beside the plot, never over data, says in words which stroke is measured, simulated or from the paper. Series differ by
// colour and by marker.
#pragma once

#include <string>
#include <vector>

#include "laboratory/report/axis.h"
#include "laboratory/results/origin.h"

namespace slabstream {

// Lines. Series of one name share a colour (and an entry of the legend), whatever their origins.
struct LinePoint {
  double x = 0, y = 0;
  double low = 0, high = 0;  // of the spread of y; equal: none
};
struct LineSeries {
  std::string name;
  Origin origin = Origin::kMeasured;
  std::vector<LinePoint> points;  // by ascending x; points that an axis cannot show are left out
  bool reference = false;         // not data but a reference for it: a thin line without markers or origin
};
struct LineChart {
  std::string title;
  AxisSpec x, y;
  std::vector<LineSeries> series;
};
std::string DrawLines(const LineChart& chart);

// Bars: groups of bars side by side. A bar is a stack of parts, or a plain bar that the legend names.
struct Bar {
  std::string label;  // of stacks: under it; of plain bars: its name in the legend; empty: none
  Origin origin = Origin::kMeasured;
  std::vector<double> parts;  // by BarChart::parts, from below; of a plain bar: one; none negative
};
struct BarGroup {
  std::string label;
  std::vector<Bar> bars;
};
struct BarChart {
  std::string title;
  std::string group_axis;          // what groups are: "workers p"
  AxisSpec y;                      // linear
  std::vector<std::string> parts;  // empty: bars are plain
  std::vector<BarGroup> groups;
};
std::string DrawBars(const BarChart& chart);

// A simulated timeline: lanes from above, spans in milliseconds.
struct GanttSpan {
  double begin = 0, end = 0;
  int kind = 0;       // of GanttChart::kinds: its colour
  std::string label;  // a letter or two, written if there is room
  std::string hint;
};
struct GanttLane {
  std::string name;
  std::vector<GanttSpan> spans;
};
struct GanttChart {
  std::string title;
  std::vector<std::string> kinds;
  std::vector<GanttLane> lanes;
};
std::string DrawGantt(const GanttChart& chart);

// Heat maps of what was measured: rectangles of a plane coloured by value, several planes side by side with one scale.
struct HeatRect {
  double x_begin = 0, y_begin = 0, x_end = 0, y_end = 0;
  double value = 0;
  std::string hint;
};
struct HeatPanel {
  std::string title;
  std::string x_label, y_label;
  double width = 1, height = 1;  // extent of the plane; y grows upwards
  std::vector<HeatRect> rects;   // later ones lie over earlier ones
};
struct HeatMap {
  std::string title;
  std::string value_label;  // with its unit
  std::vector<HeatPanel> panels;
};
std::string DrawHeatMap(const HeatMap& map);

}  // namespace slabstream
