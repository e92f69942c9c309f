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

class MeshFile {
 public:
  // `path` ends as a format does. Unavailable: it cannot be written.
  static Result<MeshFile> Create(const std::string& path);

  void Add(const SurfacePart& part);  // a failure shows in Finish
  std::int64_t vertices() const { return vertices_; }
  std::int64_t triangles() const { return triangles_; }

  // `surface`: what it is, for the header: "isovalue 300". Calls goes_on() often. Cancelled: that returned false. ResourceExhausted: more
  // triangles than the format can count. Unavailable: it cannot be written.
  Status Finish(const std::string& surface, const VolumeGeometry& volume, const std::function<bool()>& goes_on);

 private:
  MeshFile(std::string path, OutputFile vertex_file, OutputFile triangle_file);

  std::string path_;
  OutputFile vertex_file_, triangle_file_;
  std::int64_t vertices_ = 0, triangles_ = 0;
};

}  // namespace slabstream
