#include "tests/common/wire/samples.h"
#include "common/view/world_limits.h"
#include "tests/common/view/view_limits.h"
#include "tests/support/renderers.h"

#include <limits>
#include <string>
#include <utility>

#include "common/view/default_view.h"
#include "common/volume/light_volume.h"
#include "common/wire/limits.h"

namespace slabstream {
namespace {

constexpr std::uint32_t kMax32 = std::numeric_limits<std::uint32_t>::max();
constexpr std::uint64_t kMax64 = std::numeric_limits<std::uint64_t>::max();
constexpr std::int64_t kMaxTime = std::numeric_limits<std::int64_t>::max();

const std::string kLongName(kMaxNameBytes, 'n');
const std::string kLongText(kMaxTextBytes, 't');
const std::string kLongEndpoint(kMaxEndpointBytes, 'e');
const std::string kKey(kKeyTextBytes, 'k');
const std::string kOddEndpoint = "ipc:///tmp/not\xFFutf-8";  // paths are bytes
const std::string kUmlaut = "B\xC3\xBCro";

RankReport FullReport() {
  RankReport report{.worker = kMax32, .group = 1023, .rank = 65535, .box = kMax32};
  for (int i = 0; i < kStageCount; ++i) report.stage_ns[static_cast<std::size_t>(i)] = i % 2 == 0 ? kMaxTime - i : -i;
  for (int i = 0; i < kMaxSpans; ++i) report.spans.push_back({Stage(i % kStageCount), kMaxTime - i, -kMaxTime});
  report.occupied_voxels = report.drawn_voxels = report.voxel_bytes = report.image_bytes = report.image_pixels = report.stored_bytes =
      report.sent_bytes = kMax64;
  report.image_bounds = {0, 1, 16384, 16384};
  return report;
}

std::vector<WebTraffic> SampleTraffic() {
  return {{"a:80"}, {kLongName, kMax64, kMax64 - 1, kMax64 - 2, kMax64 - 3, kMax64 - 4, kMax64 - 5}};
}

VolumeDescription Description() {
  return {{{301, 370, 316}, {0.5, 1, 2.25}, {.unit = LengthUnit::kAngstrom}}, ScalarType::kUint16, {-0.125, 1e300}};
}

VolumeDescription RectilinearDescription() {
  VolumeDescription description{{{3, 2, 4}}, ScalarType::kFloat32, {}};
  description.geometry.stretch = Stretch::Make({{{-0.25, 0.5, 2.25}, {}, {0, 1, 1.5, 3.25}}}, description.geometry.size).value();
  return description;
}

TransferFunction Curve() {
  return {{{-1e308, {0, 0.25F, 1}}, {0, {1, 1, 1}}, {0, {0, 0, 0}}, {1e308, {0.5F, 0.5F, 0.5F}}},
          {{-1, 0, 0.5, 0}, {7, 1, 0.001, 1}},
          kMaxOpacityDistance,
          {},
          {},
          Material{0, 1, 0.5F, 1000}};
}

Shading ManyLights() {
  Shading shading{.model = ShadingModel::kNone, .lights = {}, .ambient = 0, .diffuse = 1, .specular = 0.5F, .shininess = 1000};
  shading.occlusion_radius = 0.5F;
  for (int i = 0; i < kMaxLights; ++i) shading.lights.push_back({-1.0 * i, 1e-3, 1e3});
  return shading;
}

// A group of `ranks` slabs along z.
GroupAssignment Assignment(Rank ranks, const ViewParameters& view, const RendererKind* renderer) {
  GroupAssignment message{.epoch = kMax64, .key = {.frame = kMax64, .attempt = kMax32, .group = 3}, .finished_before = kMax64 - 1};
  message.group_count = 1024;
  message.first_group = 3;
  message.previews = message.straight8 = true;
  message.straight8_over = {0, 0.5F, 1};
  message.display = kMax32;
  FrameSetup& setup = message.setup;
  setup.dataset = kMax64;
  setup.unit = 0x1p-40;
  setup.description = Description();
  setup.range = {-1, 1e30F};
  SetRenderer(*renderer, setup);
  SetView(view, {640, 480}, setup);
  setup.transfer = Curve();
  setup.shading = ManyLights();
  if (renderer->Can(Ability::kShadows)) {
    setup.shading.shadows = 0.25F;
    setup.shading.ambient_occlusion = 1;
    setup.light = CoarserLevel{kMax64 - 7, setup.description};
    setup.light->description.geometry = LightGeometry(setup.description.geometry);
    if (ranks > 1)
      setup.light->stored = StoredAt{.source = "/data/scan.ome.zarr", .level = 5, .version = 1, .block = {{0, 0, 0}, {64, 32, 1}}};
  }
  setup.termination = 0;
  setup.halo = 16;
  const Index3 size = setup.description.geometry.size;
  for (Rank rank = 0; rank < ranks; ++rank) {
    const auto z = std::int32_t(rank);
    message.group.placements.push_back({rank, {{0, 0, z}, {size.x, size.y, z + 1}}, rank + 1});
    message.peers.push_back({rank + 1, "tcp://127.0.0.1:" + std::to_string(5000 + rank)});
  }
  if (ranks > 1) {
    setup.stored = StoredAt{.source = "/data/scan.ome.zarr?channel=1", .level = 2, .version = kMax64, .block = {{0, 0, 0}, {64, 32, 1}}};
    message.group.placements[1].filled = {{{{0, 0, 0}, {64, 32, 1}}, 5}, {{{64, 0, 1}, {kMaxVolumeSide, 32, 2}}, -1e30F}};
  }
  message.group.schedule = {ranks == 0 ? "" : "radix-k:2x3", ranks, {ranks / 2}};
  message.group.color = renderer->format() == PixelFormat::kRgba    ? ColorCoding::kFixed16
                        : renderer->format() == PixelFormat::kDepth ? ColorCoding::kStraight8
                                                                    : ColorCoding::kFloat32;
  message.peers.push_back({kMax32, kOddEndpoint});
  return message;
}

// Every third tile is hidden; the last byte of bits is used in part.
OcclusionMask Mask(std::int32_t tiles_x, std::int32_t tiles_y) {
  OcclusionMask mask{tiles_x, tiles_y, std::vector<std::uint8_t>(std::size_t(tiles_x) * std::size_t(tiles_y))};
  for (std::size_t i = 0; i < mask.steps.size(); i += 3) mask.steps[i] = kOcclusionSteps;
  return mask;
}

GroupAssignment Clipped() {
  GroupAssignment message = Assignment(2, {}, ZBuffer());
  for (std::size_t i = 0; i < kMaxClipSides; ++i) {
    message.setup.clip.sides.push_back({i % 2 == 0 ? Vec3{0.5, 0, 0} : Vec3{0, 0, -2.25}, -1e300});
  }
  message.setup.clip.mode = ClipMode::kCutAway;
  return message;
}

std::vector<Isosurface> ManySurfaces() {
  std::vector<Isosurface> surfaces;
  for (int i = 0; i < kMaxIsosurfaces; ++i) surfaces.push_back({-kMaxScalar + i * 1e299, {0, 0.5F, 1}, i % 2 == 0 ? 0.25 : 1});
  return surfaces;
}

GroupAssignment WithLayers() {
  GroupAssignment message = Assignment(2, {}, FindRenderer("raycast"));
  message.setup.cells = true;
  VolumeDescription ids = message.setup.description;
  ids.type = ScalarType::kUint64;
  const LabelLook look{.mode = LabelMode::kSurface,
                       .tint = 0,
                       .entries = {{1, {0, 0.5F, 1}, 0.25F}, {kMax64, {1, 1, 1}}},
                       .shown = {{1, 7}, {kMax64, kMax64}},
                       .hides = true,
                       .smooth = true};
  message.setup.fields = {{.levels = {{77, ids}}, .of_volume = {0}, .labels = look}};
  return message;
}

GroupAssignment OfFields() {
  GroupAssignment message = Assignment(2, {}, FindRenderer("raycast"));
  VolumeDescription other = message.setup.description;
  other.type = ScalarType::kFloat32;
  other.geometry.size = {7, 1, 65535};
  other.geometry.orientation.axes = {Vec3{0, 1, 0}, Vec3{-1, 0, 0}, Vec3{0, 0, 1}};
  message.setup.weight = 0.5;
  message.setup.flat = true;
  message.setup.fields = {{.levels = {{77, message.setup.description, StoredAt{kUmlaut, 3, kMax64, {{0, 0, 0}, {1, 2, 3}}}}},
                           .of_volume = {0},
                           .look = {.transfer = Curve(), .range = {-2, 3}, .weight = 0.125, .blend = Blend::kOver}},
                          {.levels = {{kMax64, other}}, .of_volume = {0}, .look = {.transfer = Curve(), .range = {0, 1}}}};
  message.setup.fields[0].light = message.setup.light;
  message.setup.fields[1].light = CoarserLevel{kMax64 - 3, other};
  message.setup.fields[1].light->description.geometry.size = {7, 1, 128};
  VolumeDescription bytes;
  bytes.geometry.size = {4096, 65535, 3};
  message.setup.shapes = {{.bytes = {kMax64, bytes}, .low = {-1e9, 0, 1}, .high = {1, 2, 1e9}}, {.bytes = {7, bytes}}};
  message.setup.shapes[0].look = {.coloring = ShapeColoring::kValues,
                                  .map = std::vector<Rgb>(kShapeMapColors, {1, 0.5F, 0}),
                                  .low = -1e300,
                                  .high = 1e300,
                                  .opacity = 1e-9,
                                  .width = 1e300,
                                  .width_in_pixels = true};
  return message;
}

GroupAssignment WithTiles() {
  GroupAssignment message = OfFields();
  message.key.group = message.first_group = 0;
  message.tiles = {{1, kMax32, {0, 5, 79}}, {kMax32, 2, {1}}};
  message.others = {{17, kOddEndpoint, kMax64, std::string(40, 'k')}};
  return message;
}

GroupAssignment OfLevels() {
  GroupAssignment message = Assignment(3, {}, FindRenderer("raycast"));
  FrameSetup& setup = message.setup;
  setup.stored = StoredAt{"/data/scan.ome.zarr?t=3", 1, kMax64, {{0, 0, 0}, {64, 64, 1}}};
  VolumeDescription coarser = setup.description;
  for (const Axis axis : kAxes) {
    coarser.geometry.size[axis] = (coarser.geometry.size[axis] + 1) / 2;
    coarser.geometry.orientation.origin =
        coarser.geometry.orientation.origin +
        0.5 * coarser.geometry.spacing[axis] * coarser.geometry.orientation.axes[std::size_t(Number(axis))];
    coarser.geometry.spacing[axis] *= 2;
  }
  setup.coarser = {{kMax64 - 1, coarser, setup.stored}, {1, coarser}};
  for (std::size_t rank = 0; rank < 3; ++rank) message.group.placements[rank].level = std::uint8_t(rank);
  std::swap(message.group.placements[0].filled, message.group.placements[1].filled);  // only placements of level 0 may have some
  return message;
}

GroupAssignment WithSurfaces() {
  GroupAssignment message = Assignment(2, {}, FindRenderer("raycast"));
  message.setup.transfer.isosurfaces = ManySurfaces();
  message.setup.transfer.gradient_opacities = {{0, 0}, {0, 1}, {kMaxScalar, 0.5}};
  message.setup.transfer.regions = {{{{-kMaxScalar, 0}, {1, kMaxScalar}, {0, 2}}, {1, 0, 0.5F}, 0.25, 1}};
  return message;
}

OpaqueFront Front(const FrameSetup& setup) {
  const PixelBounds frame = FrameBounds(setup);
  OpaqueFront front{.tile = FrontTile(setup)};
  front.tiles_x = (frame.width() - 1) / front.tile + 1;
  front.tiles_y = (frame.height() - 1) / front.tile + 1;
  front.unit = 3;
  front.tiles.resize(std::size_t(front.tiles_x) * std::size_t(front.tiles_y), {0, 1, 2, 3, 100, 200, 254, OpaqueFront::kNever});
  return front;
}

GroupAssignment BehindOthers() {
  GroupAssignment message = Assignment(2, {}, Splatting());
  message.setup.termination = 0.5;
  message.hidden = Mask(OcclusionTiles(message.setup.sheets.width), OcclusionTiles(message.setup.sheets.height));
  message.setup.front = Front(message.setup);
  message.pictures = PicturesAddress{kLongEndpoint, kKey};
  return message;
}

EncodedRuns NoRuns() { return {{PixelFormat::kRgba, {}, 0, 0}, Codec::kRaw, 0, kMax64}; }
EncodedRuns SomeRuns() { return {{PixelFormat::kRgbaDepth, {1, 2, 30, 40}, 7, 900}, Codec::kZstd, 12 * 7 + 20 * 900, 1}; }

EncodedRuns StraightRuns() {
  EncodedRuns runs = SomeRuns();
  runs.image.format = PixelFormat::kRgba;
  runs.image.color = ColorCoding::kStraight8;
  runs.encoded_bytes = 12 * 7 + 4 * 900;
  return runs;
}

constexpr Box kWholeBox = {{0, 0, 0}, {kMaxVolumeSide, kMaxVolumeSide, kMaxVolumeSide}};
constexpr Box kOneVoxel = {{9, 8, 7}, {10, 9, 8}};

FrameRequest Request() {
  FrameRequest request;
  request.dataset = "brain";
  return request;
}

// Without a specialisation for each member of AnyMessage, AllSamples does not compile.
template <class Message>
std::vector<Message> SamplesOf() = delete;

template <>
std::vector<Register> SamplesOf() {
  return {{1, 2, "host", "tcp://127.0.0.1:1", 1, 0},
          {kMax64, kMax32, kLongName, kLongEndpoint, kMaxThreads, kMax64, kMax64, true, kKey},
          {0, 0, kUmlaut, kOddEndpoint}};
}

template <>
std::vector<Welcome> SamplesOf() {
  return {{1, 2, 3, "inproc://slabs", 10, 100}, {kMax64, kMax64, kMax32, kLongEndpoint, 60000, 600000}};
}

template <>
std::vector<Heartbeat> SamplesOf() {
  return {{}, {kMax64, kMax64, kMax32, kMax64, kMax64, kMax32, true, SampleTraffic()}};
}

template <>
std::vector<Ping> SamplesOf() {
  return {{}, {kMax64, kMax64, {0, 1, kMax64}, {kMax32, kMax32}, {1, kMax32}}};
}

template <>
std::vector<GroupAssignment> SamplesOf() {
  const ViewParameters oblique{Projection::kPerspective, 1e6, -33, 12.5, 0.01, 60};
  return {Assignment(3, {}, Splatting()),
          Assignment(0, oblique, ZBuffer()),
          Assignment(16, oblique, Splatting()),
          BehindOthers(),
          Clipped(),
          WithSurfaces(),
          WithLayers(),
          OfFields(),
          WithTiles(),
          OfLevels()};
}

template <>
std::vector<GroupDone> SamplesOf() {
  return {{1, 2, {3, 4, 1023}, {}, {}},
          {kMax64, kMax32, {}, {RankReport{}, FullReport()}, Mask(5, 3)},
          {1, 1, {}, {}, Mask(kMaxOcclusionTiles, 1)}};
}

template <>
std::vector<FrameImage> SamplesOf() {
  return {{1, 2, 3, 4, 0, 1, {NoRuns()}, {}},
          {kMax64, kMax32, kMax64, kMax32, 1024, 1024, {SomeRuns()}, {FullReport()}, kMaxShares - 1, kMaxShares},
          {1, 2, 3, 4, 1, 1, {SomeRuns(), true}, {}, 0, 2}};
}

template <>
std::vector<WorkerTrouble> SamplesOf() {
  return {{1, 2, {3, 4, 5}, 0, Status::Internal("")}, {kMax64, kMax32, {}, kMax32, Status::InvalidArgument(kLongText), true}};
}

template <>
std::vector<Leave> SamplesOf() {
  return {{}, {kMax64, kMax32}};
}

template <>
std::vector<Retire> SamplesOf() {
  return {{}, {kMax64}};
}

template <>
std::vector<Stop> SamplesOf() {
  return {{}, {kMax64}};
}

template <>
std::vector<RegisterOwner> SamplesOf() {
  return {{.dataset = "rho",
           .description = Description(),
           .samples = "uint16",
           .steered = {{"feed", 0, 0.1, 0.03}, {std::string(64, '_'), -1e300, 1e300, 1e300}, {"K2", 1, 1, 1}},
           .fields = {"density", std::string(64, 'f')}},
          {.dataset = "rho", .owner = 3, .owners = 5, .description = Description(), .samples = "uint16", .fields = {"u", "v"}, .field = 1},
          {kMax64,
           kLongName,
           4095,
           4096,
           RectilinearDescription(),
           std::string(16, 's'),
           {kOneVoxel, kWholeBox},
           kMax64,
           kMax32,
           kMax32,
           {},
           true}};
}

template <>
std::vector<OwnerWelcome> SamplesOf() {
  return {{1, 2}, {kMax64, kMax64, 60000, 600000}};
}

template <>
std::vector<OwnerTime> SamplesOf() {
  return {{1, 1, 0}, {kMax64, kMax64, -1e300}};
}

template <>
std::vector<OwnerPing> SamplesOf() {
  return {{}, {kMax64, kMax64, kMax64, kMax64, true}};
}

template <>
std::vector<OwnerPong> SamplesOf() {
  return {{}, {kMax64, kMax64, true, std::vector<std::uint64_t>(64, kMax64), kMax64}};
}

template <>
std::vector<OwnerLeave> SamplesOf() {
  return {{}, {kMax64}};
}

template <>
std::vector<OwnerRefused> SamplesOf() {
  return {{1, Status::InvalidArgument("owner 3 of 8")}, {kMax64, Status::Cancelled(kLongText)}};
}

template <>
std::vector<OwnerSteered> SamplesOf() {
  return {{1, {0.5}}, {kMax64, std::vector<double>(64, -1e300)}};
}

template <>
std::vector<ChunkRequest> SamplesOf() {
  return {{1, 2, 3, kOneVoxel, 0},
          {kMax64, kMax32, kMax32, kWholeBox, ChunkCount(kWholeBox, ScalarType::kFloat32) - 1, 16, true},
          {1, 2, 3, kOneVoxel, kFirstCellChunk}};
}

template <>
std::vector<Chunk> SamplesOf() {
  return {{1, 2, kOneVoxel, 0, Codec::kRaw, 1, 1, 0},
          {1, 2, kOneVoxel, 0, Codec::kRaw, 0, 0, 0},
          {kMax64, kMax32, kWholeBox, 1, Codec::kZstd, kChunkBytes, 9, kMax64},
          {1, 2, kOneVoxel, kFirstCellChunk + 2, Codec::kZstd, 5, 4, 0, 2 * kChunkBytes + 5}};
}

template <>
std::vector<ChunkRefused> SamplesOf() {
  return {{1, 2, kOneVoxel, 0, Status::NotFound("no dataset 2")}, {kMax64, kMax64, kWholeBox, 5, Status::Cancelled(kLongText)}};
}

template <>
std::vector<PartialImage> SamplesOf() {
  return {{1, 2, {3, 4, 5}, 0, {0, 1}, {0, 0}, NoRuns().image, {}, {}, 0, {}},
          {kMax64,
           kMax32,
           {},
           1U << 20U,
           {65535, 65536},
           {17, std::uint64_t{1} << 48U},
           {PixelFormat::kDepth, {1, 2, 30, 40}, 7, 900},
           {},
           PackedRuns{Codec::kZstd, 7 * 12 + 900 * 24 - 1, kMax64},
           kMax64,
           {RankReport{}, FullReport()}},
          {1, 2, {3, 4, 5}, 0, {0, 1}, {0, 9}, {PixelFormat::kDepth, {1, 2, 30, 40}, 7, 900, ColorCoding::kStraight8}, {}, {}, 0, {}},
          {1,
           2,
           {3, 4, 5},
           0,
           {0, 1},
           {0, 0},
           {.format = PixelFormat::kDepth},
           SharedImage{{kMax64, kMax32, kMax32},
                       {0, 0, 1 << 24, 1},
                       1U << 24U,
                       std::uint64_t{1} << 48U,
                       {{kArenaBytes, kMax64, kArenaSlots - 1}, {0, 1, 0}, {4096, 1, 1}}},
           {},
           1,
           {}}};
}

template <>
std::vector<ImageRefused> SamplesOf() {
  return {{}, {kMax64, kMax32, {3, 4, 5}, 1U << 20U, {17, std::uint64_t{1} << 48U}}};
}

template <>
std::vector<ImageReceived> SamplesOf() {
  return {{}, {kMax64, kMax32, kMax64}};
}

template <>
std::vector<ShapeTiles> SamplesOf() {
  return {{1, 2, {3, 4, 5}, {0}, {0}}, {kMax64, kMax32, {3, 4, 5}, {0, 7, kMax32}, {8, 0, 1U << 30U}}};
}

template <>
std::vector<SentPicture> SamplesOf() {
  return {{}, {kMax64, kMaxRunsBytes}};
}

template <>
std::vector<SubmitFrame> SamplesOf() {
  FrameRequest full;
  full.dataset = kLongName;
  full.renderer = "mip";
  full.parameters = {{"projection-mode", "minimum"}};
  full.size = {kMaxImageSide, 1};
  full.view = {Projection::kPerspective, kMaxAngleDegrees, -kMaxAngleDegrees, -0.0, kMinZoom, kMinFovDegrees};
  full.clipping = {.box = ClipBox{{-kMaxCoordinate, -1, 0}, {-1e8, 0, 1e-3}, ClipUnit::kPercent},
                   .slab = ClipSlab{.normal = {-1, 1e-3, 0}, .through = {}, .index = kMaxVolumeSide - 1, .thickness = kMaxCoordinate},
                   .planes = std::vector<ClipPlane>(kMaxClipPlanes, {{0, -1, 1e9}, -1e18}),
                   .mode = ClipMode::kCutAway};
  full.transfer = {Curve(), 1e-6, ScalarRange{-1e300, 1e-300}};
  full.shading = ManyLights();
  full.termination = 0.5;
  full.policy = {kUmlaut, kLongName, AxisChoice::kX, kMaxGroups, kUmlaut, kLongName, kLongName, kMaxPixelError, kMaxTeams};
  full.previews = full.straight8 = full.key = true;
  full.straight8_over = {1, 0.5F, 0};
  FrameRequest sliced = Request();
  sliced.clipping.slab = ClipSlab{.through = Vec3{1, -2, 3e8}};
  FrameRequest surfaces = Request();
  surfaces.renderer = "raycast";
  surfaces.transfer.scalar_range = ScalarRange{0, 100, true};
  surfaces.transfer.isosurfaces = ManySurfaces();
  surfaces.transfer.gradient_opacities = {{1e-3, 0.5}, {7, 0}};
  FrameRequest layers = Request();
  layers.renderer = "raycast";
  layers.fields = {{.field = "overlay", .choice = "grayscale", .scalar_range = ScalarRange{-1, 2}, .weight = 0.5}};
  ShownLabels(layers) = {.mode = LabelMode::kSurface,
                         .tint = 1,
                         .opacities = {{1, 0}, {kMax64, 0.25}},
                         .shown = {{1, kMax64}, {7, 7}, {.name = kUmlaut}},
                         .surface = LabelSurface::kSmooth};
  FrameRequest channels = Request();
  channels.channels = {"0", kUmlaut};
  channels.fields = {
      {.field = kUmlaut, .shown = true, .color = Rgb{1, 0.5F, 0}, .scalar_range = ScalarRange{2, 98, true}, .gamma = 0.01, .weight = 0},
      {.field = "7", .shown = false, .choice = Curve()}};
  channels.blend = Blend::kMax;
  channels.time = "3.5s";
  FrameRequest shapes = Request();
  shapes.shapes = {{.shape = kLongName, .color = Rgb{1, 0.5F, 0}, .opacity = 1e-3, .width = 1e300, .width_in_pixels = true},
                   {.shape = kUmlaut, .map = "plasma", .range = ScalarRange{-1e300, 1e300}}};
  FrameRequest unstated = Request();
  unstated.view = kUnstatedView;
  FrameRequest highlights = layers;
  ShownLabels(highlights).mode = LabelMode::kHighlight;
  return {{0, 1, Request()}, {kMax64, 86400000, full, PicturesDoor{65535, kKey}},
          {1, 2, sliced},    {1, 2, surfaces},
          {1, 2, layers},    {1, 2, highlights},
          {1, 2, unstated},  {1, 2, channels},
          {1, 2, shapes}};
}

template <>
std::vector<FrameProgress> SamplesOf() {
  return {{}, {kMax64, FramePhase::kRunning, kMax32, 1024, 1024, kMax32, kMax32}, {1, FramePhase::kLoading, 0, 0, 7, 1, 2, 100, kMax64}};
}

template <>
std::vector<FrameReply> SamplesOf() {
  const FrameStatistics statistics{kMax32,    kMax32,  kMax32,    "shear",   "slab",   "occupied", "x",
                                   kLongName, kUmlaut, kLongName, -kMaxTime, kMaxTime, kMaxTime,   {FullReport()}};
  FrameStatistics whole = statistics;
  whole.levels = {{0, 1, 1}, {kMaxLevels - 1, kMax32, kMax64}};
  whole.lowered = kUmlaut;
  whole.missing = kUmlaut;
  whole.view = Request().view;
  const PictureGeometry of_patient{World::kPatient,
                                   LengthUnit::kMillimetre,
                                   Projection::kPerspective,
                                   {0, -1, 0},
                                   {0.6, 0, 0.8},
                                   {0.8, 0, -0.6},
                                   {-1e9, 0.5, 1e300},
                                   1e-300,
                                   1e300};
  const PictureGeometry behind_the_eye_plane{
      World::kScene, LengthUnit::kFile, Projection::kOrthographic, {1, 0, 0}, {0, 1, 0}, {0, 0, -1}, {}, -7.5, 0.25};
  PictureGeometry in_metres = of_patient;
  in_metres.unit = LengthUnit::kMetre;
  const PictureKey key = {{{kUmlaut, {{-1e300, {0, 0, 0}}, {7, {1, 0.5F, 0}}, {7, {0, 1, 1}}}}, {kLongName, {{0, {}}, {1, {1, 1, 1}}}}},
                          {{kUmlaut, {1, 0, 0.25F}}}};
  return {{1, {1, 1}, 0, 1, {{NoRuns()}}, {}, {}, {}},
          {kMax64, {30, 40}, 1024, 1024, {{SomeRuns()}}, statistics, of_patient, key},
          {kMax64, {30, 40}, 1024, 1024, {{StraightRuns()}}, statistics, of_patient, {}},
          {kMax64, {30, 40}, 1024, 1024, {{SomeRuns()}, {SomeRuns(), true}}, whole, behind_the_eye_plane, {}},
          {kMax64, {30, 40}, 1024, 1024, std::vector<PictureShare>(kMaxShares, {SomeRuns(), true}), whole, in_metres, {}}};
}

template <>
std::vector<FrameFailed> SamplesOf() {
  return {{1, Status::DeadlineExceeded("")},
          {kMax64, Status::DataLoss(kUmlaut)},
          {2, Status::Unavailable("x")},
          {3, Status::ResourceExhausted("y")}};
}

template <>
std::vector<CancelFrame> SamplesOf() {
  return {{}, {kMax64}};
}

template <>
std::vector<ClientPing> SamplesOf() {
  return {{}, {kMax64, {0, kMax64}, kMax64, kMax64, {kMax64, 0}}};
}

template <>
std::vector<ClientPong> SamplesOf() {
  return {{}, {kMax64, kMax64, {kMax64, 0}, PictureSenders{kMax64, {kKey, kKey}}, {0, kMax64}}, {1, 2, {}, PictureSenders{}}};
}

template <>
std::vector<StatusQuery> SamplesOf() {
  return {{}, {kMax64}};
}

template <>
std::vector<StatusReply> SamplesOf() {
  StatusReply full{kMax64, kMax64, kMax32, kMax64, kMax32, kMax32, kMax32, kMax64, kMax64, kMax64, {}, {}};
  full.workers = {{1, 2, "", 1, 0, 0, 0, 0, 0}, {kMax32, kMax32, kLongName, kMaxThreads, kMax32, kMax64, kMax64, kMax32, kMax32, true}};
  full.datasets = {{"a", DatasetState::kUnloaded, {}, {}, ""},
                   {kLongName, DatasetState::kLoading, {}, {}, ""},
                   {kUmlaut, DatasetState::kReady, Description(), {-3, 4}, ""},
                   {"b", DatasetState::kFailed, {}, {}, kLongText, 0, kMax64}};
  full.datasets[2].levels = {Description(), RectilinearDescription()};
  full.datasets[2].fields = DatasetFields{.fields = {{.name = kUmlaut, .color = std::array{1.0F, 0.5F, 0.0F}, .window = ValueRange{-1, 2}},
                                                     {.shown = false},
                                                     {.channel = false}},
                                          .times = {.count = 50, .step = 0.25, .unit = "min"},
                                          .field = 2,
                                          .time = 49};
  full.datasets.push_back({"c", DatasetState::kReady, Description()});
  full.datasets.back().is_shape = true;
  full.datasets.back().shape = ShapeInfo{ShapeKind::kLines, kMax64, 7, {-1e300, 0, 1}, {1, 2, 1e300}, true, true, true, -1e30F, 1e30F};
  full.refused = {kMax64, kMax64 - 1, kMax64 - 2, 1};
  full.web = SampleTraffic();
  full.renderers = {{"a", "", {}, {}}, {kLongName, kUmlaut, {"labels", "x"}, {"kernel"}}};
  return {{}, full};
}

template <>
std::vector<ShutDown> SamplesOf() {
  return {{}, {kMax64}};
}

template <>
std::vector<ShutDownReply> SamplesOf() {
  return {{}, {kMax64}};
}

template <>
std::vector<KeysOrder> SamplesOf() {
  return {{},
          {kMax64, KeysAction::kRotate, Role::kAdmin, ""},
          {1, KeysAction::kRevoke, Role::kClient, std::string(kKeyTextBytes, 'a')},
          {1, KeysAction::kRevoke, Role::kClient, ""},
          {1, KeysAction::kIssue, Role::kAdmin, std::string(kKeyTextBytes, 'a'), "Zo\u00eb"}};
}

template <>
std::vector<KeysReply> SamplesOf() {
  return {{},
          {kMax64,
           {{std::string(kKeyTextBytes, 'a'), Role::kWorker, "2026-11-21T10:00:00Z"},
            {std::string(kKeyTextBytes, 'b'), Role::kAdmin, "", kUmlaut, kMax64}}}};
}

template <>
std::vector<OrderRefused> SamplesOf() {
  return {{}, {kMax64, Status::InvalidArgument("ending the service needs an admin's key")}};
}

template <>
std::vector<DataOrder> SamplesOf() {
  return {{},
          {kMax64, DataAction::kAdd, {"head=/data/head.nrrd", std::string(kMaxDataItemBytes, '/'), "\xff"}},
          {1, DataAction::kRemove, std::vector<std::string>(kMaxDataItems, "a")},
          {1, DataAction::kReload, {kUmlaut}}};
}

template <>
std::vector<DataReply> SamplesOf() {
  return {{},
          {kMax64,
           {{kUmlaut, DatasetState::kReady, Description(), {-3, 4}, "", kMax64, kMax64},
            {"b", DatasetState::kLoading, {}, {}, "", 0, 0, 0, {}, {}, SimulationStatus{7, 0.5, {{"feed", 0, 0.1, 0.03}}}}}}};
}

template <>
std::vector<SteerDataset> SamplesOf() {
  return {{1, "rho", {{"feed", 0.03}}}, {kMax64, kLongName, std::vector<SteeredValue>(64, {std::string(64, 'k'), -1e300})}};
}

template <>
std::vector<SteerReply> SamplesOf() {
  return {{}, {kMax64, {kMax64, -1e300, {{"feed", 0, 0.1, 0.03}}}}};
}

template <>
std::vector<SummaryQuery> SamplesOf() {
  return {{.dataset = "a", .transfer = {}},
          {kMax64, kLongName, {Curve(), 1e-6, ScalarRange{0, 100, true}}},
          {.dataset = "a", .transfer = {}, .field = kUmlaut, .time = "last", .looks = {{.field = "0", .gamma = 100}}, .flat = true}};
}

template <>
std::vector<SummaryReply> SamplesOf() {
  const TransferFunction flat{.colors = {{0, {1, 1, 1}}}, .opacities = {{0, 0.5}}};
  return {{.description = Description(), .range = {}, .percentiles = {}, .transfer = flat, .labels = {}},
          {kMax64,
           Description(),
           {-1e30F, 1e30F},
           std::vector<std::uint64_t>(kHistogramBins, kMax64),
           kMax64,
           std::vector<Percentile>(kMaxPercentiles, {100, -1e300}),
           Curve(),
           {{1, {0, 0.5F, 1}, std::string(kMaxLabelNameBytes, 'n')}, {kMax64, {}, ""}},
           true}};
}

template <>
std::vector<SampleQuery> SamplesOf() {
  return {{.dataset = "a", .points = {{}}}, {kMax64, kLongName, std::vector<Vec3>(50, {1e300, -1, 0}), {kUmlaut, "2"}}};
}

template <>
std::vector<SampleReply> SamplesOf() {
  const VolumeSample full{{-1e9, 0, 1},
                          true,
                          {kMaxVolumeSide, 0, 1},
                          1e300,
                          LabelAt{kMax64, std::string(kMaxLabelNameBytes, 'n')},
                          {{kUmlaut, -2.5}, {kLongName}},
                          1e-300};
  return {{}, {kMax64, {full, {.at = {1, 2, 3}}, {.at = {}, .inside = true, .value = 0x1p60, .label = LabelAt{}, .rest = -1}}}};
}

template <>
std::vector<StatisticsQuery> SamplesOf() {
  return {{.dataset = "a", .box = {{}, {1, 1, 1}}}, {kMax64, kLongName, {{-1e9, 0, 1}, {1e9, 0.5, 2}, ClipUnit::kPercent}, true}};
}

template <>
std::vector<StatisticsReply> SamplesOf() {
  const BoxStatistics full = {kMax64, kMax64, -1e300, 1e300, -1e300, 1e300};
  const Label first{1, {1, 0, 0.5F}, "left"}, last{kMax64, {}, std::string(kMaxLabelNameBytes, 'n')};
  return {{.statistics = {}, .description = Description()}, {kMax64, full, Description(), {{first, {}}, {last, full}}}};
}

std::vector<std::uint64_t> LargeCounts() {
  std::vector<std::uint64_t> counts(std::size_t{kJointValues} * kJointSlopes);
  counts.front() = counts.back() = kMax64;
  return counts;
}

template <>
std::vector<JointHistogramQuery> SamplesOf() {
  return {{.dataset = "a"}, {kMax64, kLongName}};
}

template <>
std::vector<JointHistogramReply> SamplesOf() {
  return {{}, {kMax64, {-1e30F, 1e30F}, {1e300, LargeCounts()}}};
}

template <>
std::vector<PickQuery> SamplesOf() {
  FrameRequest request = Request();
  return {{.frame = request}, {kMax64, request, double(request.size.width), 0.5}};
}

template <>
std::vector<PickReply> SamplesOf() {
  return {{},
          {kMax64, VolumeSample{.at = {1, 2, 3}, .inside = true, .voxel = {1, 2, 3}, .value = 4}, -1e300},
          {kMax64, VolumeSample{.at = {1, 2, 3}}, 1, kMaxShownShapes + kMaxPlanes - 1, -1e300},
          {.sample = VolumeSample{}, .shape = 0}};
}

template <>
std::vector<ViewQuery> SamplesOf() {
  return {{.frame = Request()},
          {kMax64, Request(), Ball{{-1e9, 0.5, 1e300}, 1e-300}, {{-1e6, Request().view}, {7, kUnstatedView}}, {-0.5, 7}}};
}

template <>
std::vector<ViewReply> SamplesOf() {
  return {{}, {kMax64, Request().view, Ball{{1, 2, 3}, 4}, {Request().view}}, {.view = kUnstatedView}};
}

template <>
std::vector<AddVolume> SamplesOf() {
  return {{.name = "a", .description = Description(), .labels = {}},
          {kMax64,
           kLongName,
           Description(),
           {{1, "", {}}, {kMax64, std::string(kMaxLabelNameBytes, 'n'), std::array<float, 3>{0, 0.5F, 1}}},
           {},
           2,
           true},
          {.name = "a", .description = {}, .labels = {}, .file = SentFile{"a.nii.gz", kMaxSentFileBytes}}};
}

template <>
std::vector<VolumeCredit> SamplesOf() {
  return {{}, {kMax64, kMax64 - 1, kMax64}};
}

template <>
std::vector<VolumePart> SamplesOf() {
  return {{}, {kMax64, kMax64, kMaxVolumePartBytes}};
}

template <>
std::vector<DropVolume> SamplesOf() {
  return {{}, {kMax64}};
}

template <std::size_t... I>
std::vector<AnyMessage> AllSamplesOf(std::index_sequence<I...>) {
  std::vector<AnyMessage> all;
  const auto add = [&all](auto samples) { all.insert(all.end(), samples.begin(), samples.end()); };
  (add(SamplesOf<std::variant_alternative_t<I, AnyMessage>>()), ...);
  return all;
}

}  // namespace

std::vector<AnyMessage> AllSamples() { return AllSamplesOf(std::make_index_sequence<std::variant_size_v<AnyMessage>>()); }

}  // namespace slabstream
