#include "laboratory/report/legend.h"

#include <algorithm>
#include <array>

#include "common/base/check.h"

namespace slabstream {
namespace {

constexpr double kRow = 18, kSwatch = 30, kGap = 8, kMargin = 14, kBetween = 10;

void DrawSwatch(SvgCanvas& canvas, Legend::Swatch swatch, SvgPoint at, int color, std::optional<Origin> origin) {
  if (swatch == Legend::Swatch::kBar) {
    canvas.Bar(at.x + 8, at.y - 6, kSwatch - 14, 11, color, origin.value_or(Origin::kMeasured));
    return;
  }
  canvas.Polyline({at, {at.x + kSwatch, at.y}}, color, origin);
  if (origin) canvas.Marker({at.x + kSwatch / 2, at.y}, color, *origin);
}

}  // namespace

double TextWidth(const std::string& text) {
  const auto letters = std::count_if(text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U; });
  return 7.0 * double(letters);  // UTF-8: bytes that begin a letter
}

std::string OriginWords(Origin origin) {
  constexpr std::array<const char*, 3> kWords = {"measured here", "simulated", "from the paper"};
  return kWords[std::size_t(origin)];
}

int Legend::ColorOf(const std::string& name) const {
  const auto found = std::ranges::find(entries, name, &Entry::name);
  CHECK(found != entries.end()) << name;
  return int(found - entries.begin());
}

double LegendWidth(const Legend& legend) {
  double widest = 0;
  for (const Legend::Entry& entry : legend.entries) widest = std::max(widest, TextWidth(entry.name));
  for (const Origin origin : legend.origins) widest = std::max(widest, TextWidth(OriginWords(origin)));
  return 2 * kMargin + kSwatch + kGap + widest;
}

double LegendHeight(const Legend& legend) { return kRow * double(legend.entries.size() + legend.origins.size()) + kBetween + kRow; }

void DrawLegend(SvgCanvas& canvas, const Legend& legend, SvgPoint top_left) {
  double y = top_left.y + kRow / 2;
  const double x = top_left.x + kMargin;
  const auto row = [&](const std::string& words, int color, std::optional<Origin> origin) {
    DrawSwatch(canvas, legend.swatch, {x, y}, color, origin);
    canvas.Text({x + kSwatch + kGap, y + 4}, words);
    y += kRow;
  };
  for (std::size_t i = 0; i < legend.entries.size(); ++i) row(legend.entries[i].name, int(i), legend.entries[i].origin);
  if (legend.entries.empty()) return;
  y += kBetween;
  for (const Origin origin : legend.origins) row(OriginWords(origin), kPlainColor, origin);
}

}  // namespace slabstream
