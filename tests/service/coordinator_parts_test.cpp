// The parts round the coordinator's machine: names of connections, samples of boxes, the slabs plane, the catalogue.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "common/transport/socket.h"
#include "common/wire/payload.h"
#include "coordinator/box_samples.h"
#include "coordinator/catalogue.h"
#include "coordinator/dataset_id.h"
#include "coordinator/peer_table.h"
#include "coordinator/slab_server.h"
#include "tests/support/random.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

using testing::HasSubstr;

TEST(PeerTable, TokensAreNeverReused) {
  PeerTable peers;
  const Time start{};
  const PeerToken a = peers.Heard("a", start);
  EXPECT_EQ(peers.Heard("a", start), a);
  const PeerToken b = peers.Heard("b", start);
  EXPECT_NE(a, b);
  peers.Forget(a);
  EXPECT_EQ(peers.IdentityOf(a), nullptr);
  const PeerToken again = peers.Heard("a", start);
  EXPECT_NE(again, a);
  EXPECT_NE(again, b);
  ASSERT_NE(peers.IdentityOf(again), nullptr);
  EXPECT_EQ(*peers.IdentityOf(again), "a");
}

TEST(PeerTable, SilentConnectionsAreForgotten) {
  PeerTable peers;
  const Time start{};
  const PeerToken silent = peers.Heard("silent", start);
  const PeerToken lively = peers.Heard("lively", start);
  peers.Heard("lively", start + std::chrono::seconds(2));
  peers.ForgetSilentSince(start + std::chrono::seconds(1));
  EXPECT_EQ(peers.IdentityOf(silent), nullptr);
  EXPECT_NE(peers.IdentityOf(lively), nullptr);
  EXPECT_EQ(peers.size(), 1U);
}

std::shared_ptr<const Volume> RandomVolume(Index3 size, ScalarType type, Random& random) {
  Volume volume;
  volume.description.geometry.size = size;
  volume.description.type = type;
  volume.block = MakeVoxelBlock(volume.description.geometry.bounds(), type);
  for (std::byte& byte : volume.block.bytes) byte = std::byte(random.Integer(0, 255));
  return std::make_shared<const Volume>(std::move(volume));
}

// The samples of a box, one by one.
std::vector<std::byte> SamplesByDefinition(const Volume& volume, const Box& box) {
  std::vector<std::byte> samples;
  const std::size_t n = BytesPerSample(volume.block.type);
  for (int z = box.begin.z; z < box.end.z; ++z) {
    for (int y = box.begin.y; y < box.end.y; ++y) {
      for (int x = box.begin.x; x < box.end.x; ++x) {
        const std::byte* sample = volume.block.bytes.data() + std::size_t(volume.block.Offset({x, y, z})) * n;
        samples.insert(samples.end(), sample, sample + n);
      }
    }
  }
  return samples;
}

class BoxSamplesTest : public testing::Test {
 protected:
  int Pick(int low, int high) { return random_.Integer(low, high); }
  Random random_{11};
};

TEST_F(BoxSamplesTest, AnyPieceOfAnyBoxIsWhatTheDefinitionSays) {
  SCOPED_TRACE(random_.trace());
  for (int round = 0; round < 300; ++round) {
    const auto type = static_cast<ScalarType>(Pick(1, 3));
    const Index3 size = {Pick(1, 9), Pick(1, 9), Pick(1, 9)};
    const auto volume = RandomVolume(size, type, random_);
    Box box;
    for (int axis = 0; axis < 3; ++axis) {
      const bool whole = Pick(0, 1) == 1;
      box.begin[axis] = whole ? 0 : Pick(0, size[axis] - 1);
      box.end[axis] = whole ? size[axis] : Pick(box.begin[axis] + 1, size[axis]);
    }
    const std::vector<std::byte> all = SamplesByDefinition(*volume, box);
    const auto begin = std::size_t(Pick(0, int(all.size()) - 1));
    const auto end = std::size_t(Pick(int(begin) + 1, int(all.size())));
    const Bytes piece = BoxSamples(volume, box, begin, end);
    ASSERT_EQ(piece.size(), end - begin);
    ASSERT_EQ(std::memcmp(piece.span().data(), all.data() + begin, piece.size()), 0) << "round " << round;
  }
}

