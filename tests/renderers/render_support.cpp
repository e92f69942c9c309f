#include "tests/renderers/render_support.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <type_traits>

#include "common/base/check.h"
#include "common/decomposition/decomposition.h"
#include "common/kernels/combine.h"
#include "tests/support/renderers.h"

namespace slabstream::testing {

Volume MakeVolume(const VolumeGeometry& geometry, ScalarType type, const std::function<double(const Index3&)>& value) {
  Volume volume{{geometry, type, {}}, MakeVoxelBlock(geometry.bounds(), type)};
  VisitScalarType(type, [&](auto* tag) {
    auto* samples = volume.block.samples<std::remove_cvref_t<decltype(*tag)>>();
    for (Index3 v; v.z < geometry.size.z; ++v.z) {
      for (v.y = 0; v.y < geometry.size.y; ++v.y) {
        for (v.x = 0; v.x < geometry.size.x; ++v.x) samples[volume.block.Offset(v)] = std::remove_cvref_t<decltype(*tag)>(value(v));
      }
    }
  });
  return volume;
}

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
  return setup;
}

FrameSetup RaycastSetup(const Volume& volume, SetupOptions options, double samples_per_voxel) {
  options.renderer = FindRenderer("raycast");
  FrameSetup setup = MakeSetup(volume, options);
  setup.parameters = {samples_per_voxel};
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

std::unique_ptr<SlabData> CutSlab(const Volume& volume, const Box& box) { return std::make_unique<SlabData>(CutBlock(volume.block, box)); }

namespace {

float StoredValue(const VoxelBlock& block, const Index3& voxel) {
  return VisitScalarType(block.type,
                         [&](auto* tag) { return float(block.samples<std::remove_cvref_t<decltype(*tag)>>()[block.Offset(voxel)]); });
}

}  // namespace

std::shared_ptr<const Mesh> GridOf(const Volume& volume, std::int32_t step) {
  const Index3 size = volume.description.geometry.size;
  std::array<std::vector<double>, 3> places;  // of points, by axis
  for (const Axis axis : kAxes) {
    std::vector<double>& along = places[std::size_t(Number(axis))];
    along.push_back(-0.5);
    for (std::int32_t i = 0; i < size[axis]; i += step) along.push_back(i);
    along.push_back(size[axis] - 0.5);
  }
  auto mesh = std::make_shared<Mesh>();
  const auto number = [&](std::size_t x, std::size_t y, std::size_t z) {
    return PointNumber((z * places[1].size() + y) * places[0].size() + x);
  };
  for (std::size_t z = 0; z < places[2].size(); ++z) {
    for (std::size_t y = 0; y < places[1].size(); ++y) {
      for (std::size_t x = 0; x < places[0].size(); ++x) {
        const Vec3 at = {places[0][x], places[1][y], places[2][z]};
        mesh->points.push_back({float(at.x), float(at.y), float(at.z)});
        Index3 voxel;
        for (const Axis axis : kAxes) voxel[axis] = std::clamp(std::int32_t(std::lround(at[axis])), 0, size[axis] - 1);
        mesh->values.push_back(StoredValue(volume.block, voxel));
        if (x == 0 || y == 0 || z == 0) continue;
        const PointNumber points[] = {number(x - 1, y - 1, z - 1), number(x, y - 1, z - 1), number(x, y, z - 1), number(x - 1, y, z - 1),
                                      number(x - 1, y - 1, z),     number(x, y - 1, z),     number(x, y, z),     number(x - 1, y, z)};
        SplitCell(*FindCellKind(12), points, mesh->tetrahedra);
      }
    }
  }
  return mesh;
}

std::shared_ptr<const Mesh> CutCells(const Mesh& cells, const Box& box) {
  constexpr float kSlack = 0.01F;  // voxels: samples of the box lie so near to it at most
  auto part = std::make_shared<Mesh>();
  part->at = cells.at;
  constexpr PointNumber kNone = 0xFFFFFFFF;
  std::vector<PointNumber> numbers(cells.points.size(), kNone);
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < cells.tetrahedra.size(); ++i) {
    bool touches = true;
    for (const Axis axis : kAxes) {
      float low = 1e30F, high = -1e30F;
      for (const PointNumber point : cells.tetrahedra[i]) {
        low = std::min(low, cells.points[point][axis]);
        high = std::max(high, cells.points[point][axis]);
      }
      touches = touches && high >= float(box.begin[axis]) - 0.5F - kSlack && low <= float(box.end[axis]) - 0.5F + kSlack;
    }
    if (!touches) continue;
    kept.push_back(i);
    for (const PointNumber point : cells.tetrahedra[i]) numbers[point] = 0;
  }
  for (std::size_t point = 0; point < numbers.size(); ++point) {
    if (numbers[point] == kNone) continue;
    numbers[point] = PointNumber(part->points.size());
    part->points.push_back(cells.points[point]);
    if (cells.at == ValuesAt::kPoints) part->values.push_back(cells.values[point]);
  }
  for (const std::size_t i : kept) {
    Tetrahedron t = cells.tetrahedra[i];
    for (PointNumber& point : t) point = numbers[point];
    part->tetrahedra.push_back(t);
    if (cells.at == ValuesAt::kCells) part->values.push_back(cells.values[i]);
  }
  return part;
}

std::unique_ptr<SlabData> SlabFor(const RendererKind& kind, const Volume& volume, const Box& box, std::int32_t halo, const Cells& cells) {
  SlabLayers layers;
  if (kind.draws_cells()) layers.cells = CutCells(cells != nullptr ? *cells : *GridOf(volume, 2), box);
  return std::make_unique<SlabData>(CutBlock(volume.block, Grown(box, halo, volume.block.box)), std::move(layers));
}

namespace {

LocalImage RenderBox(const Volume& volume, const FrameSetup& setup, const Box& box, const Cells& cells) {
  const auto slab = SlabFor(*setup.renderer, volume, box, setup.halo, cells);
  RankReport report;
  return MakeRenderer(*setup.renderer)->Render(*slab, box, setup, {}, std::atomic<bool>(false), report).value();
}

}  // namespace

LocalImage RenderWhole(const Volume& volume, const FrameSetup& setup, const Cells& cells) {
  return RenderBox(volume, setup, volume.description.geometry.bounds(), cells);
}

LocalImage RenderByBoxes(const Volume& volume, const FrameSetup& setup, const Partition& partition, Cells cells) {
  if (cells == nullptr && setup.renderer->draws_cells()) cells = GridOf(volume, 2);
  LocalImage frame = MakeLocalImage(setup.format, {});
  for (BoxId id : VisibilityOrder(partition, setup.camera)) {
    Combine(frame, RenderBox(volume, setup, partition.boxes()[id], cells), Side::kBack);
  }
  return frame;
}

LocalImage RenderPicture(const Volume& volume, const FrameSetup& setup, const Cells& cells) {
  return FinishPicture(RenderWhole(volume, setup, cells), setup);
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

}  // namespace slabstream::testing
