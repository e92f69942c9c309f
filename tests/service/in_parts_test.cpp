// Volumes that nobody holds: pictures of voxels that are read in parts, and of levels, are those of the same voxels in memory.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>

#include "client/embedded/embedded_service.h"
#include "data/catalogue/catalogue.h"
#include "data/open/open_source.h"
#include "data/open/read_volume.h"
#include "data/open/unchanged_source.h"
#include "data/survey/index_file.h"
#include "data/survey/make_index.h"
#include "data/survey/survey.h"
#include "tests/data/mosaic/amrex_files.h"
#include "tests/data/volume_io/more_files.h"
#include "tests/data/volume_io/volume_files.h"
#include "tests/data/volume_io/vtu_files.h"
#include "tests/service/pictures.h"
#include "tests/service/small_shards.h"
#include "tests/support/random_volume.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/whole_file.h"

namespace slabstream {
namespace {

namespace fs = std::filesystem;
using std::chrono::seconds;
using testing::HasSubstr;

class InPartsTest : public testing::Test {
 protected:
  // One that holds no level of the ball but perhaps the coarsest ones.
  void Start(const std::string& path, int workers = 2, std::uint64_t memory_bytes = std::uint64_t{512} << 10,
             std::uint64_t worker_bytes = 0) {
    EmbeddedOptions options;
    options.workers = workers;
    options.worker.memory_bytes = worker_bytes;
    options.coordinator.catalogue["ball"] = DataSource(path, "");
    options.coordinator.machine.memory_bytes = memory_bytes;
    auto started = EmbeddedService::Start(context_, std::move(options));
    ASSERT_TRUE(started.ok()) << started.status().message();
    service_ = std::move(*started);
    client_.emplace(service_->Connect().value());
  }
  // As it is in memory.
  std::string Nrrd(const Volume& volume) const {
    const std::string path = (directory_ / "ball.nrrd").string();
    const Index3& size = volume.description.geometry.size;
    std::ofstream file(path, std::ios::binary);
    file << "NRRD0004\ntype: uint8\ndimension: 3\nsizes: " << size.x << ' ' << size.y << ' ' << size.z << "\nencoding: raw\n\n";
    file.write(reinterpret_cast<const char*>(volume.block.bytes.data()), std::streamsize(volume.block.bytes.size()));
    return path;
  }
  std::string Zarr(const std::shared_ptr<const Volume>& volume) const {
    const std::string path = (directory_ / "ball.ome.zarr").string();
    WriteSmallShards(volume, path);
    return path;
  }
  static std::shared_ptr<const Volume> Level(const std::string& path, int level) {
    const std::shared_ptr<VolumeSource> source = OpenSource(path, {}, ProcessReadContext()).value();
    return source->ReadLevel(level).value().volume;
  }
  Result<Picture> Render(const FrameRequest& request) { return client_->Render(request, seconds(60)); }
  void ExpectPictureOf(const FrameRequest& request, const Volume& volume) { Expect(request, RenderDirectly(request, volume), 0); }
  // `same`: what asks for the same picture of this level. Statistics of a level are those of the finest one.
  void ExpectPictureOfLevel(const FrameRequest& request, const Volume& level, const FrameRequest& same, const Volume& finest) {
    VolumeSummary summary = Summarize(level);
    const VolumeSummary of_finest = Summarize(finest);
    summary.range = of_finest.range;
    summary.histogram = of_finest.histogram;
    constexpr float kRounding = 1e-6F;
    Expect(request, RenderDirectly(same, level, summary), kRounding);
  }
  void Expect(const FrameRequest& request, const PictureImage& expected, float rounding) {
    const Result<Picture> picture = Render(request);
    ASSERT_TRUE(picture.ok()) << picture.status().message();
    EXPECT_GT(HighestAlpha(picture->image), 0.1);
    EXPECT_LE(LargestDifference(picture->image, expected, request.size), AllowedDifference(request) + rounding);
  }
  void ExpectNothingHeld() {
    const Result<StatusReply> status = client_->QueryStatus(seconds(30));
    ASSERT_TRUE(status.ok()) << status.status().message();
    EXPECT_EQ(status->datasets.at(0).state, DatasetState::kReady);
    EXPECT_EQ(status->datasets.at(0).memory_bytes, 0U);
  }

  // Views that reach for other voxels each.
  static std::vector<FrameRequest> RequestsFor(const RendererKind* renderer) {
    std::vector<FrameRequest> requests(5, TestRequest(renderer, 30, 3));
    if (renderer->Can(Ability::kPerspective)) requests[1].view.projection = Projection::kPerspective;
    requests[1].policy.decomposition = "subcube";
    requests[2].clipping.box = ClipBox{{10, 20, 30}, {70, 100, 75}, ClipUnit::kVoxels};
    requests[3].view.azimuth_degrees = 200;
    requests[3].view.zoom = 3;
    requests[3].policy.groups = 0;
    requests[4].view.zoom = 6;  // most of the volume lies outside
    requests[4].view.elevation_degrees = 50;
    return requests;
  }
  static std::vector<const RendererKind*> VoxelRenderers() {
    std::vector<const RendererKind*> renderers;
    for (const RendererKind* renderer : Renderers()) {
      if (!renderer->Can(Ability::kCells)) renderers.push_back(renderer);
    }
    return renderers;
  }