TEST_F(BoxSamplesTest, SlabsAlongZAreNotCopied) {
  const auto volume = RandomVolume({5, 4, 6}, ScalarType::kUint16, random_);
  const Bytes piece = BoxSamples(volume, {{0, 0, 2}, {5, 4, 5}}, 0, 5 * 4 * 3 * 2);
  EXPECT_EQ(piece.span().data(), volume->block.bytes.data() + 2 * 5 * 4 * 2);
}

// So a worker knows again what it holds, whoever the coordinator is.
TEST(DatasetId, IsTheSameForTheSameVoxelsUnderTheSameNameOnly) {
  Random random(7);
  SCOPED_TRACE(random.trace());
  const auto volume = RandomVolume({30, 20, 10}, ScalarType::kUint8, random);
  Volume copy;
  copy.description = volume->description;
  copy.block = MakeVoxelBlock(volume->block.box, volume->block.type);
  copy.block.bytes = volume->block.bytes;
  const DatasetId id = IdOf("ball", *volume);
  EXPECT_NE(id, DatasetId{0});
  EXPECT_EQ(IdOf("ball", copy), id);
  EXPECT_NE(IdOf("bell", copy), id);
  copy.description.geometry.spacing.z *= 2;
  EXPECT_NE(IdOf("ball", copy), id);
  copy.description = volume->description;
  copy.block.bytes.back() ^= std::byte{1};
  EXPECT_NE(IdOf("ball", copy), id);
}

class SlabServerTest : public testing::Test {
 protected:
  static constexpr Epoch kEpoch = 77;

  SlabServerTest()
      : random_(1),
        volume_(RandomVolume({300, 70, 60}, ScalarType::kUint8, random_)),  // two chunks
        server_(SlabServer::Start(context_, {"inproc://slab-server-test"}, kEpoch).value()),
        worker_(Socket::Dealer(context_).value()) {
    server_->Publish(5, {.volume = volume_});
    CHECK(worker_.Connect(server_->endpoint()).ok());
  }

  AnyMessage Ask(const ChunkRequest& request, Bytes* payload = nullptr) {
    CHECK(worker_.Send({}, Encode(request)).ok());
    const std::array<Socket*, 1> sockets = {&worker_};
    std::optional<Incoming> incoming;
    while (!(incoming = worker_.TryReceive())) Wait(sockets, nullptr, std::chrono::seconds(10));
    if (payload != nullptr) *payload = incoming->payload();
    return Decode(incoming->header()).value();
  }
  void ExpectRefused(const ChunkRequest& request, StatusCode code, const char* reason) {
    const AnyMessage answer = Ask(request);
    const auto* refused = std::get_if<ChunkRefused>(&answer);
    ASSERT_NE(refused, nullptr) << NameOf(answer);
    EXPECT_EQ(refused->status.code(), code);
    EXPECT_THAT(refused->status.message(), HasSubstr(reason));
    EXPECT_EQ(refused->chunk, request.chunk);
  }

  Context context_;
  Random random_;
  std::shared_ptr<const Volume> volume_;
  std::unique_ptr<SlabServer> server_;
  Socket worker_;
};

TEST_F(SlabServerTest, ChunksPutTogetherAreTheBox) {
  const Box box = volume_->block.box;
  server_->Publish(6, {.bricks = std::make_shared<const BrickedVoxels>(volume_->block)});
  for (DatasetId dataset : {5U, 6U}) {
    std::vector<Bytes> payloads;
    std::vector<std::byte> samples(std::size_t(box.voxel_count()));
    for (std::uint32_t i = 0; i < ChunkCount(box, ScalarType::kUint8); ++i) {
      Bytes& payload = payloads.emplace_back();  // all are kept: none may change when others are asked for
      const AnyMessage answer = Ask({.epoch = kEpoch, .worker = 1, .dataset = dataset, .box = box, .chunk = i}, &payload);
      const auto* chunk = std::get_if<Chunk>(&answer);
      ASSERT_NE(chunk, nullptr) << NameOf(answer);
      const Status status = UnpackChunk(*chunk, payload.span(), std::span(samples).subspan(std::size_t{i} * kChunkBytes, chunk->raw_bytes));
      ASSERT_TRUE(status.ok()) << status.message();
    }
    EXPECT_EQ(std::memcmp(samples.data(), volume_->block.bytes.data(), samples.size()), 0) << "dataset " << dataset;
  }
}

