#include "tests/worker/renderers/render_support.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <type_traits>

#include "common/base/check.h"
#include "common/decomposition/decomposition.h"
#include "common/kernels/combine.h"
#include "common/mesh/mesh_part.h"
#include "common/volume/light_volume.h"
#include "tests/common/mesh/mesh_samples.h"
#include "tests/support/renderers.h"

namespace slabstream::testing {

Volume MakeBlobs(const VolumeGeometry& geometry, ScalarType type, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  struct Wave {
    Vec3 k;
    double phase;
  };
  std::vector<Wave> waves;
  for (int i = 0; i < 5; ++i) waves.push_back({{uniform(random), uniform(random), uniform(random)}, 6 * uniform(random)});
  return MakeVolume(geometry, type, [&](const Index3& v) {
    double sum = 0;
    for (const Wave& wave : waves) sum += std::sin(Dot(wave.k, ToVec3(v)) + wave.phase);
    return std::clamp(100 * sum, 0.0, 200.0);
  });
}

Volume MakeBlock(const VolumeGeometry& geometry) {
  return MakeVolume(geometry, ScalarType::kUint8, [](const Index3&) { return 100; });
}

TransferFunction Ramp(double opacity) {
  TransferFunction transfer;
  transfer.colors = {{0, {0.9F, 0.2F, 0.1F}}, {100, {0.3F, 0.8F, 0.2F}}, {200, {0.2F, 0.4F, 1.0F}}};
  transfer.opacities = {{0, 0, 0.5, 0}, {200, opacity, 0.5, 0}};
  return transfer;
}

TransferFunction Uniform(double opacity, Rgb color) {
  TransferFunction transfer;
  transfer.colors = {{0, color}};
  transfer.opacities = {{0, 0, 0.5, 0}, {1, opacity, 0.5, 0}};
  return transfer;
}

FrameSetup MakeSetup(const Volume& volume, const SetupOptions& options) {
  FrameSetup setup;
  setup.description = volume.description;
  setup.range = Summarize(volume).range;
  SetRenderer(*options.renderer, setup);
  SetView(options.view, options.size, setup);
  setup.clip = MakeClipRegion(options.clipping, volume.description.geometry).value();
  setup.transfer = options.transfer;
  setup.shading = options.shading;
  setup.termination = options.termination;
  if (setup.shading.needs_light_volume()) {
    setup.light = NewLightVolume(volume.description);
    setup.dataset = LightVolumeOf(setup.light->dataset);
  }
  return setup;
}

CoarserLevel NewLightVolume(const VolumeDescription& description) {
  // What is kept between frames is kept by these numbers.
  static std::atomic<DatasetId> last = 0;
  CoarserLevel light = {LightVolumeOf(++last), description};
  light.description.geometry = LightGeometry(description.geometry);
  return light;
}

std::shared_ptr<const FrameLight> LightOf(const Volume& volume, const FrameSetup& setup, const std::vector<Volume>& fields) {
  if (!setup.light) return nullptr;
  const auto values = [&](std::size_t number) {
    const Volume& of = number == 0 ? volume : fields.at(number - 1);
    return MakeLightVolume(of.block, of.description).block;
  };
  return MakeFrameLight(values, setup);
}

FrameSetup RaycastSetup(const Volume& volume, SetupOptions options, double samples_per_voxel, double jitter, bool smooth) {
  options.renderer = FindRenderer("raycast");
  FrameSetup setup = MakeSetup(volume, options);
  setup.parameters = {samples_per_voxel, jitter, smooth ? 1.0 : 0.0};
  return setup;
}

FrameSetup SplatSetup(const Volume& volume, const SetupOptions& options, double footprint) {
  FrameSetup setup = MakeSetup(volume, options);
  setup.parameters = {footprint};
  EXPECT_TRUE(setup.renderer->SetView(options.view, options.size, setup).ok());
  return setup;
}

double LengthInside(const FrameSetup& setup, int x, int y) {
  const Camera::Ray ray = setup.camera.RayAt(x + 0.5, y + 0.5);
  double enter = -1e300, leave = 1e300;
  for (const Axis axis : kAxes) {
    const double low = (-0.5 - ray.origin[axis]) / ray.direction[axis];
    const double high = (setup.description.geometry.size[axis] - 0.5 - ray.origin[axis]) / ray.direction[axis];
    enter = std::max(enter, std::min(low, high));
    leave = std::min(leave, std::max(low, high));
  }
  return std::max(leave - enter, 0.0) * Length(setup.camera.spacing * ray.direction);
}

ViewParameters RandomView(Projection projection, std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(0, 1);
  ViewParameters view;
  view.projection = projection;
  view.azimuth_degrees = 360 * uniform(random);
  view.elevation_degrees = std::asin(2 * uniform(random) - 1) * 57.29577951308232;
  view.roll_degrees = 360 * uniform(random);
  view.zoom = 0.5 + uniform(random);
  view.fov_degrees = 10 + 50 * uniform(random);
  return view;
}

std::vector<ViewParameters> RandomViews(Projection projection, int count, std::mt19937& random) {
  std::vector<ViewParameters> views;
  for (int i = 0; i < count; ++i) views.push_back(RandomView(projection, random));
  return views;
}

void ExpectOpacityOfLength(const Volume& volume, const std::vector<ViewParameters>& views, const OpacityOfLength& of) {
  constexpr double kOpacity = 0.06;
  const double voxel_length = Least(volume.description.geometry.spacing);
  int pixels = 0;
  for (std::size_t view = 0; view < views.size(); ++view) {
    SetupOptions options{.view = views[view], .transfer = Uniform(kOpacity, {1, 1, 1})};
    options.view.zoom = 1.5;
    const FrameSetup setup = of.setup(options, int(view));
    const LocalImage image = RenderPicture(volume, setup);
    for (int y = 0; y < setup.camera.height; ++y) {
      for (int x = 0; x < setup.camera.width; ++x) {
        const double length = of.length(setup, x, y) / voxel_length;
        if (length == 0 || length < of.least_length) continue;
        ++pixels;
        const double expected = 1 - std::pow(1 - kOpacity, length);
        ASSERT_NEAR(PixelOf(image, x, y)[3], expected, 0.01 * expected) << "view " << view << " pixel " << x << ' ' << y;
      }
    }
  }
  EXPECT_GT(pixels, 1000);
}

Clipping RandomClipping(const VolumeGeometry& geometry, std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  const Vec3 extent = ToVec3(geometry.size) * geometry.spacing;
  Clipping clipping;
  for (int planes = 1 + int(random() % 3); planes > 0; --planes) {
    const Vec3 normal = {uniform(random), uniform(random), uniform(random)};
    const Vec3 through = extent * Vec3{0.5 + 0.3 * uniform(random), 0.5 + 0.3 * uniform(random), 0.5 + 0.3 * uniform(random)};
    clipping.planes.push_back({normal, -Dot(normal, through)});
  }
  if (random() % 2 == 0) {
    clipping.box = ClipBox{{20 + 15 * uniform(random), -1e9, 10}, {80 + 15 * uniform(random), 70, 1e9}, ClipUnit::kPercent};
  }
  return clipping;
}

std::unique_ptr<BoxData> CutBox(const Volume& volume, const Box& box) { return std::make_unique<BoxData>(CutBlock(volume.block, box)); }

Volume VolumeFor(const RendererKind& kind, Volume volume) { return kind.Can(Ability::kCells) ? AsGrid(volume) : std::move(volume); }

std::unique_ptr<BoxData> BoxFor(const RendererKind& kind, const Volume& volume, const Box& box, std::int32_t halo) {
  const Box padded_box = Grown(box, halo, volume.block.box);
  std::shared_ptr<const Mesh> cells;
  if (kind.Can(Ability::kCells) && volume.cells != nullptr) cells = std::make_shared<const Mesh>(MeshCutter(volume.cells).Cut(padded_box));
  return std::make_unique<BoxData>(CutBlock(volume.block, padded_box), std::move(cells));
}

namespace {

LocalImage RenderBox(const Volume& volume, const FrameSetup& setup, const Box& box, std::uint64_t* drawn = nullptr) {
  const auto data = BoxFor(*setup.renderer, volume, box, setup.halo);
  data->SetLight(LightOf(volume, setup));
  RankReport report;
  LocalImage image = MakeRenderer(*setup.renderer)->Render(*data, box, setup, MaskBefore(box, setup), RenderControl(), report).value();
  if (drawn != nullptr) *drawn += report.drawn_voxels;
  return image;
}

}  // namespace

LocalImage RenderWhole(const Volume& volume, const FrameSetup& setup) {
  return RenderBox(volume, setup, volume.description.geometry.bounds());
}

LocalImage CombinedBoxes(const FrameSetup& setup, const Partition& partition, const std::function<LocalImage(const Box&)>& render) {
  LocalImage frame = MakeLocalImage(setup.format, {});
  for (const BoxId id : VisibilityOrder(partition, setup.camera, setup.description.geometry.stretch))
    Combine(frame, render(partition.boxes()[id]), Side::kBack);
  return frame;
}

LocalImage RenderByBoxes(const Volume& volume, const FrameSetup& setup, const Partition& partition, std::uint64_t* drawn) {
  return CombinedBoxes(setup, partition, [&](const Box& box) { return RenderBox(volume, setup, box, drawn); });
}

LocalImage RenderPicture(const Volume& volume, const FrameSetup& setup) { return FinishPicture(RenderWhole(volume, setup), setup); }

FieldSetup& Scene::Add(Volume field) {
  fields.push_back(std::move(field));
  return setup.fields.emplace_back(FieldSetup{.levels = {{DatasetId(1 + fields.size()), fields.back().description, {}}}, .of_volume = {0}});
}

void Scene::Show(Volume field, FieldLook look) {
  look.range = Summarize(field).range;
  FieldSetup& added = Add(std::move(field));
  added.look = std::move(look);
  if (setup.light) added.light = NewLightVolume(fields.back().description);
}

void Scene::Show(Volume labels, LabelLook look) { Add(std::move(labels)).labels = std::move(look); }

void Scene::Hide() {
  setup.fields.clear();
  fields.clear();
}

SceneBoxes::SceneBoxes(const Scene& scene, const Box& box) : volume(CutBox(scene.volume, PaddedBox(box, scene.setup))) {
  std::vector<BoxData*> all;
  for (std::size_t i = 0; i < scene.fields.size(); ++i) {
    const Box there = PaddedBox(box, scene.setup, scene.setup.fields[i]);
    fields.push_back(there.empty() ? nullptr : CutBox(scene.fields[i], there));
    all.push_back(fields.back().get());
  }
  volume->SetFields(std::move(all));
  volume->SetLight(LightOf(scene.volume, scene.setup, scene.fields));
}

LocalImage Rendered(const Scene& scene, const Box& box) {
  const SceneBoxes boxes(scene, box);
  RankReport report;
  return MakeRenderer(*scene.setup.renderer)->Render(*boxes.volume, box, scene.setup, {}, RenderControl(), report).value();
}

LocalImage Rendered(const Scene& scene) { return Rendered(scene, scene.volume.description.geometry.bounds()); }

VolumeGeometry RandomGridIn(const VolumeGeometry& volume, std::mt19937& random) {
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); };
  const auto number = [&] { return std::uniform_int_distribution<int>(5, 30)(random); };
  const auto unit = [](const Vec3& v) { return (1 / Length(v)) * v; };
  VolumeGeometry grid;
  grid.size = {number(), number(), number()};
  grid.spacing = {uniform(0.4, 2), uniform(0.4, 2), uniform(0.4, 2)};
  const Vec3 x = unit({uniform(-1, 1), uniform(-1, 1), uniform(0.1, 1)}), z = unit(Cross(x, Vec3{uniform(-1, 1), 1, 0.3}));
  grid.orientation.axes = {x, Cross(z, x), z};
  const Vec3 extent = volume.spacing * ToVec3(volume.size), middle = {uniform(0, extent.x), uniform(0, extent.y), uniform(0, extent.z)};
  grid.orientation.origin = middle - grid.orientation.ToWorld(0.5 * grid.spacing * ToVec3(grid.size));
  return grid;
}