  TemporaryDirectory temporary_;
  const fs::path directory_ = temporary_.path();
  const std::shared_ptr<const Volume> ball_ = TestSphere(100);
  Context context_;
  std::unique_ptr<EmbeddedService> service_;
  std::optional<Client> client_;
};

// ---------------------------------------------------------------- one level

TEST_F(InPartsTest, PicturesAreThoseOfVoxelsInMemory) {
  for (const std::string& path : {Nrrd(*ball_), Zarr(ball_)}) {
    Start(path);
    for (const RendererKind* renderer : VoxelRenderers()) {
      for (FrameRequest& request : RequestsFor(renderer)) {
        SCOPED_TRACE(testing::Message() << path << ", renderer " << renderer->name() << ", azimuth "
                                        << request.view.azimuth_degrees.value_or(0));
        request.level = "0";
        ExpectPictureOf(request, *ball_);
      }
    }
    ExpectNothingHeld();
  }
}

// However much memory it has: most voxels of a fine level would be interpolated.
TEST_F(InPartsTest, NoLevelOfAnAdaptiveMeshIsHeld) {
  const AmrexSpec mesh = {.first = {0, 0, 0},
                          .size = Uniform(16),
                          .levels = {{1, {{{0, 0, 0}, Uniform(16)}}}, {2, {{Uniform(8), Uniform(24)}}}, {4, {{Uniform(24), Uniform(40)}}}}};
  const std::string path = directory_ / "plt";
  WritePlotfile(path, mesh, [](const Vec3& place) { return std::max(0.0, 250 - 30 * Length(place - Vec3{8, 8, 8})); });
  for (const std::uint64_t memory_bytes : {std::uint64_t{0}, std::uint64_t{1} << 30}) {
    Start(path + "?array=v", 2, memory_bytes);
    for (const RendererKind* renderer : VoxelRenderers()) {
      for (const std::string& level : {std::string(kAutomatic), std::string("0"), std::string("2")}) {
        FrameRequest request = TestRequest(renderer, 30, 3);
        request.level = level;
        const Result<Picture> picture = Render(request);
        ASSERT_TRUE(picture.ok()) << picture.status().message();
        EXPECT_GT(HighestAlpha(picture->image), 0.1) << renderer->name() << " at level " << level;
      }
    }
    ExpectNothingHeld();
  }
}

TEST_F(InPartsTest, PiecesThatDoNotFitAreNotHeld) {
  const Index3 size = ball_->description.geometry.size;
  const auto* const samples = reinterpret_cast<const char*>(ball_->block.bytes.data());
  const auto extent = [&](int begin, int end) { return fmt::format("0 {} 0 {} {} {}", size.x - 1, size.y - 1, begin, end - 1); };
  std::string pieces;
  for (const auto& [begin, end] : {std::pair{0, 41}, {41, size.z}}) {
    const FileBytes bytes(samples + CountIn({size.x, size.y, begin}), CountIn({size.x, size.y, end - begin}));
    const FileSpec spec = {.size = {size.x, size.y, end - begin}, .type = SampleType::kUint8};
    WriteFile(directory_ / fmt::format("{}.vti", begin), VtiFile(spec, bytes, {.extent = extent(begin, end)}));
    pieces += fmt::format("<Piece Extent=\"{}\" Source=\"{}.vti\"/>", extent(begin, end), begin);
  }
  const std::string path = directory_ / "ball.pvti";
  WriteFile(path, fmt::format("<VTKFile type=\"PImageData\" byte_order=\"LittleEndian\"><PImageData WholeExtent=\"{}\" Spacing=\"1 1 1\">"
                              "<PPointData><PDataArray type=\"UInt8\" Name=\"density\"/></PPointData>{}</PImageData></VTKFile>",
                              extent(0, size.z), pieces));
  Start(path);
  for (const RendererKind* renderer : VoxelRenderers()) {
    for (const FrameRequest& request : RequestsFor(renderer)) ExpectPictureOf(request, *ball_);
  }
  ExpectNothingHeld();
}

// The light volume is a level, which workers read, or which the coordinator holds.
TEST_F(InPartsTest, ShadowsAreThoseOfVoxelsInMemory) {
  const std::shared_ptr<const Volume> ball = TestSphere(150);
  const std::string path = Zarr(ball);
  const auto shaded = [](const RendererKind* renderer) {
    FrameRequest request = TestRequest(renderer, 30, 3);
    request.level = "0";
    request.shading.shadows = request.shading.ambient_occlusion = 1;
    return request;
  };
  std::vector<Picture> held;
  Start(path, 2, 0);
  for (const RendererKind* renderer : VoxelRenderers()) {
    if (!renderer->Can(Ability::kShadows)) continue;
    Result<Picture> picture = Render(shaded(renderer));
    ASSERT_TRUE(picture.ok()) << picture.status().message();
    held.push_back(*std::move(picture));
  }
  Start(path);
  auto expected = held.begin();
  for (const RendererKind* renderer : VoxelRenderers()) {
    if (!renderer->Can(Ability::kShadows)) continue;
    const FrameRequest request = shaded(renderer);
    const Result<Picture> picture = Render(request);
    ASSERT_TRUE(picture.ok()) << picture.status().message();
    EXPECT_LE(LargestDifference(picture->image, (expected++)->image, request.size), AllowedDifference(request)) << renderer->name();
  }
}

TEST_F(InPartsTest, ShadowsOfAVolumeWithoutACoarseLevelAreRefusedInOneLine) {
  const std::shared_ptr<const Volume> ball = TestSphere(150);
  Start(Nrrd(*ball));
  FrameRequest request = TestRequest(Splatting(), 30, 3);
  request.shading.shadows = 1;
  const Result<Picture> picture = Render(request);
  ASSERT_FALSE(picture.ok());
  EXPECT_THAT(picture.status().message(), HasSubstr("at most 128 voxels a side, and its coarsest one has 150 x 150 x 150"));
}

// ---------------------------------------------------------------- compressed streams

class StreamsInPartsTest : public InPartsTest {
 protected:
  StreamsInPartsTest() { ::setenv("XDG_CACHE_HOME", (directory_ / "cache").c_str(), 1); }

