// `info` of a mesh, lines or points.
#include <fmt/format.h>

#include <iostream>

#include "client/cli/commands.h"
#include "client/report/dataset_text.h"
#include "common/shapes/packed_shape.h"
#include "data/catalogue/shape_data.h"
#include "data/shapes/shape_file.h"

namespace slabstream {

Status RunShapeInfo(const InfoOptions& options) {
  const Result<ShapeFile> file = FindShapeFile(options.path);
  if (!file.ok()) return file.status();
  const Result<Shape> shape = ReadShape(file->path);
  if (!shape.ok()) return shape.status();
  const Result<AlignedVector<std::byte>> bytes = PackShape(*shape);
  if (!bytes.ok()) return Status(bytes.status().code(), file->path + ": " + bytes.status().message());
  ShapeInfo info = InfoOf(*bytes).value();
  info.vertices = shape->positions.size();  // of the file
  if (options.json) {
    Json json = ShapeJson(info);
    if (file->times.count > 1) json["times"] = file->times.count;
    std::cout << json.dump(2) << "\n";
    return Status::Ok();
  }
  std::cout << fmt::format("shape        {}: {} {}, {} vertices\n", NameOf(info.kind), info.parts, PartsOf(info.kind), info.vertices);
  if (file->times.count > 1) std::cout << fmt::format("times        {}, a file each; this is time {}\n", file->times.count, file->time);
  std::cout << fmt::format("bounds       {:g} to {:g}, {:g} to {:g}, {:g} to {:g} along x, y and z of its world\n", info.low.x, info.high.x,
                           info.low.y, info.high.y, info.low.z, info.high.z);
  if (info.has_colors) std::cout << "colours      of vertices\n";
  if (info.has_radii) std::cout << "radii        of vertices\n";
  if (info.has_values) std::cout << fmt::format("values       {:g} ... {:g}\n", info.least, info.largest);
  std::cout << fmt::format("memory       {:.1f} MiB in the coordinator and in each worker that draws it\n",
                           double(bytes->size()) / double(1 << 20));
  return Status::Ok();
}

}  // namespace slabstream
