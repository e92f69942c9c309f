// Legend: the text beside a plot. Names with their colours, and below them the meanings of the strokes that occur.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "laboratory/report/svg.h"
#include "laboratory/results/origin.h"

namespace slabstream {

struct Legend {
  enum class Swatch { kLine, kBar };
  // A name stands for all strokes of its colour and is drawn like the first of them.
  struct Entry {
    std::string name;
    std::optional<Origin> origin;  // none: a reference for the data
  };
  Swatch swatch = Swatch::kLine;
  std::vector<Entry> entries;   // by colour
  std::vector<Origin> origins;  // that occur

  int ColorOf(const std::string& name) const;  // of an entry
};

double LegendWidth(const Legend& legend);  // pixels, margins included
double LegendHeight(const Legend& legend);
void DrawLegend(SvgCanvas& canvas, const Legend& legend, SvgPoint top_left);

// "measured here", "simulated", "from the paper".
std::string OriginWords(Origin origin);

// Approximate width of a text in the charts' font.
double TextWidth(const std::string& text);

}  // namespace slabstream