  // The ball as a compressed stream: a file for each format.
  std::vector<std::string> Streams() const {
    const auto* const bytes = reinterpret_cast<const char*>(ball_->block.bytes.data());
    const FileBytes samples(bytes, ball_->block.bytes.size()), zlib = Zlib(samples);
    const FileSpec spec{.size = ball_->description.geometry.size, .spacing = {1, 1, 1}};
    const std::pair<std::string, FileBytes> files[] = {{"ball.nii.gz", Gzip(NiftiHeader(spec) + samples)},
                                                       {"ball.nrrd", NrrdHeader(spec, "gzip") + Gzip(samples)},
                                                       {"ball.mha", MetaHeader(spec, "LOCAL", std::int64_t(zlib.size())) + zlib}};
    std::vector<std::string> paths;
    for (const auto& [name, file] : files) {
      paths.push_back((directory_ / name).string());
      WriteFile(paths.back(), file);
    }
    return paths;
  }
  fs::path StoreOf(const std::string& path) const {
    for (const auto& each : fs::directory_iterator(directory_ / "cache/slabstream/streams")) {
      if (each.is_directory() && each.path().filename().string().starts_with(fs::path(path).stem().stem().string())) return each.path();
    }
    return {};
  }
};

TEST_F(StreamsInPartsTest, PicturesAreThoseOfVoxelsInMemory) {
  for (const std::string& path : Streams()) {
    const Volume whole = *ReadVolume(path)->volume;
    ASSERT_EQ(whole.block.bytes, ball_->block.bytes);
    for (const bool first : {true, false}) {
      Start(path);
      for (const RendererKind* renderer : VoxelRenderers()) {
        FrameRequest request = RequestsFor(renderer)[first ? 0 : 3];
        SCOPED_TRACE(testing::Message() << path << ", renderer " << renderer->name());
        ExpectPictureOf(request, whole);  // it has one level, as in memory
        request.level = "1";
        EXPECT_THAT(Render(request).status().message(), HasSubstr("has level 0 alone"));
      }
      ExpectNothingHeld();
    }
    fs::remove_all(directory_ / "cache");
  }
}

TEST_F(StreamsInPartsTest, AStoreThatIsRemovedIsNoticedAndMadeAgain) {
  const std::string path = Streams().front();
  Start(path);
  FrameRequest request = TestRequest(VoxelRenderers().front(), 30);
  ExpectPictureOf(request, *ball_);
  // What is not there would be zeros.
  for (const auto& each : fs::directory_iterator(StoreOf(path) / "0/c")) fs::remove_all(each);
  const Result<Picture> without = Render(request);
  if (without.ok()) {
    ExpectPictureOf(request, *ball_);
  } else {
    EXPECT_EQ(std::ranges::count(without.status().message(), '\n'), 0);
  }
  fs::remove_all(StoreOf(path));
  for (int attempt = 0; attempt < 3 && !Render(request).ok(); ++attempt) {
  }
  ExpectPictureOf(request, *ball_);
  EXPECT_TRUE(fs::exists(StoreOf(path) / "zarr.json"));
}

TEST_F(StreamsInPartsTest, AStreamThatChangesIsReadAgain) {
  const std::string path = Streams().front();
  Start(path);
  FrameRequest request = TestRequest(VoxelRenderers().front(), 30);
  ExpectPictureOf(request, *ball_);
  const std::shared_ptr<const Volume> smaller = TestSphere(90);
  const FileSpec spec{.size = smaller->description.geometry.size, .spacing = {1, 1, 1}};
  WriteFile(path,
            Gzip(NiftiHeader(spec) + FileBytes(reinterpret_cast<const char*>(smaller->block.bytes.data()), smaller->block.bytes.size())));
  ExpectPictureOf(request, *smaller);
}

// ---------------------------------------------------------------- workers

TEST_F(InPartsTest, WorkersComeAndGo) {
  Start(Zarr(ball_), 3);
  FrameRequest request = TestRequest(VoxelRenderers().front(), 30);
  request.level = "0";
  ExpectPictureOf(request, *ball_);
  service_->worker(1).RequestStop();
  request.view.azimuth_degrees = 50;
  ExpectPictureOf(request, *ball_);
  ASSERT_TRUE(service_->AddWorker().ok());
  request.view.azimuth_degrees = 70;
  ExpectPictureOf(request, *ball_);
}

// ---------------------------------------------------------------- levels

TEST_F(InPartsTest, ALevelIsDrawnAsItsVoxelsInAFileOfTheirOwn) {
  const std::string path = Zarr(ball_);
  const VolumeGeometry& finest = ball_->description.geometry;
  Start(path);
  for (int level = 0; level < 3; ++level) {
    const std::shared_ptr<const Volume> voxels = Level(path, level);
    const VolumeGeometry& geometry = voxels->description.geometry;
    ASSERT_EQ(geometry.spacing.x, finest.spacing.x * (1 << level));
    for (const RendererKind* renderer : VoxelRenderers()) {
      for (const Projection projection : {Projection::kOrthographic, Projection::kPerspective}) {
        for (const bool clipped : {false, true}) {
          if (projection == Projection::kPerspective && !renderer->Can(Ability::kPerspective)) continue;
          SCOPED_TRACE(testing::Message() << "level " << level << ", renderer " << renderer->name() << ", " << NameOf(projection)
                                          << (clipped ? ", clipped" : ""));
          FrameRequest request = TestRequest(renderer, 30);
          request.view.projection = projection;
          request.view.look_at = Vec3{45, 52, 60};
          request.view.zoom = 1.5;
          if (clipped) request.clipping.box = ClipBox{{20, 20, 20}, {80.25, 90.5, 70}, ClipUnit::kWorld};
          if (projection == Projection::kPerspective) request.view.eye = Vec3{60, -300, 120};
          // In a file of its own the level has another bounding sphere and other voxel lengths.
          FrameRequest same = request;
          if (projection == Projection::kOrthographic) same.view.zoom *= BoundingRadius(geometry) / BoundingRadius(finest);
          same.transfer.opacity_distance /= 1 << level;
          request.level = std::to_string(level);
          ExpectPictureOfLevel(request, *voxels, same, *ball_);
          if (!clipped) continue;
          // The same box in other units.
          request.clipping.box = ClipBox{{20.5, 20.5, 20.5}, {80.75, 91, 70.5}, ClipUnit::kVoxels};
          ExpectPictureOfLevel(request, *voxels, same, *ball_);
          request.clipping.box->unit = ClipUnit::kPercent;  // of 100 voxels
          ExpectPictureOfLevel(request, *voxels, same, *ball_);
        }
      }
    }
  }
}

TEST_F(InPartsTest, ASlabByItsIndexIsTheSameSlabAtEveryLevel) {
  const std::string path = Zarr(ball_);
  Start(path);
  const std::shared_ptr<const Volume> voxels = Level(path, 1);
  FrameRequest request = TestRequest(VoxelRenderers().front(), 30), same = request;
  request.clipping.slab = ClipSlab{.normal = {0, 0, 1}, .index = 41, .thickness = 20};
  request.level = "1";
  same.clipping.slab = ClipSlab{.normal = {0, 0, 1}, .through = Vec3{0, 0, 41}, .thickness = 20};
  same.transfer.opacity_distance /= 2;
  ExpectPictureOfLevel(request, *voxels, same, *ball_);
  request.clipping.slab->index = 100;
  const Result<Picture> refused = Render(request);
  EXPECT_EQ(refused.status().code(), StatusCode::kInvalidArgument);
  EXPECT_THAT(refused.status().message(), HasSubstr("the volume has slices 0 to 99"));
}

// Where pixels are not empty.
PixelBounds Silhouette(const LocalImage& image, ImageSize size) {
  PixelBounds bounds{size.width, size.height, 0, 0};
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      if (PixelAt(image, x, y).rgba[3] < 0.05) continue;
      bounds = {std::min(bounds.x_begin, x), std::min(bounds.y_begin, y), std::max(bounds.x_end, x + 1), std::max(bounds.y_end, y + 1)};
    }
  }
  return bounds;
}

