// Parts of a mesh that several processes make, each at its own time and in a file of its own beside the mesh. Whoever finds all of them
// there joins them. A part names vertices of the one before it by their numbers in that one's last slice (SurfaceMaker::Follow).
//
// A part is a head of text, then its vertices, triangles and last slice as they are in memory. Parts of another surface, such as a run
// before this one has left, count as missing.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "data/isosurface/mesh_file.h"
#include "data/isosurface/surface_share.h"

namespace slabstream {

// What was written.
struct MeshCounts {
  std::int64_t vertices = 0, triangles = 0;
  bool whole = true;                 // false: no mesh yet
  std::vector<int> missing_parts{};  // then: parts that are not there. None: another process has joined them
};

std::string PathOfPart(const std::string& path, const SurfaceShare& share);

// Whether the part is there, and of this surface.
bool HasPart(const std::string& path, const MeshOf& of, const SurfaceShare& share);

// `file` was made for PathOfPart. Errors of MeshFile::Finish.
Status FinishPart(MeshFile& file, const MeshOf& of, const SurfaceShare& share, std::span<const std::int32_t> last_slice,
                  const std::function<bool()>& goes_on);

// Once `own` is there: makes the mesh and removes its parts, if all are there. Waits while another process does so. Without any triangle,
// no mesh is written. ResourceExhausted: more than kMaxSurfaceVertices. DataLoss: a part is damaged. Unavailable: files cannot be locked
// there. Errors of MeshFile.
Result<MeshCounts> JoinParts(const std::string& path, const MeshOf& of, const SurfaceShare& own, const std::function<bool()>& goes_on);

}  // namespace slabstream
