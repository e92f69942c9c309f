// `info` of unstructured grids: their cells, size and arrays.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <variant>

#include "client/cli/commands.h"
#include "client/report/volume_text.h"
#include "client/request/json_value.h"
#include "common/base/printable.h"
#include "common/renderers/registry.h"
#include "common/volume/summary.h"
#include "data/volume_io/grid_store.h"
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

struct Described {
  MeshFileInfo info;
  Bounds3 bounds;
  std::uint64_t tetrahedra = 0;
  std::uint64_t bytes = 0;  // in memory; 0: they are in a cell store
  ValueRange range;
};

Described OfMesh(LoadedMesh loaded) {
  return {std::move(loaded.info), loaded.bounds, loaded.mesh.tetrahedra.size(), loaded.mesh.bytes(), RangeOf(loaded.mesh.values)};
}

// `headers`: of the grid's files.
Described OfStore(const CellStoreFacts& facts, LoadedMesh headers) {
  Described grid = {std::move(headers.info), facts.bounds, facts.cells, 0, facts.whole};
  grid.info.points = std::int64_t(facts.points_read);
  grid.info.notes = facts.notes;
  for (std::size_t i = 0; i < CellKinds().size(); ++i) {
    grid.info.cells += std::int64_t(facts.kinds[i]);
    if (facts.kinds[i] > 0) grid.info.kinds.push_back({&CellKinds()[i], std::int64_t(facts.kinds[i])});
  }
  if (grid.range.min > grid.range.max) grid.range = {};
  return grid;
}

// `longest_side`: ReadOptions::lattice.
std::string MeshText(const Described& grid, std::optional<std::int32_t> longest_side) {
  const auto& [info, bounds, tetrahedra, bytes, range] = grid;
  const Vec3 extent = bounds.high - bounds.low;
  std::string text = fmt::format("format       {}\n", info.format);
  text += fmt::format("points       {}\n", info.points);
  text += fmt::format("cells        {}, {} tetrahedra when split ({})\n", info.cells, tetrahedra,
                      bytes == 0 ? "kept on disk" : fmt::format("{:.1f} MiB", double(bytes) / (1 << 20)));
  for (const MeshFileInfo::CellCount& cells : info.kinds) {
    text += fmt::format("  {:>10} {}{}\n", cells.count, cells.kind->name, cells.kind->has_volume() ? "" : " (no volume: left out)");
  }
  text += fmt::format("low corner   {:.6g} {:.6g} {:.6g}\n", bounds.low.x, bounds.low.y, bounds.low.z);
  text += fmt::format("extent       {:.6g} x {:.6g} x {:.6g}\n", extent.x, extent.y, extent.z);
  const Index3 lattice = LatticeOf(bounds, std::int64_t(tetrahedra), longest_side).size;
  text += fmt::format("lattice      {} x {} x {} voxels (--lattice); renderers that draw the cells instead: {}\n", lattice.x, lattice.y,
                      lattice.z, NamesOfAble(NameOf(Ability::kCells)));
  text += "arrays       name, of what, components, type\n";
  for (const GridArray& array : info.arrays) {
    text += fmt::format("  {} {} {} {}\n", array.name, NameOf(array.at), array.components, array.TypeText());
  }
  for (const std::string& note : info.notes) text += fmt::format("note         {}\n", Printable(note));
  return text + fmt::format("values       {} ... {} in {}\n", ValueText(range.min), ValueText(range.max), info.arrays[info.array].name);
}

Json MeshJson(const Described& grid) {
  const auto& [info, bounds, tetrahedra, bytes, range] = grid;
  auto kinds = Json::object();
  for (const MeshFileInfo::CellCount& cells : info.kinds) kinds[std::string(cells.kind->name)] = cells.count;
  auto arrays = Json::array();
  for (const GridArray& array : info.arrays) {
    arrays.push_back({{"name", array.name}, {"of", NameOf(array.at)}, {"components", array.components}, {"type", array.TypeText()}});
  }
  return {{"format", info.format},    {"points", info.points},
          {"cells", info.cells},      {"kinds", kinds},
          {"tetrahedra", tetrahedra}, {"bounds", {{"low", VectorJson(bounds.low)}, {"high", VectorJson(bounds.high)}}},
          {"arrays", arrays},         {"array", info.arrays[info.array].name},
          {"notes", info.notes},      {"range", {{"min", range.min}, {"max", range.max}}}};
}

}  // namespace

Status RunMeshInfo(const InfoOptions& options) {
  if (options.request.transfer != TransferChoice{} || options.layers.any()) {
    return Status::InvalidArgument(
        fmt::format("SOURCE '{}' is an unstructured grid; transfer functions and layers are for volumes", options.path));
  }
  const Result<SourceText> source = ParseSourceText(options.path);
  if (!source.ok()) return source.status();
  Result<Grid> grid = ReadGrid(source->path, source->options, VtkGrid(source->path));
  if (!grid.ok()) return grid.status();
  Described described;
  if (const auto* const stored = std::get_if<StoredGrid>(&*grid)) {
    ReadOptions of_headers = source->options;
    of_headers.headers_only = true;
    Result<LoadedMesh> headers = ReadMesh(source->path, MeshOptionsOf(of_headers));
    if (!headers.ok()) return headers.status();
    described = OfStore(stored->cells->facts(), *std::move(headers));
  } else {
    described = OfMesh(std::move(std::get<LoadedMesh>(*grid)));
  }
  std::cout << (options.json ? MeshJson(described).dump(2) + "\n" : MeshText(described, source->options.lattice));
  return Status::Ok();
}

}  // namespace slabstream