TEST_F(InPartsTest, LevelsChangeNeitherPlaceNorScale) {
  Start(Zarr(ball_));
  for (const RendererKind* renderer : VoxelRenderers()) {
    for (const Projection projection : {Projection::kOrthographic, Projection::kPerspective}) {
      if (projection == Projection::kPerspective && !renderer->Can(Ability::kPerspective)) continue;
      FrameRequest request = TestRequest(renderer, 30);
      request.size = {300, 260};
      request.view.projection = projection;
      request.level = "0";
      const Result<Picture> finest = Render(request);
      ASSERT_TRUE(finest.ok()) << finest.status().message();
      const PixelBounds expected = Silhouette(*finest->image.floats(), request.size);
      ASSERT_GT(expected.width(), 50);
      const double pixels_a_voxel = 260 / (2 * BoundingRadius(ball_->description.geometry));
      for (int level = 1; level < 3; ++level) {
        SCOPED_TRACE(testing::Message() << "level " << level << ", renderer " << renderer->name() << ", " << NameOf(projection));
        request.level = std::to_string(level);
        const Result<Picture> coarse = Render(request);
        ASSERT_TRUE(coarse.ok()) << coarse.status().message();
        const PixelBounds found = Silhouette(*coarse->image.floats(), request.size);
        const double most = 1 + 1.5 * (1 << level) * pixels_a_voxel;  // a coarse voxel, and half of one under perspective
        EXPECT_NEAR(found.x_begin, expected.x_begin, most);
        EXPECT_NEAR(found.x_end, expected.x_end, most);
        EXPECT_NEAR(found.y_begin, expected.y_begin, most);
        EXPECT_NEAR(found.y_end, expected.y_end, most);
      }
    }
  }
}