Partition CutIntoSlabs(const Volume& volume, int boxes, Axis axis) {
  const WorkField voxels = WorkField::Uniform(volume.description.geometry.size);
  return MakeSlabs({.work = &voxels, .boxes = boxes, .axis = axis});
}

Partition CutAtRandom(const Box& bounds, int boxes, std::mt19937& random) {
  std::vector<Partition::Node> nodes(1);
  std::vector<Box> extents = {bounds};
  std::vector<std::uint32_t> leaves = {0};
  for (int tries = 0; int(leaves.size()) < boxes; ++tries) {
    CHECK_LT(tries, 1000) << "no room for so many boxes";
    const std::size_t at = std::uniform_int_distribution<std::size_t>(0, leaves.size() - 1)(random);
    const std::uint32_t node = leaves[at];
    const Axis axis = kAxes[std::uniform_int_distribution<std::size_t>(0, 2)(random)];
    const Box extent = extents[node];
    if (extent.size()[axis] < 2) continue;
    const auto position = std::uniform_int_distribution<std::int32_t>(extent.begin[axis] + 1, extent.end[axis] - 1)(random);
    Box lower = extent, upper = extent;
    lower.end[axis] = upper.begin[axis] = position;
    nodes[node] = {false, axis, position, std::uint32_t(nodes.size()), std::uint32_t(nodes.size() + 1), 0};
    leaves[at] = std::uint32_t(nodes.size());
    leaves.push_back(std::uint32_t(nodes.size() + 1));
    nodes.resize(nodes.size() + 2);
    extents.push_back(lower);
    extents.push_back(upper);
  }
  BoxId id = 0;
  for (Partition::Node& node : nodes) {
    if (node.leaf) node.box = id++;
  }
  return {bounds, std::move(nodes)};
}

