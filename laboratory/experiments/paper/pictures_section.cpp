#include <fmt/format.h>

#include <filesystem>

#include "client/cli/session.h"
#include "client/image_io/image_writer.h"
#include "common/base/files.h"
#include "common/renderers/registry.h"
#include "laboratory/experiments/paper/setup.h"

namespace slabstream {
namespace {

constexpr int kPixels = 384;
constexpr std::size_t kMaxPngBytes = std::size_t{64} << 20;

Photo Render(const PaperSetup& setup, BenchCase volume, const std::string& caption) {
  const VolumeInUse held = setup.context().volumes().Get(volume);
  Session session = OrThrow(Session::OpenLocal({.local_workers = 1, .local_threads = 1},
                                               [voxels = held.volume]() -> Result<std::shared_ptr<const Volume>> { return voxels; }));
  ViewParameters view;
  view.azimuth_degrees = 150;
  view.elevation_degrees = 15;
  view.zoom = 1.3;
  FrameRequest request = BenchRequest(volume, view, {kPixels, kPixels});
  request.dataset = session.dataset();
  const Picture picture = OrThrow(session.client().Render(request));
  const std::string folder = setup.context().options().folder + "/pictures";
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  const std::string path = fmt::format("{}/{}-{}.png", folder, volume.dataset, volume.renderer->name());
  PictureFormat format;
  format.background = {0, 0, 0, 1};
  OrThrow(WritePicture(picture.image, picture.size, path, format));
  return {OrThrow(ReadTextFile(path, kMaxPngBytes)), caption};
}

}  // namespace

Section PicturesSection(const PaperSetup& setup) {
  Section section;
  section.title = "Pictures: figures 12 and 13";
  section.question = "What do both pipelines draw?";
  section.method =
      "An MRI head (the one that was named, or the brain of Debian's mricron-data where it is installed) and a sphere of 128 voxels a "
      "side, both by the Z-buffer and by splatting.";
  std::vector<BenchCase> heads = RealVolumes(setup.context().options().volumes);
  heads.resize(std::min<std::size_t>(heads.size(), 1));
  const SphereRequest sphere{SphereClass::kFilled, setup.Scaled(128), 0.4};
  for (const RendererKind* renderer : {ZBuffer(), Splatting()}) {
    for (BenchCase head : heads) {
      head.renderer = renderer;
      section.blocks.emplace_back(Render(setup, head, fmt::format("Figure 12: {} by {}", head.dataset, renderer->title())));
    }
  }
  for (const RendererKind* renderer : {ZBuffer(), Splatting()}) {
    section.blocks.emplace_back(Render(setup, SphereCase(sphere, kOpaqueSphere, renderer),
                                       fmt::format("Figure 13: a sphere, {0} x {0} x {0}, by {1}", sphere.size, renderer->title())));
  }
  if (heads.empty()) section.answer = "No head: mricron-data is not installed and no --volume was given.";
  return section;
}

}  // namespace slabstream