// Of one picture in perspective: the near side of the ball is drawn from the finest level, the far side from coarser ones.
TEST_F(InPartsTest, LevelsOfOnePictureAreTheSameHoweverMuchIsHeldByHoweverManyWorkers) {
  const std::string path = Zarr(ball_);
  std::vector<FrameRequest> requests;
  for (const char* const renderer : {"raycast", "mip", "xray"}) {
    FrameRequest request = TestRequest(FindRenderer(renderer), 0);
    request.view.projection = Projection::kPerspective;
    request.view.fov_degrees = 50;
    request.view.distance = 75;
    request.detail = 3;
    requests.push_back(request);
    request.view.azimuth_degrees = 3;
    request.clipping.box = ClipBox{{0, 0, 0}, {60, 100, 75}, ClipUnit::kVoxels};
    requests.push_back(request);
  }
  std::vector<PictureImage> held;
  constexpr std::uint64_t kNoLimit = 0;
  Start(path, 1, kNoLimit);
  for (const FrameRequest& request : requests) {
    SCOPED_TRACE(request.renderer);
    FrameRequest finest = request;
    finest.level = "0";
    const Result<Picture> mixed = Render(request), of_finest = Render(finest);
    ASSERT_TRUE(mixed.ok() && of_finest.ok()) << mixed.status().message() << of_finest.status().message();
    EXPECT_GT(HighestAlpha(mixed->image), 0.1);
    const float difference = LargestDifference(mixed->image, of_finest->image, request.size);
    EXPECT_GT(difference, AllowedDifference(request)) << "drawn from the finest level alone";
    EXPECT_LT(difference, 0.35) << "a shift, or a hole";
    held.push_back(mixed->image);
  }
  EXPECT_GT(client_->QueryStatus(seconds(30))->datasets.at(0).memory_bytes, 100U * 100 * 100) << "more than one level";
  for (const int workers : {1, 3}) {
    Start(path, workers);
    for (std::size_t i = 0; i < requests.size(); ++i) {
      for (const char* const decomposition : {"slab", "kd-tree"}) {
        SCOPED_TRACE(testing::Message() << requests[i].renderer << ", " << workers << " workers, " << decomposition);
        FrameRequest request = requests[i];
        request.policy.decomposition = decomposition;
        Expect(request, held[i], 0);
      }
    }
  }
}

TEST_F(InPartsTest, LevelsThatFitAreHeld) {
  Start(Zarr(ball_), 1, std::uint64_t{1} << 20);  // 768 KiB for datasets
  FrameRequest request = TestRequest(VoxelRenderers().front(), 30);
  request.level = "1";
  ASSERT_TRUE(Render(request).ok());
  EXPECT_EQ(client_->QueryStatus(seconds(30))->datasets.at(0).memory_bytes, 50U * 50 * 50);
}

// ---------------------------------------------------------------- with an index

class IndexedTest : public InPartsTest {
 protected:
  IndexedTest() { ::setenv("XDG_CACHE_HOME", (directory_ / "cache").c_str(), 1); }

