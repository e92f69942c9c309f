#include "worker/fragment_set.h"

#include <algorithm>

#include "common/base/check.h"

namespace slabstream {
namespace {

PixelRange Common(const PixelRange& a, const PixelRange& b) { return {std::max(a.begin, b.begin), std::min(a.end, b.end)}; }

bool Continues(const Fragment& first, const Fragment& second) {
  return first.pixels.end == second.pixels.begin && first.ranks == second.ranks && first.image == second.image;
}

}  // namespace

std::vector<Fragment> FragmentSet::Within(const PixelRange& range) const {
  std::vector<Fragment> parts;
  for (const Fragment& fragment : fragments_) {
    if (Overlap(fragment.pixels, range)) parts.push_back({Common(fragment.pixels, range), fragment.ranks, fragment.image});
  }
  return parts;
}

std::vector<Fragment> FragmentSet::Take(const PixelRange& range) {
  std::vector<Fragment> taken = Within(range);
  std::vector<Fragment> rest;
  for (const Fragment& fragment : fragments_) {
    if (!Overlap(fragment.pixels, range)) {
      rest.push_back(fragment);
      continue;
    }
    if (fragment.pixels.begin < range.begin) rest.push_back({{fragment.pixels.begin, range.begin}, fragment.ranks, fragment.image});
    if (fragment.pixels.end > range.end) rest.push_back({{range.end, fragment.pixels.end}, fragment.ranks, fragment.image});
  }
  fragments_ = std::move(rest);
  return taken;
}

void FragmentSet::Insert(const Fragment& fragment) {
  DCHECK(Within(fragment.pixels).empty());
  auto place =
      std::find_if(fragments_.begin(), fragments_.end(), [&](const Fragment& other) { return other.pixels.begin > fragment.pixels.begin; });
  place = fragments_.insert(place, fragment);
  const auto next = place + 1;
  if (next != fragments_.end() && Continues(*place, *next)) {
    place->pixels.end = next->pixels.end;
    fragments_.erase(next);
  }
  if (place != fragments_.begin() && Continues(*(place - 1), *place)) {
    (place - 1)->pixels.end = place->pixels.end;
    fragments_.erase(place);
  }
}

bool FragmentSet::Uses(ImageHandle image) const {
  return std::any_of(fragments_.begin(), fragments_.end(), [&](const Fragment& fragment) { return fragment.image == image; });
}

}  // namespace slabstream