std::array<float, 4> PixelOf(const LocalImage& image, int x, int y) {
  const PixelBounds& b = image.bounds;
  if (x < b.x_begin || x >= b.x_end || y < b.y_begin || y >= b.y_end) return {};
  const float* pixel = &image.rgba[4 * (std::size_t(y - b.y_begin) * std::size_t(b.width()) + std::size_t(x - b.x_begin))];
  return {pixel[0], pixel[1], pixel[2], pixel[3]};
}

float LargestDifference(const LocalImage& a, const LocalImage& b) {
  float largest = 0;
  const PixelBounds bounds = Union(a.bounds, b.bounds);
  for (int y = bounds.y_begin; y < bounds.y_end; ++y) {
    for (int x = bounds.x_begin; x < bounds.x_end; ++x) {
      const auto pa = PixelOf(a, x, y), pb = PixelOf(b, x, y);
      for (std::size_t c = 0; c < 4; ++c) {
        const float difference = std::abs(pa[c] - pb[c]);
        if (!(difference <= largest)) largest = difference;  // keeps NaN
      }
    }
  }
  return largest;
}

void ExpectHiddenTilesChangeNothingElse(const Volume& volume, const FrameSetup& setup, double part, std::mt19937& random) {
  const PixelBounds frame = FrameBounds(setup);
  OcclusionMask mask{OcclusionTiles(frame.width()), OcclusionTiles(frame.height()), {}};
  std::bernoulli_distribution hidden(part);
  for (std::int32_t i = 0; i < mask.tiles_x * mask.tiles_y; ++i) mask.steps.push_back(hidden(random) ? kOcclusionSteps : 0);
  const LocalImage whole = RenderWhole(volume, setup);
  const auto data = BoxFor(*setup.renderer, volume, volume.block.box, 0);
  RankReport report;
  const LocalImage masked = MakeRenderer(*setup.renderer)->Render(*data, volume.block.box, setup, mask, RenderControl(), report).value();
  for (int y = 0; y < frame.height(); ++y) {
    for (int x = 0; x < frame.width(); ++x) {
      if (!mask.Hides(x, y)) {
        ASSERT_EQ(PixelOf(masked, x, y), PixelOf(whole, x, y)) << "at " << x << ' ' << y;
      }
    }
  }
  if (part == 1) {
    EXPECT_EQ(report.drawn_voxels, 0U);
  }
}

}  // namespace slabstream::testing