  // A ball amid noise that TestRequest does not show.
  static std::shared_ptr<const Volume> MostlyAir(double radius) {
    Random random(71);
    return std::make_shared<const Volume>(MakeTestVolume({100, 100, 320}, ScalarType::kUint8, [&](const Index3& v) {
      const double distance = Length(ToVec3(v) - Vec3{50, 50, 44});
      return distance < radius ? 255 - 2 * distance : random.Integer(5, 20);
    }));
  }
  static IndexFile FileOf(const std::string& path) { return IndexFileOf(path).value(); }
  static void MakeIndex(const std::string& path) {
    const std::shared_ptr<VolumeSource> source = OpenSource(path, {}, ProcessReadContext()).value();
    BrickIndex index = EmptyIndex(source->info()).value();
    const std::string name = FileOf(path).NameNow(VersionOf(source->info().files).value(), source->info()).value();
    CHECK(ReadIntoIndex(*source, {}, index).ok());
    CHECK(FileOf(path).Write(name, index, source->info()).ok());
  }

  struct Drawn {
    PictureImage image;
    std::uint64_t voxel_bytes = 0;
  };
  std::vector<Drawn> Draw(const std::vector<FrameRequest>& requests) {
    std::vector<Drawn> drawn;
    for (const FrameRequest& request : requests) {
      Result<Picture> picture = Render(request);
      EXPECT_TRUE(picture.ok()) << picture.status().message();
      if (!picture.ok()) continue;
      Drawn& last = drawn.emplace_back(Drawn{std::move(picture->image)});
      for (const RankReport& report : picture->statistics.reports) last.voxel_bytes += report.voxel_bytes;
    }
    return drawn;
  }
  // Nothing may depend on when a mask of hidden tiles arrives.
  static std::vector<FrameRequest> ExactRequests(const RendererKind* renderer) {
    std::vector<FrameRequest> requests = RequestsFor(renderer);
    for (FrameRequest& request : requests) {
      request.level = "0";
      request.termination = 0;
    }
    return requests;
  }
};

TEST_F(IndexedTest, ChangesNoBitAndLessIsRead) {
  const std::shared_ptr<const Volume> volume = MostlyAir(36);
  for (const std::string& path : {Nrrd(*volume), Zarr(volume)}) {
    for (const RendererKind* renderer : VoxelRenderers()) {
      SCOPED_TRACE(testing::Message() << path << ", renderer " << renderer->name());
      fs::remove_all(directory_ / "cache");
      const std::vector<FrameRequest> requests = ExactRequests(renderer);
      Start(path, 1);
      const std::vector<Drawn> without = Draw(requests);
      MakeIndex(path);
      Start(path, 1);
      const std::vector<Drawn> with = Draw(requests);
      ASSERT_EQ(with.size(), without.size());
      std::uint64_t read = 0, read_without = 0;
      for (std::size_t i = 0; i < with.size(); ++i) {
        EXPECT_EQ(LargestDifference(with[i].image, without[i].image, requests[i].size), 0) << "picture " << i;
        read += with[i].voxel_bytes;
        read_without += without[i].voxel_bytes;
      }
      // Projections show every value.
      const bool shows_all = renderer->format() == PixelFormat::kMaximum || renderer->format() == PixelFormat::kSum;
      if (!shows_all) {
        EXPECT_LE(double(read), 0.75 * double(read_without));
      }
    }
  }
}

TEST_F(IndexedTest, AnotherTransferFunctionReadsWhatWasLeftOut) {
  const std::shared_ptr<const Volume> volume = MostlyAir(36);
  const std::string path = Zarr(volume);
  MakeIndex(path);
  FrameRequest request = TestRequest(VoxelRenderers().front(), 30), all = request;
  request.level = all.level = "0";
  std::get<TransferFunction>(all.transfer.choice).opacities = {{0, 0.002, 0.5, 0}, {255, 0.2, 0.5, 0}};
  for (const int workers : {1, 3}) {
    Start(path, workers);
    for (const FrameRequest& each : {request, all, request, all}) ExpectPictureOf(each, *volume);
  }
}

TEST_F(IndexedTest, WorkersComeAndGo) {
  const std::shared_ptr<const Volume> volume = MostlyAir(36);
  const std::string path = Zarr(volume);
  MakeIndex(path);
  Start(path, 3);
  FrameRequest request = TestRequest(VoxelRenderers().front(), 30);
  request.level = "0";
  ExpectPictureOf(request, *volume);
  service_->worker(1).RequestStop();
  request.view.azimuth_degrees = 50;
  ExpectPictureOf(request, *volume);
}

