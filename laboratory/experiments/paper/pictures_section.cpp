#include <fmt/format.h>

#include <filesystem>

#include "client/pictures/picture_writer.h"
#include "laboratory/experiments/paper/setup.h"

namespace slabstream {
namespace {

constexpr int kPixels = 384;
constexpr ViewParameters kView = {.azimuth_degrees = 150, .elevation_degrees = 15, .zoom = 1.3};

struct Shown {
  std::string figure, source;
  BenchCase volume;
};

}  // namespace

void AddPictures(const PaperSetup& setup, Results& results) {
  std::vector<Shown> all;
  const std::vector<std::string>& named = setup.context().options().volumes;
  const std::vector<BenchCase> heads = RealVolumes(named);  // Figure 12's: what the user named, else the brain, else nothing
  if (!heads.empty()) all.push_back({"Figure 12", named.empty() ? "MRI brain" : "--volume", heads.front()});
  const SphereRequest sphere{SphereClass::kFilled, setup.Scaled(128), 0.4};
  all.push_back({"Figure 13", "sphere", SphereCase(sphere, kOpaqueSphere)});
  const std::string folder = setup.context().options().folder + "/pictures";
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  std::vector<Json> rows;
  for (Shown& shown : all) {
    for (const RendererKind* renderer : {ZBuffer(), Splatting()}) {
      shown.volume.renderer = renderer;
      const Picture picture = setup.RenderAlone(shown.volume, kView, kPixels);
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
