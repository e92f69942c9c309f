// Legend: what stands beside a plot. Names with their colours, and below them what the strokes that occur mean.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "laboratory/report/origin.h"
#include "laboratory/report/svg.h"

namespace slabstream {

struct Legend {
  enum class Swatch { kLine, kBar };
  // A name stands for all strokes of its colour, so it is drawn as the first of them.
  struct Entry {
    std::string name;
    std::optional<Origin> origin;  // none: something that data is compared with
  };
  Swatch swatch = Swatch::kLine;
  std::vector<Entry> entries;   // by colour
  std::vector<Origin> origins;  // that occur

  int ColorOf(const std::string& name) const;  // of an entry
};

double LegendWidth(const Legend& legend);  // pixels, margins included
double LegendHeight(const Legend& legend);
void DrawLegend(SvgCanvas& canvas, const Legend& legend, SvgPoint top_left);

// "measured here", "simulated from measured costs", "from the paper".
std::string OriginWords(Origin origin);

// About the width of a text of the charts' font.
double TextWidth(const std::string& text);

}  // namespace slabstream
