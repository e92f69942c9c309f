#include "laboratory/bench/bench_export.h"

#include <filesystem>

#include "common/files/files.h"
#include "common/json/json.h"
#include "common/mesh/summarize_cells.h"
#include "common/planning/resolved_request.h"
#include "data/volume_io/read_options.h"
#include "data/volume_io/volume_writer.h"

namespace slabstream {
namespace {

// The file that other programs read the cells from, and the array as the user named it ("": the file's own choice). Null: no grid is drawn.
Result<Json> GridJson(const BenchCase& c, const Volume& volume) {
  const auto* text = std::get_if<std::string>(&c.volume);
  if (text == nullptr || volume.cells == nullptr || !c.renderer->Can(Ability::kCells)) return Json();
  const Result<SourceText> source = ParseSourceText(*text);
  if (!source.ok()) return source.status();
  std::error_code error;
  const std::filesystem::path path = std::filesystem::absolute(source->path, error);
  return Json{{"file", error ? source->path : path.string()}, {"array", source->options.array}};
}

std::string SceneJson(const BenchCase& c, const BenchOptions& options, const Material& material, const Json& grid) {
  Json projections = Json::array();
  for (const Projection projection : c.renderer->projections()) projections.push_back(NameOf(projection));
  Json json = {
      {"case", c.name},
      {"volume", c.dataset + ".mha"},
      {"transfer", c.name + ".transfer.json"},
      {"opacity_distance", c.transfer.opacity_distance},
      {"renderer", c.renderer->name()},
      {"size", options.size},
      {"views",
       {{"projections", projections},
        {"frames", options.frames},
        {"turns", options.turns},
        {"elevation_degrees", kBenchElevationDegrees},
        {"zoom", kBenchZoom},
        {"fov_degrees", kBenchFovDegrees}}},
      {"shading",
       {{"ambient", material.ambient}, {"diffuse", material.diffuse}, {"specular", material.specular}, {"shininess", material.shininess}}}};
  if (!grid.is_null()) json["grid"] = grid;
  return json.dump(2) + "\n";
}

}  // namespace

Status ExportCase(const BenchCase& bench_case, const BenchOptions& options) {
  const Result<std::shared_ptr<const Volume>> volume = LoadBenchVolume(bench_case);
  if (!volume.ok()) return volume.status();
  const Result<TransferFunction> transfer = ResolveTransfer(bench_case.transfer, SummaryOf(**volume));
  if (!transfer.ok()) return transfer.status();
  const Result<Json> grid = GridJson(bench_case, **volume);
  if (!grid.ok()) return grid.status();
  const std::string directory = options.export_directory + "/", base = directory + bench_case.name;
  if (Status status = WriteVolume(**volume, directory + bench_case.dataset + ".mha"); !status.ok()) return status;
  if (Status status = WriteTextFile(base + ".transfer.json", FormatParaViewColorMap(*transfer, bench_case.name)); !status.ok()) {
    return status;
  }
  return WriteTextFile(base + ".scene.json", SceneJson(bench_case, options, transfer->material.value_or(Material()), *grid));
}

}  // namespace slabstream
