// Surface: the faces that the Z-buffer draws of a box, made once for a transfer function: the faces of its opaque voxels without an opaque
// neighbour, with bins and the normals at their corners. 24 bytes a face, 28 with labels. Faces are grouped by bricks, so that a frame
// places, culls and sorts a few bricks instead of many faces, and draws only the sides that face the eye.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/memory/aligned_buffer.h"
#include "common/volume/volume.h"
#include "worker/kernels/surface_face.h"
#include "worker/renderers/bin_lookup.h"
#include "worker/renderers/brick_ranges.h"
#include "worker/renderers/zbuffer/box_labels.h"

namespace slabstream {

struct SurfaceBrick {
  Index3 origin;                                       // voxel (0, 0, 0) of the brick, at multiples of kFaceBrick
  Box voxels;                                          // bounding box of the voxels that have faces
  std::array<std::uint32_t, kSides + 1> side_begin{};  // number of each side's first face, then the end

  std::uint32_t face_count() const { return side_begin[kSides] - side_begin[0]; }
};

struct Surface {
  std::vector<SurfaceBrick> bricks;    // x fastest
  AlignedVector<FaceSite> sites;       // by face, in the order of FaceIndex; then kSitesReadAhead more that are no faces
  AlignedVector<FaceNormals> normals;  // by face
  std::vector<std::uint32_t> labels;   // by face: the number of its voxel's label, and one more; empty if labels are not shown

  Box opaque_hull;  // outside it no voxel of the box is opaque; whole bricks, so it may be too large

  std::size_t bytes() const;
};

// A surface at hand of a box of the same volume, made with the same table, selection and labels.
struct KnownSurface {
  Box box;
  const Surface* surface = nullptr;
};

// Which voxels are opaque.
struct OpaqueVoxels {
  const ClassificationTable& table;
  const BinSelection& bins;           // opaque ones
  const BrickRanges& ranges;          // ranges of the voxels
  const BoxLabels* labels = nullptr;  // null: not shown
};

// Looks up neighbours in all of `voxels`, including the halo (of at least 2 voxels); outside the volume nothing is opaque. A brick's faces
// depend only on the part of it that the box holds: where a box of `known` holds the same part, they are copied from there. Runs on the
// threads of the calling task arena.
Surface FindSurface(const VoxelBlock& voxels, const OpaqueVoxels& opaque, const Vec3& spacing, const Box& box,
                    std::span<const KnownSurface> known = {});

}  // namespace slabstream
