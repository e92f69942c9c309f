// Fragments<Value>: what one rank holds while a schedule runs on values instead of images: disjoint ranges of pixels, each with a value.
#pragma once

#include <cstdint>
#include <iterator>
#include <map>
#include <optional>

#include "common/image/pixel_bounds.h"

namespace slabstream {

template <class Value>
class Fragments {
 public:
  struct Fragment {
    std::uint64_t end = 0;
    Value value;
  };
  using Map = std::map<std::uint64_t, Fragment>;  // by first pixel

  void Put(PixelRange pixels, const Value& value) { fragments_[pixels.begin] = {pixels.end, value}; }

  // Takes out the fragments that lie in `pixels`, cutting those at its ends.
  Map Take(PixelRange pixels) {
    CutAt(pixels.begin);
    CutAt(pixels.end);
    Map taken;
    const auto end = fragments_.lower_bound(pixels.end);
    for (auto it = fragments_.lower_bound(pixels.begin); it != end;) taken.insert(taken.end(), fragments_.extract(it++));
    return taken;
  }

  // Adds a fragment to what is held; where nothing is held it is taken as it is, elsewhere merge(held, value) says what becomes of both.
  // False if that is nothing.
  template <class Merge>
  bool Combine(PixelRange pixels, const Value& value, Merge&& merge) {
    std::uint64_t next = pixels.begin;  // pixels before it are done
    for (const auto& [begin, held] : Take(pixels)) {
      if (begin > next) Put({next, begin}, value);
      const std::optional<Value> both = merge(held.value, value);
      if (!both) return false;
      Put({begin, held.end}, *both);
      next = held.end;
    }
    if (next < pixels.end) Put({next, pixels.end}, value);
    return true;
  }

  const Map& fragments() const { return fragments_; }

 private:
  void CutAt(std::uint64_t pixel) {
    auto it = fragments_.lower_bound(pixel);
    if (it == fragments_.begin()) return;
    Fragment& before = std::prev(it)->second;
    if (before.end <= pixel) return;
    fragments_.emplace_hint(it, pixel, before);
    before.end = pixel;
  }

  Map fragments_;
};

}  // namespace slabstream
