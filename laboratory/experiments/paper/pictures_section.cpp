#include <fmt/format.h>

#include <filesystem>
#include <optional>

#include "client/image_io/image_writer.h"
#include "common/renderers/registry.h"
#include "laboratory/experiments/paper/render_alone.h"
#include "laboratory/experiments/paper/setup.h"

namespace slabstream {
namespace {

constexpr int kPixels = 384;
constexpr ViewParameters kView = {.azimuth_degrees = 150, .elevation_degrees = 15, .zoom = 1.3};
constexpr char kVolumesFolder[] = "../shared/volumes";  // from the repository, where it has one

struct Shown {
  std::string figure, source;
  BenchCase volume;
  ViewParameters view;
};

// Soft tissue and, whiter, bone: what 8 bits of a head scanned by X-rays hold.
TransferFunction TissueAndBone() {
  return {{{0, {0.75F, 0.50F, 0.38F}}, {90, {0.87F, 0.66F, 0.54F}}, {130, {0.97F, 0.93F, 0.85F}}, {255, {1, 1, 0.98F}}},
          {{0, 0}, {45, 0}, {65, 0.5}, {255, 0.9}}};
}

// A file ct_...head.... Heads of this kind are stored upside down.
std::optional<BenchCase> CtHead() {
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(kVolumesFolder, error)) {
    const std::string stem = entry.path().stem();
    if (!stem.starts_with("ct_") || stem.find("head") == std::string::npos) continue;
    return BenchCase{.name = stem, .dataset = stem, .volume = entry.path().string(), .transfer = {TissueAndBone()}};
  }
  return std::nullopt;
}

// Figure 12's: what the user named, else a CT head, else the brain, else nothing.
std::vector<Shown> Heads(const PaperSetup& setup) {
  const std::vector<std::string>& named = setup.context().options().volumes;
  if (named.empty()) {
    const ViewParameters upside_down = {.azimuth_degrees = -30, .elevation_degrees = -10, .roll_degrees = 180, .zoom = 1.3};
    if (const std::optional<BenchCase> head = CtHead()) return {{"Figure 12", "CT head", *head, upside_down}};
  }
  const std::vector<BenchCase> volumes = RealVolumes(named);
  if (volumes.empty()) return {};
  return {{"Figure 12", named.empty() ? "MRI brain" : "--volume", volumes.front(), kView}};
}

}  // namespace

void AddPictures(const PaperSetup& setup, Results& results) {
  std::vector<Shown> all = Heads(setup);
  const SphereRequest sphere{SphereClass::kFilled, setup.Scaled(128), 0.4};
  all.push_back({"Figure 13", "sphere", SphereCase(sphere, kOpaqueSphere), kView});
  const std::string folder = setup.context().options().folder + "/pictures";
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  std::vector<Json> rows;
  for (Shown& shown : all) {
    for (const RendererKind* renderer : {ZBuffer(), Splatting()}) {
      shown.volume.renderer = renderer;
      const Picture picture = RenderAlone(setup.context(), shown.volume, shown.view, kPixels);
      const std::string name = fmt::format("{}-{}", shown.volume.dataset, renderer->name());
      PictureFormat format;
      format.background = {0, 0, 0, 1};
      OrThrow(WritePicture(picture.image, picture.size, fmt::format("{}/{}.png", folder, name), format));
      const Index3 size = setup.context().volumes().Get(shown.volume).volume->description.geometry.size;
      rows.push_back({{"figure", shown.figure},
                      {"name", name},
                      {"source", shown.source},
                      {"volume", shown.volume.dataset},
                      {"nx", size.x},
                      {"ny", size.y},
                      {"nz", size.z},
                      {"renderer", renderer->title()},
                      {"pixels", kPixels}});
    }
  }
  results.Attach("pictures", std::move(rows));
}

}  // namespace slabstream
