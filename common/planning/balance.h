// Dynamic balance (balances.h): whether a layout should change between two frames, given the cost of each part of the volume. Pure.
//
// Rebalance weighs three changes: hand boxes over from busy slots to others; resize the boxes to equal measured cost; or cut the volume
// anew if that is predicted to be much better, since measured costs say little about quite different boxes. A change moves voxels: a slot
// receives the voxels of its boxes, with halo, that it did not hold before, and derives its data of new boxes from them. A change is made
// if it saves the coming frames more time than that takes.
//
// Nobody knows how many frames will come before the next change: as many again as came since the last one, twice. So what changes cost
// stays in proportion to what is lost without them, as in the ski-rental problem (Karlin, Manasse, Rudolph and Sleator, "Competitive snoopy
// caching", 1988), and a view that turns is not followed at any price.
//
// A slot may be the busiest by chance alone. If p slots have equal work and their mean times scatter with standard deviation s, the largest
// of these means lies about s sqrt(2 ln p) above the work. A change must save more than that.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/planning/balances.h"
#include "common/planning/layout.h"

namespace slabstream {

// Predicted seconds of each box, from the cost of cells in `cost`; 0 if nobody renders the box.
std::vector<double> PredictedSeconds(const Layout& layout, const WorkField& cost);

// Render time of a frame: that of the busiest slot. `seconds` by box.
double FrameSeconds(const Layout& layout, std::uint32_t slots, std::span<const double> seconds);

// How much longer that is than if all slots had the same work.
double LostSeconds(const Layout& layout, std::uint32_t slots, std::span<const double> seconds);

// Voxels that slots must receive to change over: of each box in `to`, with halo, those that no box of its slot in `from` holds. BoxFetcher
// (worker/machine/box_fetcher.h) then requests exactly these.
std::int64_t MovedVoxels(const Layout& from, const Layout& to);

// Keeps the boxes. Moves one after the other from the busiest slot to the least busy one, as long as that helps. `seconds` by box.
Layout Reassign(const Layout& layout, std::uint32_t slots, std::span<const double> seconds);

// Boxes of equal cost, whatever the policy balances by. `resized`: whose planes move to that end; null: cut anew.
Layout CutByCost(const LayoutRequest& request, const Partition* resized);

// What a change costs: seconds.
double ChangeSeconds(const BalanceRequest& request, const Layout& to);

// The layout to change to, if any; none until the noise is known. Comparisons use one kind of time on both sides: measured times of boxes
// to hand over, costs of cells to cut anew, because cells resolve boxes no more finely than they are large.
std::optional<Layout> Rebalance(const BalanceRequest& request);

}  // namespace slabstream
