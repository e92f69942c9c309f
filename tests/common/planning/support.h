// Summaries, rosters and requests made by hand.
#pragma once

#include <cmath>
#include <cstdint>
#include <memory>

#include "common/planning/frame_plan.h"
#include "tests/support/random.h"

namespace slabstream {

// A volume of uint8 whose every brick holds all values.
inline VolumeSummary FullSummary(const Index3& size) {
  VolumeSummary summary;
  summary.description.geometry.size = size;
  summary.range = {0, 255};
  summary.histogram.fill(std::uint64_t(summary.description.geometry.bounds().voxel_count()) / kHistogramBins);
  const auto bricks = [](std::int32_t side) { return (side + kBrick - 1) / kBrick; };
  summary.brick_counts = {bricks(size.x), bricks(size.y), bricks(size.z)};
  summary.bricks.assign(std::size_t(summary.brick_counts.x) * std::size_t(summary.brick_counts.y) * std::size_t(summary.brick_counts.z),
                        {0, 255});
  return summary;
}

// That of a grid, so every renderer has something to draw.
inline VolumeSummary FullGridSummary(const Index3& size) {
  VolumeSummary summary = FullSummary(size);
  summary.cells.assign(summary.bricks.size(), 100);
  return summary;
}

// Workers 1 ... count, one a slot.
inline Roster FullRoster(int count) {
  Roster roster;
  for (int i = 0; i < count; ++i) roster.slots.push_back(WorkerId(i + 1));
  return roster;
}

// Everything below 100 is transparent.
inline FrameRequest SomeRequest() {
  FrameRequest request;
  request.dataset = "head";
  request.size = {128, 128};
  TransferFunction transfer;
  transfer.colors = {{0, {1, 1, 1}}};
  transfer.opacities = {{100, 0}, {200, 1}};
  request.transfer.choice = transfer;
  request.policy.decomposition = "slab";
  request.policy.combine = "fan-in";
  return request;
}

inline ResolvedRequest Resolved(const FrameRequest& request, const VolumeSummary& summary) {
  return ResolveRequest(request, 1, std::make_shared<const VolumeSummary>(summary)).value();
}
inline FrameSetup SetupOf(const FrameRequest& request, const VolumeSummary& summary) {
  return MakeFrameSetup(Resolved(request, summary)).value();
}

inline ViewParameters RandomView(Random& random) {
  ViewParameters view;
  view.projection = random.Chance(0.5) ? Projection::kOrthographic : Projection::kPerspective;
  view.azimuth_degrees = random.Real(0, 360);
  view.elevation_degrees = random.Real(-90, 90);
  view.zoom = std::exp(random.Real(-2, 2));
  return view;
}

}  // namespace slabstream
