// MeshFile: a surface that is written part by part. Vertices and triangles go to a temporary file each, beside the output; Finish joins
// them.
//
//   .ply   binary, little endian: vertices with normals as floats, triangles as numbers of vertices; vertices are shared
//   .stl   binary: each triangle with its corners as floats
//
// Lengths are those of the world. No file is left behind unless Finish succeeds. One thread at a time.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>

#include "common/base/status.h"
#include "common/files/files.h"
#include "common/volume/volume.h"
#include "data/isosurface/surface_maker.h"

namespace slabstream {

struct MeshFormat;
const MeshFormat* FindMeshFormat(std::string_view path);  // null: its ending is that of none
std::string MeshEndings();                                // ".ply, .stl"

// What a mesh is of, in words, each one line.
struct MeshOf {
  std::string surface;  // "isovalue 300"
  std::string world;    // WorldText
  std::string level;    // of the volume: no other one has the same
};
std::string WorldText(const VolumeGeometry& volume);  // the axes and the unit of positions

class MeshFile {
 public:
  // `path` ends as a format does. Unavailable: it cannot be written.
  static Result<MeshFile> Create(const std::string& path);

  void Add(const SurfacePart& part);  // a failure shows in Finish
  std::int64_t vertices() const { return vertices_; }
  std::int64_t triangles() const { return triangles_; }

  // Calls goes_on() often. Cancelled: that returned false. ResourceExhausted: more triangles than the format can count. Unavailable: it
  // cannot be written.
  Status Finish(const MeshOf& of, const std::function<bool()>& goes_on);
  // Instead, whatever the path ends as: `head`, vertices and triangles as they are in memory, and `tail`.
  Status FinishRaw(const std::string& head, std::span<const std::byte> tail, const std::function<bool()>& goes_on);

 private:
  // write(Joining&) returns whether it went on to the end.
  template <class Write>
  Status Join(const MeshOf& of, const std::function<bool()>& goes_on, Write&& write);

  MeshFile(std::string path, OutputFile vertex_file, OutputFile triangle_file);

  std::string path_;
  OutputFile vertex_file_, triangle_file_;
  std::int64_t vertices_ = 0, triangles_ = 0;
};

}  // namespace slabstream