TEST_F(IndexedTest, OneOfOtherFilesOrADamagedOneIsNotUsed) {
  const std::shared_ptr<const Volume> small = MostlyAir(20), large = MostlyAir(36);
  FrameRequest request = TestRequest(VoxelRenderers().front(), 30);
  request.level = "0";
  for (const bool zarr : {false, true}) {
    const auto write = [&](const std::shared_ptr<const Volume>& volume) { return zarr ? Zarr(volume) : Nrrd(*volume); };
    const std::string path = write(small);
    MakeIndex(path);
    Start(path);
    ExpectPictureOf(request, *small);
    write(large);
    ExpectPictureOf(request, *large);
    Start(path);
    ExpectPictureOf(request, *large);
    MakeIndex(path);
    std::fstream(FileOf(path).path(), std::ios::binary | std::ios::in | std::ios::out).seekp(-5, std::ios::end).put('x');
    Start(path);
    ExpectPictureOf(request, *large);
  }
}

// ---------------------------------------------------------------- questions

TEST_F(InPartsTest, AnswersAreThoseOfVoxelsInMemory) {
  const std::vector<Vec3> points = {{50, 50, 50}, {49.6, 30.2, 70.7}, {0, 0, 0}, {99.4, 99.4, 99.4}, {1000, 0, 0}, {-0.4, 20, 99}};
  const ClipBox box{{10.5, 20, 3}, {70, 100, 75}, ClipUnit::kVoxels};
  for (const std::string& path : {Nrrd(*ball_), Zarr(ball_)}) {
    SCOPED_TRACE(path);
    constexpr std::uint64_t kNoLimit = 0;
    Start(path, 1, kNoLimit);
    const std::vector<VolumeSample> held = client_->SampleAt({.dataset = "ball", .points = points}).value();
    const BoxStatistics statistics = client_->StatisticsIn({.dataset = "ball", .box = box}).value().statistics;
    const SummaryReply summary = client_->Summarize({.dataset = "ball"}).value();
    Start(path, 1);
    EXPECT_EQ(client_->SampleAt({.dataset = "ball", .points = points}).value(), held);
    EXPECT_EQ(client_->StatisticsIn({.dataset = "ball", .box = box}).value().statistics, statistics);
    const SummaryReply in_parts = client_->Summarize({.dataset = "ball"}).value();
    EXPECT_EQ(in_parts.description, summary.description);
    EXPECT_EQ(in_parts.range, summary.range);
    EXPECT_EQ(in_parts.histogram, summary.histogram);
    EXPECT_EQ(in_parts.transfer, summary.transfer);
    ExpectNothingHeld();
  }
}

TEST_F(InPartsTest, WhatAPixelShowsIsFoundInVoxelsThatAreReadForIt) {
  for (const std::string& path : {Nrrd(*ball_), Zarr(ball_)}) {
    const auto pick = [&](const RendererKind* renderer, double x, double y) -> Result<PickReply> {
      FrameRequest frame = TestRequest(renderer, 30);
      frame.level = "0";
      const RequestId asked = client_->Submit(Question(PickQuery{.frame = frame, .x = x, .y = y}), seconds(60));
      while (const auto event = client_->Next(seconds(60))) {
        if (event->request != asked) continue;
        if (const auto* reply = std::get_if<QuestionReply>(&event->what)) {
          PickReply picked = std::get<PickReply>(*reply);
          picked.nonce = 0;
          return picked;
        }
        return std::get<Status>(event->what);
      }
      return Status::Internal("no answer");
    };
    std::vector<PickReply> held;
    for (const bool in_parts : {false, true}) {
      constexpr std::uint64_t kNoLimit = 0, kLittle = std::uint64_t{512} << 10;
      Start(path, 1, in_parts ? kLittle : kNoLimit);
      std::size_t next = 0, hits = 0;
      for (const RendererKind* renderer : VoxelRenderers()) {
        for (const double x : {5.5, 40.5, 48.25}) {
          SCOPED_TRACE(testing::Message() << path << ", renderer " << renderer->name() << ", x " << x);
          const Result<PickReply> picked = pick(renderer, x, 40.5);
          ASSERT_TRUE(picked.ok()) << picked.status().message();
          hits += picked->sample ? 1 : 0;
          if (!in_parts) {
            held.push_back(*picked);
          } else {
            EXPECT_EQ(*picked, held[next++]);
          }
        }
      }
      EXPECT_GT(hits, 5U);
    }
    ExpectNothingHeld();
  }
}

// ---------------------------------------------------------------- files that change or are damaged

TEST_F(InPartsTest, AReplacedFileGivesTheNewPictureAndARemovedOneAnError) {
  const std::shared_ptr<const Volume> smaller = TestSphere(90);
  for (const bool zarr : {false, true}) {
    SCOPED_TRACE(zarr ? "OME-Zarr" : "NRRD");
    const auto write = [&](const std::shared_ptr<const Volume>& volume) { return zarr ? Zarr(volume) : Nrrd(*volume); };
    const std::string path = write(ball_);
    Start(path);
    FrameRequest request = TestRequest(VoxelRenderers().front(), 30);
    request.level = "0";
    ExpectPictureOf(request, *ball_);
    write(smaller);
    ExpectPictureOf(request, *smaller);
    fs::remove_all(path);
    const Result<Picture> gone = Render(request);
    EXPECT_FALSE(gone.ok());
    EXPECT_THAT(gone.status().message(), HasSubstr("ball."));
    EXPECT_EQ(std::ranges::count(gone.status().message(), '\n'), 0);
    write(ball_);
    ExpectPictureOf(request, *ball_);
  }
}

