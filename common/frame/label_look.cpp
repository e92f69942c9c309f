#include "common/frame/label_look.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace slabstream {

LabelStyle StyleOf(const LabelLook& look, std::uint64_t value) {
  LabelStyle style{.color = {}, .opacity = 1, .shown = false};
  if (value == 0) return style;
  const auto span = std::ranges::lower_bound(look.shown, value, {}, &LabelLook::Span::last);
  style.shown = look.shown.empty() || (span != look.shown.end() && span->first <= value);
  const auto entry = std::ranges::lower_bound(look.entries, value, {}, &LabelLook::Entry::value);
  if (entry != look.entries.end() && entry->value == value) {
    style.color = entry->color;
    style.opacity = entry->opacity;
  } else {
    const LabelColor color = StandardColor(value);
    style.color = {color[0], color[1], color[2]};
  }
  if (!style.shown && look.hides) {
    style.shown = true;
    style.opacity = 0;
  }
  return style;
}

bool MayBeMatter(const LabelLook& look, const ValueRange& values) {
  if (look.mode != LabelMode::kSurface || !(values.min <= values.max) || values.max < 1) return false;
  if (look.shown.empty()) return true;
  constexpr float kFarthest = std::numeric_limits<float>::max();
  // Whatever was rounded to these.
  const double low = std::nextafter(values.min, 0.0F), high = std::nextafter(values.max, kFarthest);
  const auto span = std::ranges::lower_bound(look.shown, low, {}, [](const LabelLook::Span& of) { return double(of.last); });
  return span != look.shown.end() && double(span->first) <= high;
}

LabelUse UseOf(LabelMode mode, const LabelStyle& style) {
  if (!style.shown) return LabelUse::kAsVolume;
  if (style.opacity < 0.5F) return LabelUse::kClear;
  return mode == LabelMode::kSurface ? LabelUse::kOpaque : LabelUse::kAsVolume;
}

}  // namespace slabstream
