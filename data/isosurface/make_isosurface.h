// MakeIsosurface: writes the isosurface of a level of a source as a mesh (surface_maker.h, mesh_file.h). The level is read once, in pieces
// (data/survey/pieces.h), so neither it nor the mesh is ever in memory as a whole: some hundred MiB, whatever the volume. Two kinds of
// sources need memory for a whole level: those that are decoded as a whole (SourceInfo::whole), and streams whose slices do not come in the
// order of z.
//
// The surface of a label is where half of what lies around a place is of the label: the cubic B-spline of its membership, as labels are
// drawn smoothly (common/frame/smooth_label.h), at voxels, and linear between them. Structures one voxel thin may vanish.
//
// The same source gives the same bytes, however many threads there are. Several processes, on hosts that see the same files, may make the
// surface together, each some slices of it.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "common/base/status.h"
#include "data/isosurface/mesh_parts.h"
#include "data/sources/volume_source.h"

namespace slabstream {

struct IsosurfaceOptions {
  int level = 0;
  double isovalue = 0;                 // finite; without `label`
  std::optional<std::uint64_t> label;  // the source is one of labels
  bool caps = false;
  SurfaceShare share = {};
  // Called often: bytes of voxels that are done, and all. Whether to go on.
  std::function<bool(std::uint64_t done, std::uint64_t all)> progress = [](std::uint64_t, std::uint64_t) { return true; };
};

// `path` ends as FindMeshFormat wants it. Of several parts, the process that makes the last one joins all (mesh_parts.h). InvalidArgument:
// there is no such surface; the message names the range of the values (survey.h); or too many parts. Cancelled: `progress` returned false.
// Errors of reading, of SurfaceMaker::Add, and of MeshFile.
Result<MeshCounts> MakeIsosurface(VolumeSource& source, const IsosurfaceOptions& options, const std::string& path);

}  // namespace slabstream
