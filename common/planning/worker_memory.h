// What a frame takes of the memory of one worker. Admission (coordinator), the window and the worker's own cache follow this one rule, so a
// worker stays under its limit (Register.memory_bytes):
//
//   limit >= IdleMemoryBytes(limit) + voxels + images
//
// An unfinished group takes (GroupImageBytes)
//   the images of all of its ranks        what a root may hold at a time: its own, and those that wait to be combined
//   one image of the union of their reach an image that is decoded, encoded or on its way to another worker
// and for each frame with shapes what they show in its pixels (TileBytes), drawn here or by others. A display worker takes, for each frame
// (PictureBytes)
//   an image of the whole frame           accumulated
//   the picture, twice                    resampled or averaged if it is not the frame itself; then encoded, until it is sent
// Images count with all pixels that their boxes can reach (ReachOf). Runs and lent images take less. A group needs the voxels of its
// worker's boxes, with their halo, and what renderers derive from them (VoxelBytes): at most as much again. Bricks of one value take
// nothing. If the dataset is an unstructured grid, VoxelBytes has the cells in all bricks that the boxes touch, too. If voxels are read in
// parts (FrameSetup::stored), the renderer says how much it derives from them (RendererKind::derived_from_stored), and the worker takes
// SourceBytes (memory_budget.h) more, for what is being read and decoded. Shadows and ambient occlusion take some 32 bytes more a voxel of
// the light volume. A worker caches more voxels than a group needs as long as images leave room.
#pragma once

#include <cstdint>
#include <span>

#include "common/base/status.h"
#include "common/planning/frame_plan.h"

namespace slabstream {

// Bytes, of the formula above. `placements`: of a group.
std::uint64_t GroupImageBytes(const FrameSetup& setup, std::span<const Placement> placements);
std::uint64_t PictureBytes(const FrameSetup& setup);
// Of each pixel two fragments are counted. 0: the frame has no shapes.
std::uint64_t TileBytes(const FrameSetup& setup);
// What the frames of a process share: the light volume, and what shadows and ambient occlusion make of it. 0: the frame has none of these.
std::uint64_t SharedBytes(const FrameSetup& setup);
// `derived_share`: bytes that are derived from a byte of voxels.
std::uint64_t VoxelBytes(const Box& padded, const VolumeSummary& summary, double derived_share);
// What cells of an unstructured grid add to the voxels of a padded box, as BoxBytesFor counts them. 0: it is none.
std::int64_t BoxBytesOfCells(const Box& padded, const VolumeSummary& summary);

// Most bytes of the volume's voxels, and BoxBytesOfCells, in a padded box with which a worker of this limit (0: none) can hold two boxes of
// a frame at a time, those of other fields beside them, so that it reads one while it renders the other: kBoxBytesTarget or less (of grids
// four times as much), in few different sizes.
std::int64_t BoxBytesFor(const FrameSetup& setup, std::uint64_t limit);

// A worker that has a part in a frame, and its limit in bytes; 0: it has stated none.
struct WorkerLimit {
  WorkerId worker = 0;
  std::uint64_t bytes = 0;
};

// How many frames such as this one fit the memory of all `workers` at a time, in [1, kMostInWindow]: each with one unfinished group, and
// all of one volume. ResourceExhausted: not even one fits; names what is too large, what it needs, and the limit. Workers that have no part
// in the plan do not count. The worker with the least room decides, since a plan gives all of them a part of each frame.
Result<int> FramesThatFit(const FramePlan& plan, const VolumeSummary& summary, std::span<const WorkerLimit> workers);

}  // namespace slabstream
