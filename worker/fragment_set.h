// FragmentSet: what one rank holds while a schedule runs. A fragment is a range of pixels, the interval of ranks whose images these pixels
// have been combined from, and the image that they are stored in. Several fragments may share one image; their pixels are then disjoint,
// also between ranks.
#pragma once

#include <cstdint>
#include <vector>

#include "common/combining/schedule.h"
#include "worker/worker_machine.h"

namespace slabstream {

struct Fragment {
  PixelRange pixels;  // not empty
  RankInterval ranks;
  ImageHandle image = 0;
  friend bool operator==(const Fragment&, const Fragment&) = default;
};

constexpr std::uint64_t PixelCount(const PixelRange& range) { return range.end > range.begin ? range.end - range.begin : 0; }
constexpr bool Overlap(const PixelRange& a, const PixelRange& b) { return a.begin < b.end && b.begin < a.end; }

class FragmentSet {
 public:
  // The parts of fragments that lie in `range`, in order of pixels.
  std::vector<Fragment> Within(const PixelRange& range) const;

  // Removes what lies in `range` and returns it, in order of pixels.
  std::vector<Fragment> Take(const PixelRange& range);

  // `fragment` must not overlap another one. Neighbours of the same image and interval become one.
  void Insert(const Fragment& fragment);

  bool Uses(ImageHandle image) const;
  bool empty() const { return fragments_.empty(); }
  const std::vector<Fragment>& fragments() const { return fragments_; }  // in order of pixels

 private:
  std::vector<Fragment> fragments_;
};

}  // namespace slabstream