TEST_F(SlabServerTest, RequestsThatCannotBeMetAreRefusedWithTheReason) {
  const Box box = volume_->block.box;
  ExpectRefused({.epoch = kEpoch, .worker = 1, .dataset = 6, .box = box, .chunk = 0}, StatusCode::kNotFound, "dataset 6");
  const ChunkRequest stale{.epoch = kEpoch - 1, .worker = 1, .dataset = 6, .box = box, .chunk = 1};
  ASSERT_TRUE(worker_.Send({}, Encode(stale)).ok());  // of an earlier coordinator: no answer at all, which the next line would get
  ExpectRefused({.epoch = kEpoch, .worker = 1, .dataset = 5, .box = {{0, 0, 0}, {301, 1, 1}}, .chunk = 0}, StatusCode::kInvalidArgument,
                "not inside the volume");
  ExpectRefused({.epoch = kEpoch, .worker = 1, .dataset = 5, .box = box, .chunk = 2}, StatusCode::kInvalidArgument,
                "chunk 2 is not below 2");
}

std::size_t ResidentBytes() {
  std::ifstream file("/proc/self/statm");
  std::size_t total = 0, resident = 0;
  file >> total >> resident;
  return resident * std::size_t(::sysconf(_SC_PAGESIZE));
}

TEST_F(SlabServerTest, AConnectionThatAsksAndNeverReadsCostsLittleMemory) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "the address sanitizer keeps memory that was freed";
#endif
  constexpr int kRequests = 2000;
  const auto server = SlabServer::Start(context_, {"tcp://127.0.0.1:*"}, kEpoch).value();
  server->Publish(5, {.volume = volume_});
  Socket greedy = Socket::Dealer(context_, {.send_high_water_mark = kRequests, .receive_high_water_mark = 1}).value();
  worker_ = Socket::Dealer(context_).value();
  ASSERT_TRUE(greedy.Connect(server->endpoint()).ok() && worker_.Connect(server->endpoint()).ok());
  const Box part = {{0, 0, 0}, {299, 70, 60}};  // is copied out of the volume
  (void)Ask({.epoch = kEpoch, .worker = 1, .dataset = 5, .box = {{0, 0, 0}, {1, 1, 1}}, .chunk = 0});
  const std::size_t before = ResidentBytes();
  for (int i = 0; i < kRequests; ++i)
    ASSERT_TRUE(greedy.Send({}, Encode(ChunkRequest{.epoch = kEpoch, .worker = 2, .dataset = 5, .box = part, .chunk = 0})).ok());
  // Connections are served in turn: with as many small requests of another one all have been served.
  for (int i = 0; i < kRequests + 100; ++i)
    (void)Ask({.epoch = kEpoch, .worker = 1, .dataset = 5, .box = {{0, 0, 0}, {1, 1, 1}}, .chunk = 0});
  EXPECT_LT(ResidentBytes() - std::min(before, ResidentBytes()), std::size_t{3} * kMaxQueuedChunks * kChunkBytes);
}

class CatalogueTest : public testing::Test {
 protected:
  void Touch(const std::string& name) { std::ofstream(directory_ / name) << "x"; }
  void ExpectError(const std::vector<std::string>& arguments, StatusCode code, const std::string& reason) {
    const Result<Catalogue> catalogue = MakeCatalogue(arguments);
    EXPECT_EQ(catalogue.status().code(), code) << catalogue.status().message();
    EXPECT_THAT(catalogue.status().message(), HasSubstr(reason));
    EXPECT_THAT(catalogue.status().message(), testing::Not(HasSubstr("\n")));
  }
  TemporaryDirectory temporary_;
  const std::filesystem::path directory_ = temporary_.path();
};

TEST_F(CatalogueTest, NamesComeFromArgumentsAndStems) {
  Touch("head.nii.gz");
  Touch("foot.nrrd");
  Touch("notes.txt");
  const Result<Catalogue> catalogue = MakeCatalogue({directory_.string(), "other=" + (directory_ / "foot.nrrd").string()});
  ASSERT_TRUE(catalogue.ok()) << catalogue.status().message();
  std::vector<std::string> names;
  for (const auto& [name, loader] : *catalogue) names.push_back(name);
  EXPECT_THAT(names, testing::ElementsAre("foot", "head", "other"));
  EXPECT_FALSE(catalogue->at("head")().ok()) << "loading a file that is no volume fails when it is tried, not before";
}

