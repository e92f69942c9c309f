// Dynamic balance: whether a layout should change between two frames, given what rendering costs where. Pure.
//
// Three changes are weighed. Boxes stay, and some are handed over from slots that have much to do to slots that have little; or they are
// resized at equal learnt cost; or they are cut anew, where that is predicted to be better by far: of boxes that are quite different what
// was learnt tells little. A change moves voxels: of every box, with its halo, what its slot did not hold before travels to it. It is
// made if the frames to come win more time than that takes, and a share of the frame's time that noise alone would hardly pretend.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/planning/layout.h"

namespace slabstream {

struct BalanceTerms {
  double bytes_per_second = 5e8;  // at which voxels reach their new owners and are made ready to be rendered
  double frames = 1000;           // over which a change must pay
  double least_gain = 0.02;  // share of the frame's render time that a change must win; twice that after one frame, and so on (1 + 1/n)
  double least_gain_of_new_boxes = 0.1;  // share of the frame's render time that boxes cut anew must win beside resized ones
};

// What each box of a layout should take, by box, if cells cost what `cost` says; 0 of those that nobody renders.
std::vector<double> PredictedSeconds(const Layout& layout, const WorkField& cost);

// Render time of a frame: of the slot that has most to do. `seconds` by box.
double FrameSeconds(const Layout& layout, std::uint32_t slots, std::span<const double> seconds);

// Voxels that slots must get to change over: those of their boxes in `to`, with halo, that none of their boxes in `from` holds. What
// SlabFetcher (worker/slab_fetcher.h) asks for then.
std::int64_t MovedVoxels(const Layout& from, const Layout& to);

// The same boxes: from the slot with most to do one after the other goes to the slot with least, as long as that helps. `seconds` by box.
Layout HandOver(const Layout& layout, std::uint32_t slots, std::span<const double> seconds);

// The layout to change to, if any. `request` is what `now` was made for, with known.cost; `seconds`, what the boxes of `now` took in
// `frames_seen` >= 1 frames. Like is compared with like: to hand over, by what boxes took; to cut anew, by what cells cost on either side,
// for cells tell boxes apart no more finely than they are large.
std::optional<Layout> Rebalance(const Layout& now, std::span<const double> seconds, const LayoutRequest& request, int frames_seen,
                                const BalanceTerms& terms = {});

}  // namespace slabstream
