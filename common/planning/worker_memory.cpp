#include "common/planning/worker_memory.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <map>
#include <string>

#include "common/image/pixel_bounds.h"
#include "common/planning/frame_window.h"
#include "common/renderers/renderer_kind.h"
#include "common/volume/bricks.h"
#include "common/volume/indices.h"
#include "common/volume/memory_budget.h"

namespace slabstream {
namespace {

// A tetrahedron and its share of points: 20 as it arrives, 20 as it is kept, and 40 for what slicing makes of it (64 bytes a point, 12 a
// tetrahedron, 8 for each tile of the picture that it reaches into). Of a box that is being read, only the first two are there: so two
// boxes take 120, which is a third of what BoxBytesFor counts threefold.
constexpr std::uint64_t kBytesACell = 80;
constexpr std::uint64_t kBoxBytesACell = 40;

// Bytes that the renderer derives from a byte of voxels, at most.
double DerivedShare(const FrameSetup& setup) { return ReadsInParts(setup) ? setup.renderer->derived_from_stored() : 1; }

std::uint64_t ImageBytes(const PixelBounds& bounds, const FrameSetup& setup) {
  return std::uint64_t(bounds.pixel_count()) * BytesPerPixel(setup.format);
}

// Calls function(number of the brick, its part in the padded box) for the bricks that the padded box, not empty, touches.
template <class Function>
void VisitBricks(const Box& padded, const VolumeSummary& summary, Function&& function) {
  const BrickGrid grid(padded);
  for (const Index3& brick : IndicesIn(Box{grid.first, grid.first + grid.counts}))
    function(NumberIn(summary.brick_counts, brick), grid.BoxOf(brick));
}

// The cells of an unstructured grid in the bricks that the padded box touches.
std::uint64_t CellsIn(const Box& padded, const VolumeSummary& summary) {
  if (padded.empty() || summary.cells.empty()) return 0;
  std::uint64_t cells = 0;
  VisitBricks(padded, summary, [&](std::size_t brick, const Box&) { cells += summary.cells[brick]; });
  return cells;
}
std::uint64_t BytesOfCells(const Box& padded, const VolumeSummary& summary) { return kBytesACell * CellsIn(padded, summary); }

// Those of other fields, and what is derived from them.
std::uint64_t FieldBytes(const Placement& placement, const FrameSetup& setup) {
  double bytes = 0;
  for (const FieldSetup& field : setup.fields) {
    const std::size_t sample = BytesPerSample(LevelOf(field, placement.level).description.type);
    bytes += double(PaddedBox(placement.at(), setup, field).voxel_count()) * double(sample);
  }
  return std::uint64_t((1 + DerivedShare(setup)) * bytes);
}

// Bytes of all fields for a byte of the volume.
double BytesWithFields(const FrameSetup& setup) {
  const auto bytes_in = [](const VolumeDescription& of) {
    const Vec3& spacing = of.geometry.spacing;
    return double(BytesPerSample(of.type)) / (spacing.x * spacing.y * spacing.z);
  };
  double bytes = bytes_in(setup.description);
  for (const FieldSetup& field : setup.fields) bytes += bytes_in(field.levels.front().description);
  return bytes / bytes_in(setup.description);
}

// By worker with a part in the plan: the voxels of the group that needs most of them, if `bytes_of(padded box, level)` tells what one
// takes of the volume.
template <class BytesOf>
std::map<WorkerId, std::uint64_t> MostVoxels(const FramePlan& plan, BytesOf&& bytes_of) {
  std::map<WorkerId, std::uint64_t> most = {{plan.display, 0}};
  for (const GroupPlan& group : plan.groups) {
    std::map<WorkerId, std::uint64_t> bytes;
    for (const Placement& placement : group.placements)
      bytes[placement.worker] += bytes_of(PaddedBox(placement.at(), plan.setup), placement.level) + FieldBytes(placement, plan.setup);
    for (const auto& [worker, of_group] : bytes) most[worker] = std::max(most[worker], of_group);
  }
  return most;
}

std::string SizeText(const FrameSetup& setup) {
  const PixelBounds frame = FrameBounds(setup);
  const Camera& camera = setup.camera;
  const std::string size = fmt::format("size {}x{}", camera.width / camera.supersample, camera.height / camera.supersample);
  const bool same = frame.width() == camera.width / camera.supersample && frame.height() == camera.height / camera.supersample;
  return same ? size : fmt::format("{} (rendered as {}x{})", size, frame.width(), frame.height());
}

std::uint64_t ShapeBytes(const FrameSetup& setup) {
  std::uint64_t bytes = 0;
  for (const ShapeSetup& shape : setup.shapes) bytes += std::uint64_t(shape.bytes.description.voxel_bytes());
  return bytes;
}

}  // namespace

std::uint64_t GroupImageBytes(const FrameSetup& setup, std::span<const Placement> placements) {
  std::uint64_t bytes = 0;
  PixelBounds all;
  for (const Placement& placement : placements) {
    const PixelBounds reach = ReachOf(placement.box, setup);
    bytes = std::min(bytes + ImageBytes(reach, setup), kMostMemoryBytes);  // thousands of the largest images are more than 64 bits count
    all = Union(all, reach);
  }
  return bytes + ImageBytes(all, setup);
}

std::uint64_t PictureBytes(const FrameSetup& setup) {
  const Camera& camera = setup.camera;
  const PixelBounds picture{0, 0, camera.width / camera.supersample, camera.height / camera.supersample};
  const std::uint64_t copies = setup.renderer->FrameIsPicture(setup) ? 1 : 2;
  return std::uint64_t(FrameBytes(setup)) + copies * ImageBytes(picture, setup);
}

std::uint64_t TileBytes(const FrameSetup& setup) {
  constexpr std::uint64_t kOfPixel = 2 * 20 + 8;
  return setup.shapes.empty() ? 0 : kOfPixel * std::uint64_t(FrameBounds(setup).pixel_count());
}

std::uint64_t SharedBytes(const FrameSetup& setup) {
  if (!setup.light) return 0;
  // Of two looks: extinction in two orders, and shares of light for two lights.
  constexpr std::uint64_t kOfVoxel = 24, kOfLight = 8;
  const std::uint64_t lights = std::max<std::size_t>(setup.shading.lights.size(), 1);
  std::uint64_t bytes = CountIn(setup.light->description.geometry.size) * (kOfVoxel + kOfLight * lights);
  // Samples, and of other fields the extinction until it is added to the volume's.
  for (const CoarserLevel* const light : LightVolumesOf(setup)) {
    const std::size_t sample = BytesPerSample(light->description.type) + (light == &*setup.light ? 0 : sizeof(float));
    bytes += CountIn(light->description.geometry.size) * sample;
  }
  return bytes;
}

std::uint64_t VoxelBytes(const Box& padded, const VolumeSummary& summary, double derived_share) {
  if (padded.empty()) return 0;
  std::uint64_t voxels = 0;
  if (summary.bricks.empty()) {
    voxels = std::uint64_t(padded.voxel_count());
  } else {
    VisitBricks(padded, summary, [&](std::size_t brick, const Box& part) {
      const ValueRange& range = summary.bricks[brick];
      if (range.min != range.max) voxels += std::uint64_t(part.voxel_count());
    });
  }
  auto bytes = std::uint64_t((1 + derived_share) * double(voxels * BytesPerSample(summary.description.type)));
  return bytes + BytesOfCells(padded, summary);
}

std::int64_t BoxBytesOfCells(const Box& padded, const VolumeSummary& summary) {
  return std::int64_t(kBoxBytesACell * CellsIn(padded, summary));
}

std::int64_t BoxBytesFor(const FrameSetup& setup, std::uint64_t limit) {
  // Cells are cut at borders of boxes, and drawn for both: fewer boxes draw fewer.
  const std::int64_t most = setup.cells ? 4 * kBoxBytesTarget : kBoxBytesTarget;
  if (limit == 0) return most;
  constexpr std::uint64_t kLeast = 2 << 20;  // smaller boxes are mostly halo
  // Images of the boxes of a group are small beside the frame.
  const std::uint64_t images = PictureBytes(setup) + std::uint64_t(FrameBytes(setup)) / 2 + TileBytes(setup);
  const std::uint64_t taken =
      IdleMemoryBytes(limit) + (ReadsInParts(setup) ? SourceBytes(limit) : 0) + SharedBytes(setup) + ShapeBytes(setup) + images;
  const double boxes = (2 + DerivedShare(setup)) * BytesWithFields(setup);  // of that which is being read nothing is derived yet
  const std::uint64_t box = std::max(kLeast, std::uint64_t(double(limit - std::min(limit, taken)) / boxes));
  return std::min(most, std::int64_t(box - box % (std::bit_floor(box) / 8)));
}

Result<int> FramesThatFit(const FramePlan& plan, const VolumeSummary& summary, std::span<const WorkerLimit> workers) {
  std::uint64_t group_bytes = 0;
  for (const GroupPlan& group : plan.groups) group_bytes = std::max(group_bytes, GroupImageBytes(plan.setup, group.placements));
  // Every worker of a plan may be the next frame's display worker.
  const std::uint64_t images = std::max<std::uint64_t>(group_bytes + PictureBytes(plan.setup) + TileBytes(plan.setup), 1);

  constexpr std::uint64_t kEnough = kMostInWindow;  // more are never under way at a time
  const double derived_share = DerivedShare(plan.setup);
  const auto at_most = [&](const Box& padded, std::uint8_t level) {
    const double bytes = double(padded.voxel_count()) * double(BytesPerSample(summary.description.type));
    return std::uint64_t((1 + derived_share) * bytes) + (level == 0 ? BytesOfCells(padded, summary) : 0);
  };
  std::map<WorkerId, std::uint64_t> voxels = MostVoxels(plan, at_most);
  const auto needs = [&](const WorkerLimit& limit) {
    return IdleMemoryBytes(limit.bytes) + (ReadsInParts(plan.setup) ? SourceBytes(limit.bytes) : 0) + SharedBytes(plan.setup) +
           ShapeBytes(plan.setup) + voxels.at(limit.worker) + images;
  };
  const auto has_part = [&](const WorkerLimit& limit) { return limit.bytes != 0 && voxels.contains(limit.worker); };
  const bool all_fit = std::ranges::all_of(
      workers, [&](const WorkerLimit& limit) { return !has_part(limit) || needs(limit) + (kEnough - 1) * images <= limit.bytes; });
  if (all_fit) return int(kEnough);
  // Only now it matters how much of the volume is empty, which takes longer to find out.
  voxels = MostVoxels(plan, [&](const Box& padded, std::uint8_t level) {
    return level == 0 ? VoxelBytes(padded, summary, derived_share) : at_most(padded, level);
  });

  std::uint64_t fit = kEnough;
  for (const WorkerLimit& limit : workers) {
    if (!has_part(limit)) continue;
    const std::uint64_t needed = needs(limit);
    if (needed > limit.bytes) {
      const std::string what = images > voxels.at(limit.worker) ? SizeText(plan.setup) : "the dataset";
      return Status::ResourceExhausted(fmt::format("{} needs {} of worker {}, limit {} (voxels {}, images {}); --memory sets the limit",
                                                   what, MemoryText(needed), limit.worker, MemoryText(limit.bytes),
                                                   MemoryText(voxels.at(limit.worker)), MemoryText(images)));
    }
    fit = std::min(fit, 1 + (limit.bytes - needed) / images);
  }
  return int(fit);
}

}  // namespace slabstream