TEST_F(CatalogueTest, OfDirectoriesHasOneNameForEach) {
  for (const char* name : {"study-1", "study-2"}) {
    std::filesystem::create_directories(directory_ / name / "DICOM");
    std::ofstream(directory_ / name / "DICOM/IM1") << std::string(128, '\0') << "DICM";
  }
  const auto names = [&](const std::filesystem::path& directory) {
    std::vector<std::string> found;
    const Result<Catalogue> catalogue = MakeCatalogue({directory.string()});
    EXPECT_TRUE(catalogue.ok()) << catalogue.status().message();
    if (catalogue.ok()) {
      for (const auto& [name, loader] : *catalogue) found.push_back(name);
    }
    return found;
  };
  EXPECT_THAT(names(directory_), testing::ElementsAre("study-1", "study-2"));
  EXPECT_THAT(names(directory_ / "study-1/DICOM"), testing::ElementsAre("DICOM")) << "slices lie in it";
  Touch("study-1/DICOMDIR");
  EXPECT_THAT(names(directory_ / "study-1"), testing::ElementsAre("study-1"));
  Touch("head.nrrd");
  EXPECT_THAT(names(directory_), testing::ElementsAre("head", "study-1", "study-2")) << "DICOM below it does not make it one of DICOM";
}

TEST_F(CatalogueTest, OptionsForReadingStandBehindThePath) {
  std::ofstream(directory_ / "samples.raw") << "0123456789ab";
  const std::string options = "?dims=3,2,1,type=uint16,spacing=0.5,1,2";
  const Result<Catalogue> catalogue = MakeCatalogue({"raw=" + (directory_ / "samples.raw").string() + options});
  ASSERT_TRUE(catalogue.ok()) << catalogue.status().message();
  const Result<std::shared_ptr<const Volume>> volume = catalogue->at("raw")();
  ASSERT_TRUE(volume.ok()) << volume.status().message();
  EXPECT_EQ((*volume)->description.geometry.size, (Index3{3, 2, 1}));
  EXPECT_EQ((*volume)->description.geometry.spacing, (Vec3{0.5, 1, 2}));
  Touch("head.nrrd");
  EXPECT_EQ(MakeCatalogue({directory_.string()})->size(), 1U) << "raw samples without options are no dataset";
}

TEST_F(CatalogueTest, BadArgumentsAreNamed) {
  Touch("head.nii.gz");
  Touch("head.nrrd");
  const std::string file = (directory_ / "head.nrrd").string();
  ExpectError({directory_.string()}, StatusCode::kInvalidArgument, "already a dataset named \"head\"");
  ExpectError({"a=" + file, "a=" + file}, StatusCode::kInvalidArgument, "already a dataset named \"a\"");
  ExpectError({"=" + file}, StatusCode::kInvalidArgument, "dataset name \"\"");
  ExpectError({"a/b=" + file}, StatusCode::kInvalidArgument, "dataset name \"a/b\"");
  ExpectError({std::string(257, 'a') + "=" + file}, StatusCode::kInvalidArgument, "1 to 256");
  ExpectError({"a=" + file + ".missing"}, StatusCode::kNotFound, "does not exist");
  ExpectError({"missing"}, StatusCode::kNotFound, "does not exist");
  ExpectError({"a=" + file + "?tine=3"}, StatusCode::kInvalidArgument, "'tine' is no option for reading a file");
  ExpectError({"a=" + file + "?offset=3"}, StatusCode::kInvalidArgument, "offset is no option of NRRD");
  ExpectError({"a=" + file + ".missing?time=3"}, StatusCode::kNotFound, "does not exist");
  Touch("samples.raw");
  ExpectError({"a=" + (directory_ / "samples.raw").string()}, StatusCode::kInvalidArgument, "raw files need --dims X,Y,Z --type TYPE");
  ExpectError({file}, StatusCode::kInvalidArgument, "NAME=");
  std::filesystem::create_directory(directory_ / "empty");
  ExpectError({(directory_ / "empty").string()}, StatusCode::kInvalidArgument, "no volume file");
}

}  // namespace
}  // namespace slabstream
