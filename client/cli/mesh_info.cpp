// `info` of unstructured grids: their cells, size and arrays.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>
#include <optional>
#include <span>

#include "client/cli/commands.h"
#include "client/report/volume_text.h"
#include "client/request/json_value.h"
#include "common/base/printable.h"
#include "common/renderers/registry.h"
#include "common/volume/summary.h"
#include "data/volume_io/mesh_reader.h"

namespace slabstream {
namespace {

// Of the finite values; {0, 0} if there is none.
ValueRange RangeOf(std::span<const float> values) {
  ValueRange range = {std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity()};
  for (const float value : values) {
    if (!std::isfinite(value)) continue;
    range = {std::min(range.min, value), std::max(range.max, value)};
  }
  return range.min <= range.max ? range : ValueRange{};
}

// `longest_side`: ReadOptions::lattice.
std::string MeshText(const LoadedMesh& loaded, const ValueRange& range, std::optional<std::int32_t> longest_side) {
  const MeshFileInfo& info = loaded.info;
  const Bounds3& bounds = loaded.bounds;
  const Vec3 extent = bounds.high - bounds.low;
  std::string text = fmt::format("format       {}\n", info.format);
  text += fmt::format("points       {}\n", info.points);
  text += fmt::format("cells        {}, {} tetrahedra when split ({:.1f} MiB)\n", info.cells, loaded.mesh.tetrahedra.size(),
                      double(loaded.mesh.bytes()) / (1 << 20));
  for (const MeshFileInfo::CellCount& cells : info.kinds) {
    text += fmt::format("  {:>10} {}{}\n", cells.count, cells.kind->name, cells.kind->has_volume() ? "" : " (no volume: left out)");
  }
  text += fmt::format("low corner   {:.6g} {:.6g} {:.6g}\n", bounds.low.x, bounds.low.y, bounds.low.z);
  text += fmt::format("extent       {:.6g} x {:.6g} x {:.6g}\n", extent.x, extent.y, extent.z);
  const Index3 lattice = LatticeOf(bounds, std::int64_t(loaded.mesh.tetrahedra.size()), longest_side).size;
  text += fmt::format("lattice      {} x {} x {} voxels (--lattice); renderers that draw the cells instead: {}\n", lattice.x, lattice.y,
                      lattice.z, NamesOfAble(NameOf(Ability::kCells)));
  text += "arrays       name, of what, components, type\n";
  for (const GridArray& array : info.arrays) {
    text += fmt::format("  {} {} {} {}\n", array.name, NameOf(array.at), array.components, array.TypeText());
  }
  for (const std::string& note : info.notes) text += fmt::format("note         {}\n", Printable(note));
  return text + fmt::format("values       {} ... {} in {}\n", ValueText(range.min), ValueText(range.max), info.arrays[info.array].name);
}

Json MeshJson(const LoadedMesh& loaded, const ValueRange& range) {
  const MeshFileInfo& info = loaded.info;
  auto kinds = Json::object();
  for (const MeshFileInfo::CellCount& cells : info.kinds) kinds[std::string(cells.kind->name)] = cells.count;
  auto arrays = Json::array();
  for (const GridArray& array : info.arrays) {
    arrays.push_back({{"name", array.name}, {"of", NameOf(array.at)}, {"components", array.components}, {"type", array.TypeText()}});
  }
  return {{"format", info.format},
          {"points", info.points},
          {"cells", info.cells},
          {"kinds", kinds},
          {"tetrahedra", loaded.mesh.tetrahedra.size()},
          {"bounds", {{"low", VectorJson(loaded.bounds.low)}, {"high", VectorJson(loaded.bounds.high)}}},
          {"arrays", arrays},
          {"array", info.arrays[info.array].name},
          {"notes", info.notes},
          {"range", {{"min", range.min}, {"max", range.max}}}};
}

}  // namespace

Status RunMeshInfo(const InfoOptions& options) {
  if (options.request.transfer != TransferChoice{} || options.layers.any()) {
    return Status::InvalidArgument(
        fmt::format("SOURCE '{}' is an unstructured grid; transfer functions and layers are for volumes", options.path));
  }
  const Result<SourceText> source = ParseSourceText(options.path);
  if (!source.ok()) return source.status();
  const Result<LoadedMesh> loaded =
      ReadMesh(source->path, {.array = source->options.array, .time = source->options.time, .channel = source->options.channel});
  if (!loaded.ok()) return loaded.status();
  const ValueRange range = RangeOf(loaded->mesh.values);
  std::cout << (options.json ? MeshJson(*loaded, range).dump(2) + "\n" : MeshText(*loaded, range, source->options.lattice));
  return Status::Ok();
}

}  // namespace slabstream
