// Fragments<Value>: what one rank holds while a schedule runs. A fragment is a range of pixels with one value, for example the image that
// the pixels are stored in and the ranks that they have been combined from. Fragments of a rank never overlap.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <ranges>
#include <utility>
#include <vector>

#include "common/base/check.h"
#include "common/image/pixel_bounds.h"

namespace slabstream {

constexpr std::uint64_t PixelCount(const PixelRange& range) { return range.end > range.begin ? range.end - range.begin : 0; }
constexpr bool Overlap(const PixelRange& a, const PixelRange& b) { return a.begin < b.end && b.begin < a.end; }

template <class Value>
struct Fragment {
  PixelRange pixels;  // not empty
  Value value;
  friend bool operator==(const Fragment&, const Fragment&) = default;
};

template <std::ranges::range Fragments>
std::uint64_t PixelCount(const Fragments& fragments) {
  std::uint64_t pixels = 0;
  for (const auto& fragment : fragments) pixels += PixelCount(fragment.pixels);
  return pixels;
}

template <class Value>
class Fragments {
 public:
  using List = std::vector<Fragment<Value>>;  // in order of pixels

  // The parts of fragments that lie in `range`.
  List Within(const PixelRange& range) const {
    List parts;
    for (auto it = FirstAfter(range.begin); it != list_.end() && it->pixels.begin < range.end; ++it) {
      parts.push_back({{std::max(it->pixels.begin, range.begin), std::min(it->pixels.end, range.end)}, it->value});
    }
    return parts;
  }

  // The fragment of exactly these pixels; null: there is none.
  const Fragment<Value>* Find(const PixelRange& range) const {
    const auto place = FirstAfter(range.begin);
    return place != list_.end() && place->pixels == range ? &*place : nullptr;
  }

  // Removes what lies in `range` and adds it to `taken`. Fragments at the ends of the range are cut.
  void Take(const PixelRange& range, List& taken) {
    auto first = list_.begin() + (FirstAfter(range.begin) - list_.cbegin());
    auto last = first;
    for (; last != list_.end() && last->pixels.begin < range.end; ++last) {
      taken.push_back({{std::max(last->pixels.begin, range.begin), std::min(last->pixels.end, range.end)}, last->value});
    }
    if (first == last) return;
    const bool keeps_begin = first->pixels.begin < range.begin;
    const bool keeps_end = range.end < last[-1].pixels.end;
    if (keeps_begin && keeps_end && last - first == 1) {
      const Fragment<Value> rest = {{range.end, first->pixels.end}, first->value};
      first->pixels.end = range.begin;
      list_.insert(last, rest);
      return;
    }
    if (keeps_begin) (first++)->pixels.end = range.begin;
    if (keeps_end) (--last)->pixels.begin = range.end;
    list_.erase(first, last);
  }
  List Take(const PixelRange& range) {
    List taken;
    Take(range, taken);
    return taken;
  }

  // `fragment` must not overlap another one. Neighbours with equal values become one.
  void Put(const Fragment<Value>& fragment) {
    auto place = list_.begin() + (FirstAfter(fragment.pixels.begin) - list_.cbegin());
    CHECK(place == list_.end() || fragment.pixels.end <= place->pixels.begin);
    const bool joins_next = place != list_.end() && place->pixels.begin == fragment.pixels.end && place->value == fragment.value;
    const bool joins_last =
        place != list_.begin() && (place - 1)->pixels.end == fragment.pixels.begin && (place - 1)->value == fragment.value;
    if (joins_last) {
      (place - 1)->pixels.end = joins_next ? place->pixels.end : fragment.pixels.end;
      if (joins_next) list_.erase(place);
    } else if (joins_next) {
      place->pixels.begin = fragment.pixels.begin;
    } else {
      list_.insert(place, fragment);
    }
  }

  // Puts `fragment` in place of what lies in its pixels.
  void Replace(const Fragment<Value>& fragment) {
    if (Exchange(fragment)) return;
    Take(fragment.pixels);
    Put(fragment);
  }

  // The same if there is a fragment of exactly these pixels, and nothing moves: returns its value. None: nothing has changed.
  std::optional<Value> Exchange(const Fragment<Value>& fragment) {
    const auto place = list_.begin() + (FirstAfter(fragment.pixels.begin) - list_.cbegin());
    const auto joins = [&](const Fragment<Value>& neighbour) { return neighbour.value == fragment.value; };
    if (place == list_.end() || place->pixels != fragment.pixels) return std::nullopt;
    if ((place != list_.begin() && joins(place[-1])) || (place + 1 != list_.end() && joins(place[1]))) return std::nullopt;
    return std::exchange(place->value, fragment.value);
  }

  // Adds a fragment. Where nothing is held, it is stored as it is; elsewhere merge(held, value) returns the combined value. False if merge
  // returns nothing; the pixels from there on are then lost.
  template <class Merge>
  bool Combine(const Fragment<Value>& fragment, Merge&& merge) {
    std::uint64_t next = fragment.pixels.begin;  // pixels before it are done
    for (const Fragment<Value>& held : Take(fragment.pixels)) {
      if (held.pixels.begin > next) Put({{next, held.pixels.begin}, fragment.value});
      const std::optional<Value> both = merge(held.value, fragment.value);
      if (!both) return false;
      Put({held.pixels, *both});
      next = held.pixels.end;
    }
    if (next < fragment.pixels.end) Put({{next, fragment.pixels.end}, fragment.value});
    return true;
  }

  bool empty() const { return list_.empty(); }
  const List& list() const { return list_; }

 private:
  // The first fragment that ends after `pixel`.
  typename List::const_iterator FirstAfter(std::uint64_t pixel) const {
    return std::upper_bound(list_.begin(), list_.end(), pixel,
                            [](std::uint64_t value, const Fragment<Value>& fragment) { return value < fragment.pixels.end; });
  }

  List list_;
};

}  // namespace slabstream
