#include "client/experiment/report/legend.h"

#include <algorithm>

namespace slabstream {
namespace {

constexpr double kRow = 18, kSwatch = 30, kGap = 8, kMargin = 14, kBetween = 10;
constexpr int kPlain = 6;  // the palette's grey

void DrawSwatch(SvgCanvas& canvas, Legend::Swatch swatch, SvgPoint at, int color, Origin origin) {
  if (swatch == Legend::Swatch::kBar) {
    canvas.Bar(at.x + 8, at.y - 6, kSwatch - 14, 11, color, origin);
    return;
  }
  canvas.Polyline({at, {at.x + kSwatch, at.y}}, color, origin);
  canvas.Marker({at.x + kSwatch / 2, at.y}, color, origin);
}

}  // namespace

double TextWidth(const std::string& text) {
  const auto letters = std::count_if(text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U; });
  return 7.0 * double(letters);  // UTF-8: bytes that begin a letter
}

std::string OriginWords(Origin origin) {
  switch (origin) {
    case Origin::kMeasured: return "measured here";
    case Origin::kSimulated: return "simulated";
    case Origin::kPaper: break;
  }
  return "from the paper";
}

double LegendWidth(const Legend& legend) {
  double widest = 0;
  for (const std::string& name : legend.names) widest = std::max(widest, TextWidth(name));
  for (const Origin origin : legend.origins) widest = std::max(widest, TextWidth(OriginWords(origin)));
  return 2 * kMargin + kSwatch + kGap + widest;
}

double LegendHeight(const Legend& legend) { return kRow * double(legend.names.size() + legend.origins.size()) + kBetween + kRow; }

void DrawLegend(SvgCanvas& canvas, const Legend& legend, SvgPoint top_left) {
  double y = top_left.y + kRow / 2;
  const double x = top_left.x + kMargin;
  const auto row = [&](const std::string& words, int color, Origin origin) {
    DrawSwatch(canvas, legend.swatch, {x, y}, color, origin);
    canvas.Text({x + kSwatch + kGap, y + 4}, words);
    y += kRow;
  };
  // A name stands for all strokes of its colour, so it is drawn as what occurs first.
  for (std::size_t i = 0; i < legend.names.size(); ++i)
    row(legend.names[i], int(i), legend.origins.empty() ? Origin::kMeasured : legend.origins.front());
  if (legend.names.empty()) return;
  y += kBetween;
  for (const Origin origin : legend.origins) row(OriginWords(origin), kPlain, origin);
}

}  // namespace slabstream