TEST_F(InPartsTest, ALevelThatIsDrawnFirstAfterTheFilesHaveChangedIsOfTheNewOnes) {
  const std::string path = Zarr(ball_);
  Start(path);
  FrameRequest request = TestRequest(VoxelRenderers().front(), 30);
  request.level = "0";
  ExpectPictureOf(request, *ball_);
  const std::shared_ptr<const Volume> smaller = TestSphere(90);
  Zarr(smaller);
  const std::shared_ptr<const Volume> voxels = Level(path, 1);
  ASSERT_EQ(voxels->description.geometry.size.x, 45);
  request.level = "1";
  FrameRequest same = request;
  same.transfer.opacity_distance /= 2;
  ExpectPictureOfLevel(request, *voxels, same, *smaller);
}

TEST_F(InPartsTest, ADamagedObjectEndsTheFrameAndIsNamed) {
  const std::string path = Zarr(ball_);
  int damaged = 0;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(path + "/0")) {
    if (!entry.is_regular_file() || entry.path().extension() == ".json" || entry.file_size() < 500) continue;
    std::fstream file(entry.path(), std::ios::binary | std::ios::in | std::ios::out);
    for (std::uintmax_t at = 0; at < entry.file_size(); at += 7) file.seekp(std::streamoff(at)).put('x');
    ++damaged;
  }
  ASSERT_GT(damaged, 0);
  Start(path);
  FrameRequest request = TestRequest(VoxelRenderers().front(), 30);
  request.level = "0";
  const Result<Picture> picture = Render(request);
  EXPECT_EQ(picture.status().code(), StatusCode::kDataLoss) << picture.status().message();
  EXPECT_THAT(picture.status().message(), HasSubstr("/0/"));
  EXPECT_EQ(std::ranges::count(picture.status().message(), '\n'), 0);
}

// ---------------------------------------------------------------- grids

// Bit for bit: workers get the same cells in the same order, whether the coordinator holds them or reads them.
TEST_F(StreamsInPartsTest, PicturesOfCellsOnDiskAreThoseOfCellsInMemory) {
  const auto bent = [](const Vec3& n) { return Vec3{n.x + 3 * std::sin(0.2 * n.y), n.y + 2 * std::cos(0.3 * n.z), n.z}; };
  const FileBytes grid = VtuFile(BoxOfHexahedra({}, {30, 25, 20}, bent));
  const std::string held = (directory_ / "held.vtu").string(), kept = (directory_ / "kept.vtu").string();
  WriteFile(held, grid);
  WriteFile(kept, grid);
  ASSERT_TRUE(ReadVolume(kept, {.keep_cells = true}).ok());
  const std::shared_ptr<const Volume> volume = ReadVolume(held).value().volume;
  ASSERT_TRUE(volume->cells != nullptr);
  FrameRequest request = TestRequest(FindRenderer("slice"), 30, 0);
  request.policy.decomposition = "subcube";
  request.transfer.choice = TransferFunction{.colors = {{0, {0.2F, 0.4F, 1}}, {2300, {1, 0.7F, 0.3F}}},
                                             .opacities = {{0, 0, 0.5, 0}, {300, 0, 0.5, 0}, {2300, 0.1, 0.5, 0}},
                                             .opacity_distance = 1};
  for (const int workers : {1, 3}) {
    std::size_t reports = 0;
    for (const std::uint64_t limit : {std::uint64_t{0}, std::uint64_t{200} << 20}) {
      SCOPED_TRACE(testing::Message() << workers << " workers of " << (limit >> 20) << " MiB");
      for (const Projection projection : {Projection::kOrthographic, Projection::kPerspective}) {
        request.view.projection = projection;
        request.policy.balance_by = projection == Projection::kPerspective ? "occupied" : "auto";  // for which cells are counted
        std::vector<Picture> pictures;
        for (const std::string& path : {held, kept}) {
          Start(path, workers, 0, limit);
          Result<Picture> picture = Render(request);
          ASSERT_TRUE(picture.ok()) << picture.status().message();
          pictures.push_back(*std::move(picture));
        }
        EXPECT_EQ(LargestDifference(pictures[0].image, pictures[1].image, request.size), 0);
        EXPECT_LE(LargestDifference(pictures[1].image, RenderDirectly(request, *volume), request.size), AllowedDifference(request));
        EXPECT_GT(HighestAlpha(pictures[1].image), 0.5);
        if (limit == 0) reports = pictures[1].statistics.reports.size();
        EXPECT_TRUE(limit == 0 || pictures[1].statistics.reports.size() > reports) << "in more groups, if there is a limit";
      }
    }
  }
}

}  // namespace
}  // namespace slabstream
