// The parts round the coordinator's machine: names of connections, samples of boxes, the voxels plane, the catalogue.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <future>
#include <memory>
#include <thread>
#include <utility>

#include "common/mesh/mesh_part.h"
#include "common/transport/socket.h"
#include "common/volume/light_volume.h"
#include "common/volume/sphere.h"
#include "common/wire/limits.h"
#include "common/wire/payload.h"
#include "coordinator/service/answer_question.h"
#include "coordinator/service/box_samples.h"
#include "coordinator/service/dataset_id.h"
#include "coordinator/service/folder_memory.h"
#include "coordinator/service/peer_table.h"
#include "coordinator/service/voxel_server.h"
#include "data/catalogue/catalogue.h"
#include "data/catalogue/dataset_fields.h"
#include "data/volume_io/volume_writer.h"
#include "tests/common/mesh/mesh_samples.h"
#include "tests/data/sources/memory_source.h"
#include "tests/support/random.h"
#include "tests/support/random_volume.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

using testing::HasSubstr;

TEST(AnswerTo, ASummaryHasTheLabelsOfTheDataset) {
  const auto sphere = std::make_shared<const Volume>(MakeSphere({.size = 8}).value());
  VolumeSummary summary = Summarize(*sphere);
  AnswerQuestion asked{.question = SummaryQuery{.nonce = 7, .dataset = "ball", .transfer = {}}, .dataset = 5};
  asked.summary = std::make_shared<const VolumeSummary>(summary);
  const auto answer = [&] { return std::get<SummaryReply>(AnswerTo(asked, {.volume = sphere}).value()); };
  EXPECT_EQ(answer().labels, std::vector<Label>());
  EXPECT_EQ(answer().nonce, 7U);
  const std::vector<Label> labels = {{3, {1, 0.5F, 0}, "Corner"}, {70, {0, 0, 1}, ""}};
  summary.labels = std::make_shared<const LabelTable>(LabelTable{labels, true});
  asked.labels.summary = std::make_shared<const VolumeSummary>(summary);
  EXPECT_EQ(answer().labels, labels);
  EXPECT_TRUE(answer().all_labels);
  EXPECT_EQ(AnswerTo(asked, {}).status().code(), StatusCode::kUnavailable) << "it was unloaded meanwhile";
  asked.dataset = 0;
  EXPECT_EQ(std::get<SummaryReply>(AnswerTo(asked, {}).value()).labels, labels) << "it has several levels, and no voxels itself";
}

TEST(AnswerTo, QuestionsAboutAVolumeInPartsHaveTheAnswersOfItsVoxels) {
  const auto sphere = std::make_shared<const Volume>(MakeSphere({.size = 40}).value());
  const VoxelServer::Samples held{.volume = sphere}, in_parts{.in_parts = {MakeMemorySource(sphere, {}), 0}};
  AnswerQuestion asked{.dataset = 5, .summary = std::make_shared<const VolumeSummary>(Summarize(*sphere))};
  const auto both = [&](auto query, auto&& what) {
    query.dataset = "ball";
    asked.question = query;
    const QuestionReply of_held = AnswerTo(asked, held).value(), of_parts = AnswerTo(asked, in_parts).value();
    EXPECT_EQ(what(of_parts), what(of_held));
  };
  both(JointHistogramQuery{}, [](const QuestionReply& reply) { return std::get<JointHistogramReply>(reply).histogram.counts; });
  both(SummaryQuery{}, [](const QuestionReply& reply) { return std::get<SummaryReply>(reply).histogram; });
  const ClipBox box{{3, 4, 5}, {30, 31, 22}, ClipUnit::kVoxels};
  both(StatisticsQuery{.box = box}, [](const QuestionReply& reply) { return std::get<StatisticsReply>(reply).statistics; });
  both(SampleQuery{.points = {{20, 20, 20}}}, [](const QuestionReply& reply) { return std::get<SampleReply>(reply).samples; });
}

// Of a volume whose voxel (x, y, z) has the value x + 10 * y + 100 * z.
std::shared_ptr<const Volume> MakeNumbered(const VolumeGeometry& geometry, ValueMapping mapping = {}) {
  Volume volume{.description = {.geometry = geometry, .type = ScalarType::kFloat32, .mapping = mapping},
                .block = MakeVoxelBlock(geometry.bounds(), ScalarType::kFloat32)};
  for (std::int32_t z = 0; z < geometry.size.z; ++z) {
    for (std::int32_t y = 0; y < geometry.size.y; ++y) {
      for (std::int32_t x = 0; x < geometry.size.x; ++x)
        volume.block.samples<float>()[volume.block.Offset({x, y, z})] = float(x + 10 * y + 100 * z);
    }
  }
  return std::make_shared<const Volume>(std::move(volume));
}

TEST(AnswerTo, APointHasTheValueOfEachFieldByItsName) {
  const VolumeGeometry grid{{6, 6, 6}, {1, 1, 1}};
  VolumeGeometry half{{3, 3, 3}, {2, 2, 2}};  // the first voxel's centre lies at (2, 0, 0)
  half.orientation.origin = {2, 0, 0};
  const std::shared_ptr<const Volume> volumes[] = {MakeNumbered(grid), MakeNumbered(grid, {2, -1}), MakeNumbered(half)};
  AnswerQuestion asked{.question = SampleQuery{.dataset = "d", .points = {{3.2, 1, 4.4}, {0, 2, 2}, {9, 9, 9}}}, .dataset = 5};
  asked.summary = std::make_shared<const VolumeSummary>(Summarize(*volumes[0]));
  asked.fields.dataset = std::make_shared<const DatasetFields>(
      DatasetFields{.fields = {{.name = "DAPI"}, {}, {.name = "overlay", .channel = false, .shown = false}}});
  for (const int number : {1, 2}) {
    const auto summary = std::make_shared<const VolumeSummary>(Summarize(*volumes[number]));
    asked.fields.others.push_back({.number = number, .levels = {{DatasetId(6 + number), summary}}, .of_volume = {0}});
  }
  const auto samples =
      std::get<SampleReply>(AnswerTo(asked, {.volume = volumes[0]}, {{.volume = volumes[1]}, {.volume = volumes[2]}}).value()).samples;
  ASSERT_EQ(samples.size(), 3U);
  using Fields = std::vector<FieldSample>;
  // Voxel (3, 1, 4) is the point (0.5, 0.5, 2) of the overlay.
  EXPECT_EQ(samples[0].fields, (Fields{{"DAPI", 413}, {"channel 1", 2 * 413 - 1}, {"overlay", 0.5 + 5 + 200}}));
  EXPECT_EQ(samples[1].fields, (Fields{{"DAPI", 220}, {"channel 1", 2 * 220 - 1}, {"overlay"}})) << "the overlay begins at x = 1";
  EXPECT_EQ(samples[2].fields, Fields()) << "outside of the volume";
  const Status gone = AnswerTo(asked, {.volume = volumes[0]}, {{}, {.volume = volumes[2]}}).status();
  EXPECT_EQ(gone.code(), StatusCode::kUnavailable) << gone.message();
  asked.fields.volume_shows = false;
  asked.fields.others.clear();
  EXPECT_EQ(std::get<SampleReply>(AnswerTo(asked, {.volume = volumes[0]}).value()).samples[0].fields, Fields());
}

TEST(AnswerTo, ViewsOfAPathAreThoseOfItsCameras) {
  const auto sphere = std::make_shared<const Volume>(MakeSphere({.size = 8}).value());
  ViewQuery query{
      .frame = {.dataset = "ball"}, .path = {{0, {.azimuth_degrees = 10}}, {2, {.azimuth_degrees = 50, .zoom = 4}}}, .at = {2, 1}};
  AnswerQuestion asked{.question = query, .dataset = 5, .summary = std::make_shared<const VolumeSummary>(Summarize(*sphere))};
  const auto answer = [&] {
    asked.question = query;
    return AnswerTo(asked, {.volume = sphere});
  };
  const std::vector<ViewParameters> views = std::get<ViewReply>(answer().value()).path;
  ASSERT_EQ(views.size(), 2U);
  EXPECT_EQ(views[0].azimuth_degrees, 50);
  EXPECT_EQ(views[0].zoom, 4);
  EXPECT_NEAR(*views[1].azimuth_degrees, 30, 1e-9);
  EXPECT_NEAR(views[1].zoom, 2, 1e-9);
  query.path = {{0, ViewParameters{.azimuth_degrees = std::nullopt, .elevation_degrees = std::nullopt}}, {1, {}}};
  EXPECT_TRUE(answer().ok()) << "the volume's default view fills in what a camera does not say";
  query.path[1].seconds = 0;
  EXPECT_THAT(answer().status().message(), HasSubstr("camera 2 of the path has the time 0"));
  query.path.clear();
  EXPECT_TRUE(std::get<ViewReply>(answer().value()).path.empty());
}

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
    const auto volume = std::make_shared<const Volume>(RandomVolume(random_, size, type));
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
  const auto volume = std::make_shared<const Volume>(RandomVolume(random_, {5, 4, 6}, ScalarType::kUint16));
  const Bytes piece = BoxSamples(volume, {{0, 0, 2}, {5, 4, 5}}, 0, 5 * 4 * 3 * 2);
  EXPECT_EQ(piece.span().data(), volume->block.bytes.data() + 2 * 5 * 4 * 2);
}

// So a worker knows again what it holds, whoever the coordinator is.
TEST(DatasetId, IsTheSameForTheSameVoxelsUnderTheSameNameOnly) {
  Random random(7);
  SCOPED_TRACE(random.trace());
  const auto volume = std::make_shared<const Volume>(RandomVolume(random, {30, 20, 10}, ScalarType::kUint8));
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

class VoxelServerTest : public testing::Test {
 protected:
  static constexpr Epoch kEpoch = 77;

  VoxelServerTest()
      : random_(1),
        volume_(std::make_shared<const Volume>(RandomVolume(random_, {300, 70, 60}, ScalarType::kUint8))),  // two chunks
        server_(VoxelServer::Start(context_, {"inproc://voxel-server-test"}, kEpoch).value()),
        worker_(Socket::Dealer(context_).value()) {
    server_->Publish(5, {.volume = volume_});
    CHECK(worker_.Connect(server_->endpoint()).ok());
  }

  AnyMessage Ask(const ChunkRequest& request, Bytes* payload = nullptr) {
    CHECK(worker_.Send({}, Encode(request)).ok());
    return Receive(payload);
  }
  AnyMessage Receive(Bytes* payload = nullptr) {
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
  std::unique_ptr<VoxelServer> server_;
  Socket worker_;
};

TEST_F(VoxelServerTest, ChunksPutTogetherAreTheBox) {
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

TEST_F(VoxelServerTest, WorkersOfTheProcessAndOthersGetOneLightVolume) {
  server_->Publish(6, {.volume = volume_, .description = volume_->description});
  const std::shared_ptr<const HeldVoxels> held = server_->FindHeld(LightVolumeOf(6));
  ASSERT_NE(held, nullptr);
  const Volume expected = MakeLightVolume(volume_->block, volume_->description);
  const Box box = expected.block.box;
  Bytes payload;
  const AnyMessage answer = Ask({.epoch = kEpoch, .worker = 1, .dataset = LightVolumeOf(6), .box = box, .chunk = 0}, &payload);
  const auto* chunk = std::get_if<Chunk>(&answer);
  ASSERT_NE(chunk, nullptr) << NameOf(answer);
  VoxelBlock sent = MakeVoxelBlock(box, ScalarType::kUint8);
  ASSERT_EQ(chunk->raw_bytes, sent.bytes.size());
  ASSERT_TRUE(UnpackChunk(*chunk, payload.span(), sent.bytes).ok());
  EXPECT_EQ(sent.bytes, expected.block.bytes);
  server_->Withdraw(6);
  EXPECT_EQ(server_->FindHeld(LightVolumeOf(6)), nullptr);
  EXPECT_EQ(held->view().Block().bytes, expected.block.bytes) << "whoever found it before keeps it";
}

TEST_F(VoxelServerTest, LabelsOf64BitsArriveAsTheyAre) {
  const Box box = volume_->block.box;
  const auto labels = std::make_shared<Volume>(Volume{volume_->description, MakeVoxelBlock(box, ScalarType::kUint64)});
  labels->description.type = ScalarType::kUint64;
  for (std::int64_t i = 0; i < box.voxel_count(); ++i) {
    labels->block.samples<std::uint64_t>()[i] = std::uint64_t(random_.Real(0, 0x1p63)) * 2 + 1;
  }
  server_->Publish(7, {.volume = labels});
  std::vector<std::byte> samples;
  for (std::uint32_t i = 0; i < ChunkCount(box, ScalarType::kUint64); ++i) {
    const ChunkPart part = PartOfChunk(box, ScalarType::kUint64, i);
    ASSERT_EQ(part.begin, samples.size()) << "chunk " << i << " does not follow the one before";
    samples.resize(samples.size() + part.bytes);
    Bytes payload;
    const AnyMessage answer = Ask({.epoch = kEpoch, .worker = 1, .dataset = 7, .box = box, .chunk = i}, &payload);
    const auto* chunk = std::get_if<Chunk>(&answer);
    ASSERT_NE(chunk, nullptr) << NameOf(answer);
    ASSERT_TRUE(UnpackChunk(*chunk, payload.span(), std::span(samples).subspan(part.begin)).ok());
  }
  EXPECT_TRUE(std::ranges::equal(samples, labels->block.bytes));
}

TEST_F(VoxelServerTest, ChunksOfCellsAreTheCellsOfTheBox) {
  const Box whole = volume_->block.box, part = {whole.begin, {whole.end.x / 2, whole.end.y / 3, whole.end.z}};
  const auto cells = std::make_shared<const MeshCutter>(
      std::make_shared<const Mesh>(MakeTetrahedralCube(whole.size(), 30, random_, 0.2, [](const Vec3& p) { return p.z; })));
  server_->Publish(8, {.volume = volume_, .cells = cells});
  for (const Box& box : {whole, part}) {
    const std::vector<std::byte> expected = EncodeMesh(cells->Cut(box));
    std::vector<std::byte> sent;
    for (std::uint32_t i = 0; i < CellChunkCount(expected.size()); ++i) {
      Bytes payload;
      const AnyMessage answer = Ask({.epoch = kEpoch, .worker = 1, .dataset = 8, .box = box, .chunk = kFirstCellChunk + i}, &payload);
      const auto* chunk = std::get_if<Chunk>(&answer);
      ASSERT_NE(chunk, nullptr) << NameOf(answer);
      EXPECT_EQ(chunk->cell_bytes, expected.size());
      sent.resize(sent.size() + chunk->raw_bytes);
      ASSERT_TRUE(UnpackChunk(*chunk, payload.span(), std::span(sent).last(chunk->raw_bytes)).ok());
    }
    EXPECT_EQ(sent, expected);
    const std::uint32_t beyond = CellChunkCount(expected.size());
    ExpectRefused({.epoch = kEpoch, .worker = 1, .dataset = 8, .box = box, .chunk = kFirstCellChunk + beyond}, StatusCode::kInvalidArgument,
                  "of cells is not below");
  }
  ExpectRefused({.epoch = kEpoch, .worker = 1, .dataset = 5, .box = whole, .chunk = kFirstCellChunk}, StatusCode::kInvalidArgument,
                "cells of a dataset that has none");
}

// Cells that lie on a disk: which fails, or does not answer before it is told to.
class CellsOnDisk : public GridCells {
 public:
  Result<Mesh> CellsIn(const Box& /*box*/) const override {
    ++asked_;
    answer_.wait();
    if (fails_) return Status::DataLoss("'cells' is damaged");
    return Mesh{.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, .tetrahedra = {{0, 1, 2, 3}}, .values = {1, 2, 3, 4}};
  }
  Status Visit(const std::function<void(const Mesh&)>& /*function*/) const override { return Status::Ok(); }
  CellRanges Ranges(const Index3& /*size*/) const override { return {}; }
  std::string Digest() const override { return ""; }
  std::uint64_t bytes() const override { return 0; }

  void Answer() { may_answer_.set_value(); }
  void Fail(bool fails) { fails_ = fails; }
  int asked() const { return asked_; }

 private:
  std::promise<void> may_answer_;
  const std::shared_future<void> answer_ = may_answer_.get_future();
  std::atomic<bool> fails_ = false;
  mutable std::atomic<int> asked_ = 0;
};

TEST_F(VoxelServerTest, CellsThatAreNotReadYetHoldUpNobodyElseAndAreReadOnce) {
  const Box box = volume_->block.box;
  const auto cells = std::make_shared<CellsOnDisk>();
  server_->Publish(8, {.volume = volume_, .cells = cells});
  const ChunkRequest of_cells{.epoch = kEpoch, .worker = 1, .dataset = 8, .box = box, .chunk = kFirstCellChunk};
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(worker_.Send({}, Encode(of_cells)).ok());
  const AnyMessage other = Ask({.epoch = kEpoch, .worker = 1, .dataset = 5, .box = box, .chunk = 0});
  ASSERT_TRUE(std::holds_alternative<Chunk>(other)) << NameOf(other);
  EXPECT_EQ(std::get<Chunk>(other).dataset, 5U);
  cells->Answer();
  const AnyMessage answer = Receive();
  ASSERT_TRUE(std::holds_alternative<Chunk>(answer)) << NameOf(answer);
  EXPECT_EQ(std::get<Chunk>(answer).dataset, 8U);
  const AnyMessage next = Ask({.epoch = kEpoch, .worker = 1, .dataset = 5, .box = box, .chunk = 1});
  ASSERT_TRUE(std::holds_alternative<Chunk>(next)) << NameOf(next);
  EXPECT_EQ(std::get<Chunk>(next).dataset, 5U) << "three requests that are the same have one answer";
  EXPECT_EQ(cells->asked(), 1);
}

TEST_F(VoxelServerTest, CellsThatCannotBeReadAreRefusedAndAskedForAnew) {
  const Box box = volume_->block.box;
  const auto cells = std::make_shared<CellsOnDisk>();
  cells->Answer();
  cells->Fail(true);
  server_->Publish(8, {.volume = volume_, .cells = cells});
  const ChunkRequest of_cells{.epoch = kEpoch, .worker = 1, .dataset = 8, .box = box, .chunk = kFirstCellChunk};
  ExpectRefused(of_cells, StatusCode::kDataLoss, "'cells' is damaged");
  cells->Fail(false);
  const AnyMessage answer = Ask(of_cells);
  ASSERT_TRUE(std::holds_alternative<Chunk>(answer)) << NameOf(answer);
  EXPECT_GT(std::get<Chunk>(answer).cell_bytes, 0U);
}

TEST_F(VoxelServerTest, RequestsThatCannotBeMetAreRefusedWithTheReason) {
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

TEST_F(VoxelServerTest, AConnectionThatAsksAndNeverReadsCostsLittleMemory) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "the address sanitizer keeps memory that was freed";
#endif
  constexpr int kRequests = 2000;
  const auto server = VoxelServer::Start(context_, {"tcp://127.0.0.1:*"}, kEpoch).value();
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

constexpr std::uint64_t kMost = std::uint64_t{1} << 30;

// Of a volume that is read as a whole.
Result<LoadedSource> LoadWhole(const DataSource& source) {
  Result<ReadableSource> read = ReadSource(source, kMost);
  if (!read.ok()) return read.status();
  return std::get<LoadedSource>(*std::move(read));
}

class CatalogueTest : public testing::Test {
 protected:
  void Touch(const std::string& name) { std::ofstream(directory_ / name) << "x"; }
  std::string Write(const std::string& name, int size) {
    const Volume volume = MakeSphere({.sphere_class = SphereClass::kFilled, .size = size, .occupancy = 0.3}).value();
    EXPECT_TRUE(WriteVolume(volume, (directory_ / name).string()).ok());
    return (directory_ / name).string();
  }
  static std::vector<std::string> NamesOf(const FoundData& found) {
    std::vector<std::string> names;
    for (const auto& [name, source] : found.datasets) names.push_back(name);
    return names;
  }
  void ExpectError(const std::vector<std::string>& arguments, StatusCode code, const std::string& reason) {
    const FoundData found = FindData(arguments);
    ASSERT_EQ(found.errors.size(), 1U) << reason;
    EXPECT_EQ(found.errors[0].code(), code) << found.errors[0].message();
    EXPECT_THAT(found.errors[0].message(), HasSubstr(reason));
    EXPECT_THAT(found.errors[0].message(), testing::StartsWith("--data "));
    EXPECT_THAT(found.errors[0].message(), testing::Not(HasSubstr("\n")));
  }
  TemporaryDirectory temporary_;
  const std::filesystem::path directory_ = temporary_.path();
};

TEST_F(CatalogueTest, NamesComeFromArgumentsAndStems) {
  Touch("head.nii.gz");
  Touch("foot.nrrd");
  Touch("notes.txt");
  Touch(".hidden.nrrd");
  const FoundData found = FindData({directory_.string() + "/", "other=" + (directory_ / "foot.nrrd").string()});
  EXPECT_THAT(found.errors, testing::IsEmpty());
  EXPECT_THAT(found.complaints, testing::IsEmpty());
  EXPECT_THAT(NamesOf(found), testing::ElementsAre("foot", "head", "other"));
  EXPECT_THAT(found.folders, testing::ElementsAre(directory_.string()));
  EXPECT_EQ(found.datasets.at("head").folder, directory_.string());
  EXPECT_EQ(found.datasets.at("other").folder, "");
  EXPECT_FALSE(ReadSource(found.datasets.at("head"), kMost).ok()) << "loading a file that is no volume fails when it is tried, not before";
}

TEST_F(CatalogueTest, WhatAFolderHoldsBeyondTheLimitIsLeftOut) {
  const std::string folder = directory_ / "many";
  std::filesystem::create_directory(folder);
  for (std::size_t i = 0; i < kMaxListed + 3; ++i) std::ofstream(folder + "/f" + std::to_string(i) + ".nrrd");
  const FoundData found = FindData({"last=" + folder + "/f0.nrrd", folder});
  EXPECT_THAT(found.errors, testing::IsEmpty());
  EXPECT_EQ(found.datasets.size(), kMaxListed);
  EXPECT_TRUE(found.datasets.contains("last"));
  EXPECT_THAT(found.complaints, testing::ElementsAre("4 volumes of folders are left out: the catalogue has at most 65536"));
}

TEST_F(CatalogueTest, AFolderThatNobodyTouchesNeedsNoSearch) {
  const std::string folder = directory_ / "watched";
  std::filesystem::create_directory(folder);
  std::ofstream(folder + "/a.nrrd") << "a";
  FolderMemory memory;
  const auto search = [&] { return ListFolder(folder); };
  const auto age = [&] {
    std::filesystem::last_write_time(folder, std::filesystem::file_time_type::clock::now() - std::chrono::minutes(1));
  };
  EXPECT_FALSE(memory.IsUnchanged(folder));
  ASSERT_TRUE(memory.Remember(folder, search).ok());
  EXPECT_FALSE(memory.IsUnchanged(folder)) << "it has just changed: another change might have the same time";
  age();
  ASSERT_TRUE(memory.Remember(folder, search).ok());
  EXPECT_TRUE(memory.IsUnchanged(folder));
  std::ofstream(folder + "/b.nrrd") << "b";
  EXPECT_FALSE(memory.IsUnchanged(folder));
  age();
  ASSERT_TRUE(memory.Remember(folder, search).ok());
  EXPECT_TRUE(memory.IsUnchanged(folder));
  std::filesystem::remove(folder + "/a.nrrd");
  EXPECT_FALSE(memory.IsUnchanged(folder));
  // What is in a subfolder, or behind a link, changes without a trace.
  std::filesystem::create_directory(folder + "/slices");
  age();
  ASSERT_TRUE(memory.Remember(folder, search).ok());
  EXPECT_FALSE(memory.IsUnchanged(folder));
}

TEST_F(CatalogueTest, BadArgumentsAreNamed) {
  Touch("head.nrrd");
  const std::string file = (directory_ / "head.nrrd").string();
  ExpectError({"a=" + file, "a=" + file}, StatusCode::kInvalidArgument, "already a dataset named \"a\"");
  ExpectError({"=" + file}, StatusCode::kInvalidArgument, "dataset name \"\"");
  ExpectError({"a/b=" + file}, StatusCode::kInvalidArgument, "dataset name \"a/b\"");
  ExpectError({std::string(257, 'a') + "=" + file}, StatusCode::kInvalidArgument, "1 to 256");
  ExpectError({"a="}, StatusCode::kInvalidArgument, "a path of 0 bytes, must have 1 to 4096");
  ExpectError({"a=/" + std::string(4096, 'p')}, StatusCode::kInvalidArgument, "a path of 4097 bytes");
  ExpectError({"a=" + file + ".missing"}, StatusCode::kNotFound, "does not exist");
  ExpectError({"missing"}, StatusCode::kNotFound, "does not exist");
  ExpectError({directory_.string(), directory_.string() + "/."}, StatusCode::kInvalidArgument, "the folder is given before it");
  EXPECT_EQ(FindData({"a=" + file + ".missing", "missing", "b=" + file}).errors.size(), 2U) << "each mistake is told";
}

TEST_F(CatalogueTest, EveryFileOfAFolderIsServed) {
  Touch("head.nii.gz");
  Touch("head.nrrd");
  Touch("a b.nrrd");
  Touch("Sch\u00e4del (2).nrrd");
  Touch("foot.nrrd");
  const FoundData found = FindData({"foot=" + (directory_ / "head.nrrd").string(), directory_.string()});
  EXPECT_THAT(found.errors, testing::IsEmpty());
  EXPECT_THAT(NamesOf(found), testing::ElementsAre("Sch_del_2", "a_b", "foot", "head", "head-2"));
  EXPECT_EQ(found.datasets.at("head-2").path, (directory_ / "head.nrrd").string());
  EXPECT_THAT(found.complaints,
              testing::ElementsAre(testing::AllOf(HasSubstr("foot.nrrd: left out"), HasSubstr("already a dataset named \"foot\"")),
                                   testing::AllOf(HasSubstr("head.nrrd: its dataset is named \"head-2\""), HasSubstr("another file"))));
  EXPECT_EQ(ListFolder(directory_.string())->datasets.at("head-2").path, found.datasets.at("head-2").path) << "the same at each search";
  std::filesystem::create_directory(directory_ / "empty");
  const FoundData empty = FindData({(directory_ / "empty").string()});
  EXPECT_THAT(empty.errors, testing::IsEmpty()) << "files may come";
  EXPECT_THAT(empty.complaints, testing::ElementsAre(HasSubstr("no volume file in this folder yet")));
}

TEST_F(CatalogueTest, WhatHasNoNameIsNamedAfterItsFile) {
  const std::string head = Write("head.nrrd", 8), layer = Write("layer.nrrd", 5);
  std::filesystem::create_directories(directory_ / "brain.ome.zarr");
  std::ofstream(directory_ / "brain.ome.zarr" / "zarr.json") << R"({"zarr_format": 3, "node_type": "group"})";
  std::filesystem::create_directory(directory_ / "other");
  std::filesystem::copy_file(head, directory_ / "other" / "head.nrrd");
  const FoundData found = FindData({head + "?spacing=1,1,2,labels=" + layer, (directory_ / "brain.ome.zarr").string(),
                                    (directory_ / "other" / "head.nrrd").string(), "last=" + head});
  EXPECT_THAT(found.errors, testing::IsEmpty());
  EXPECT_THAT(NamesOf(found), testing::ElementsAre("brain", "head", "head-2", "last"));
  EXPECT_THAT(found.folders, testing::IsEmpty()) << "a store is one volume";
  EXPECT_EQ(found.datasets.at("head").path, head + "?spacing=1,1,2");
  EXPECT_EQ(found.datasets.at("head").labels->path, layer + "?ids=yes");
  EXPECT_THAT(found.complaints, testing::ElementsAre(HasSubstr("named \"head-2\"")));
  ExpectError({(directory_ / "other").string() + ",labels=" + layer}, StatusCode::kInvalidArgument, "a folder to watch");
}

TEST_F(CatalogueTest, AFolderOfSlicesIsOneVolumeUntilOtherVolumesLieInIt) {
  Touch("1.tif");
  Touch("2.TIFF");
  const std::string name = directory_.filename().string();
  EXPECT_THAT(NamesOf(ListFolder(directory_.string()).value()), testing::ElementsAre(name));
  Touch("head.nrrd");
  EXPECT_THAT(NamesOf(ListFolder(directory_.string()).value()), testing::ElementsAre("1", "2", "head"));
  std::filesystem::remove_all(directory_);
  EXPECT_EQ(ListFolder(directory_.string()).status().code(), StatusCode::kNotFound);
}

TEST_F(CatalogueTest, AFolderOfNothingButFoldersHoldsAVolumeInEach) {
  for (const char* study : {"1.2.3", "1.2.4"}) {
    std::filesystem::create_directories(directory_ / study / "series");
    std::ofstream(directory_ / study / "series" / "image") << std::string(128, '\0') << "DICM";
  }
  std::filesystem::create_directory(directory_ / "empty");
  Touch(".hidden");
  EXPECT_THAT(NamesOf(ListFolder(directory_.string()).value()), testing::ElementsAre("1.2.3", "1.2.4"));
  const std::string study = (directory_ / "1.2.3").string();
  EXPECT_THAT(NamesOf(ListFolder(study).value()), testing::ElementsAre("series"));
  EXPECT_THAT(NamesOf(ListFolder(study + "/series").value()), testing::ElementsAre("series")) << "images are one volume";
}

TEST_F(CatalogueTest, ANamedVolumeIsCheckedAndReadWithItsOptions) {
  const std::string file = (directory_ / "times.raw").string();
  std::ofstream(file) << std::string(8, 'a') << std::string(8, 'b');
  FoundData found = FindData({"b=" + file + "?dims=2,2,2,type=uint8,offset=8", "none=" + file, "long=" + file + "?dims=9,9,9,type=uint8"});
  ASSERT_THAT(found.errors, testing::IsEmpty());
  CheckFiles(found);
  ASSERT_EQ(found.errors.size(), 2U);
  EXPECT_THAT(found.errors[0].message(), testing::AllOf(testing::StartsWith("dataset \"long\": "), HasSubstr("truncated")));
  EXPECT_THAT(found.errors[1].message(), testing::AllOf(testing::StartsWith("dataset \"none\": "), HasSubstr("--dims")));
  const Result<LoadedSource> loaded = LoadWhole(found.datasets.at("b"));
  ASSERT_TRUE(loaded.ok()) << loaded.status().message();
  EXPECT_THAT(loaded->volume->block.bytes, testing::AllOf(testing::SizeIs(8), testing::Each(std::byte{'b'})));
  ExpectError({"a=" + file + "?dims=2,2"}, StatusCode::kInvalidArgument, "dims");
  ExpectError({"a=" + file + "?depth=2"}, StatusCode::kInvalidArgument, "'depth' is no option");
  ExpectError({"a=" + file + ".missing?time=2"}, StatusCode::kNotFound, "does not exist");
}

TEST_F(CatalogueTest, TimesOfAFileAreDatasets) {
  const std::string file = (directory_ / "times.npy").string();
  const std::string header = "{'descr': '|u1', 'fortran_order': False, 'shape': (4, 2, 2, 2), }\n";
  std::ofstream(file) << "\x93NUMPY\x01" << '\0' << char(header.size()) << '\0' << header << "aaaaaaaabbbbbbbbccccccccdddddddd";
  FoundData found = FindData({"beat=" + file + "?spacing=1,1,2,time=1:3"});
  ASSERT_THAT(found.errors, testing::IsEmpty());
  CheckFiles(found);
  ASSERT_THAT(found.errors, testing::IsEmpty());
  EXPECT_THAT(NamesOf(found), testing::ElementsAre("beat@1", "beat@2", "beat@3"));
  const Result<LoadedSource> loaded = LoadWhole(found.datasets.at("beat@2"));
  ASSERT_TRUE(loaded.ok()) << loaded.status().message();
  EXPECT_THAT(loaded->volume->block.bytes, testing::Each(std::byte{'c'}));
  EXPECT_EQ(loaded->volume->description.geometry.spacing, (Vec3{1, 1, 2}));

  FoundData beyond = FindData({"beat=" + file + "?time=2:9", "one=" + file});
  CheckFiles(beyond);
  ASSERT_EQ(beyond.errors.size(), 1U) << "one error for all times";
  EXPECT_THAT(beyond.errors[0].message(), testing::AllOf(testing::StartsWith("dataset \"beat@4\": "), HasSubstr("must be in [0, 3]")));
  const Result<LoadedSource> first = LoadWhole(beyond.datasets.at("one"));
  ASSERT_TRUE(first.ok()) << first.status().message();
  EXPECT_THAT(first->volume->block.bytes, testing::Each(std::byte{'a'})) << "who names no time gets the first one";
  ExpectError({"beat=" + file + "?time=0:10000"}, StatusCode::kInvalidArgument, "time 0:10000 names 10001 volumes, limit 10000");
  ExpectError({"beat=" + file + "?time=3:2"}, StatusCode::kInvalidArgument, "FIRST must not be above LAST");
  ExpectError({"beat@1=" + file}, StatusCode::kInvalidArgument, "dataset name \"beat@1\" must have 1 to 256 letters");
  ExpectError({std::string(255, 'a') + "=" + file + "?time=0:3"}, StatusCode::kInvalidArgument, "has 257 bytes, limit 256");
}

TEST_F(CatalogueTest, FilesThatCannotBeReadAreToldByTheirHeaders) {
  const std::string whole = Write("whole.nrrd", 8);
  Touch("notes.txt");
  std::filesystem::create_directory(directory_ / "inbox");
  std::ofstream(directory_ / "inbox" / "short.nrrd") << "NRRD0004\ntype: uint8\ndimension: 3\nencoding: raw\nsizes: 9 9 9\n\nabc";
  FoundData found = FindData({"whole=" + whole, "text=" + (directory_ / "notes.txt").string(), (directory_ / "inbox").string()});
  ASSERT_THAT(found.errors, testing::IsEmpty());
  CheckFiles(found);
  ASSERT_EQ(found.errors.size(), 1U);
  EXPECT_THAT(found.errors[0].message(), testing::StartsWith("dataset \"text\": "));
  EXPECT_THAT(found.complaints, testing::ElementsAre(HasSubstr("short.nrrd: truncated")));
  EXPECT_EQ(found.datasets.size(), 3U) << "a file of a folder may still be on its way";
}

TEST_F(CatalogueTest, LayersFollowANamedVolume) {
  const std::string volume = Write("ball.nrrd", 8), layer = Write("layer.nrrd", 5);
  const DataArgument both = ParseDataArgument("a=" + volume + "?time=0,labels=" + layer + "?time=1:colours.txt,overlay=" + layer).value();
  EXPECT_EQ(both.path, volume + "?time=0");
  EXPECT_EQ(both.layers.labels + "|" + both.layers.label_colors, layer + "?time=1|colours.txt");
  EXPECT_EQ(both.layers.overlay, layer);
  EXPECT_EQ(ParseDataArgument("a=" + volume + ",overlay=x,labels=y").value().layers, (LayerFiles{.labels = "y", .overlay = "x"}));
  for (const std::string& wrong :
       std::vector<std::string>{"a=v,labels=", "a=v,labels=x,labels=y", "a=,labels=x", "a=v,overlay=" + std::string(5000, 'x')}) {
    EXPECT_EQ(ParseDataArgument(wrong).status().code(), StatusCode::kInvalidArgument) << wrong.substr(0, 40);
  }
  // Other labels, other ids; a layer that is replaced is noticed.
  const DataSource source = *DataSource(volume, "", {.labels = layer}).labels;
  const Result<LoadedSource> loaded = LoadWhole(source);
  ASSERT_TRUE(loaded.ok()) << loaded.status().message();
  ASSERT_NE(loaded->labels, nullptr);
  EXPECT_NE(IdOf("a", *loaded->volume, loaded->labels.get()), IdOf("a", *loaded->volume));
  EXPECT_FALSE(HaveChanged(*loaded->stamp).value());
  Write("layer.nrrd", 6);
  EXPECT_TRUE(HaveChanged(*loaded->stamp).value());
  const Result<LoadedSource> again = LoadWhole(source);
  EXPECT_NE(IdOf("a", *again->volume, again->labels.get()), IdOf("a", *loaded->volume, loaded->labels.get()));
  // An overlay is a field that is read from its own file.
  const DataSource with_overlay(volume, "", {.overlay = layer});
  const auto fields = FieldsOf(with_overlay, {});
  ASSERT_NE(fields, nullptr);
  ASSERT_EQ(fields->fields.size(), 2U);
  EXPECT_FALSE(fields->fields[1].channel || fields->fields[1].shown);
  EXPECT_EQ(AtFieldAndTime(with_overlay, *fields, 1, 0, nullptr).path, layer);
  EXPECT_EQ(AtFieldAndTime(with_overlay, *fields, 0, 0, nullptr).path, volume);
}

TEST_F(CatalogueTest, ALoadedFileHasAStampThatTellsOfEveryChange) {
  const std::string file = Write("ball.nrrd", 8);
  const DataSource source(file, "");
  const Result<LoadedSource> loaded = LoadWhole(source);
  ASSERT_TRUE(loaded.ok()) << loaded.status().message();
  ASSERT_NE(loaded->stamp, nullptr);
  EXPECT_FALSE(HaveChanged(*loaded->stamp).value());
  Write("ball.nrrd", 9);  // in its place
  EXPECT_TRUE(HaveChanged(*loaded->stamp).value());
  EXPECT_EQ(LoadWhole(source)->volume->description.geometry.size, (Index3{9, 9, 9}));
  std::filesystem::remove(file);
  EXPECT_EQ(HaveChanged(*loaded->stamp).status().code(), StatusCode::kNotFound);
}

// Readers see the old bytes, the new ones, or an error that says why: never both.
TEST_F(CatalogueTest, AFileThatIsWrittenAgainAndAgainIsReadAsAWholeOrNotAtAll) {
  constexpr int kSide = 64;
  const std::string file = (directory_ / "grey.nrrd").string();
  const std::string header = "NRRD0004\ntype: uint8\ndimension: 3\nencoding: raw\nsizes: 64 64 64\n\n";
  // A writer that rests leaves a file of which nothing tells that it is half written. One that waits for a busy machine rests, too.
  constexpr std::chrono::milliseconds kLongestWait(20);  // less than what the catalogue takes for rest
  std::atomic<int> slices = 0, rests = 0;
  std::chrono::steady_clock::time_point last = std::chrono::steady_clock::now();
  const auto write = [&](char value) {
    std::ofstream out(file, std::ios::binary | std::ios::in | std::ios::out);  // over the old bytes
    if (!out) out.open(file, std::ios::binary);
    out << header;
    for (int slice = 0; slice < kSide; ++slice) {
      out << std::string(kSide * kSide, value) << std::flush;
      const auto now = std::chrono::steady_clock::now();
      if (now - std::exchange(last, now) > kLongestWait) ++rests;
      ++slices;
    }
  };
  write(0);
  std::atomic<bool> done = false;
  std::jthread writer([&] {
    for (char value = 1; !done; value = char(value % 100 + 1)) write(value);
  });
  const auto is_whole = [](const LoadedSource& loaded) {
    const auto& bytes = loaded.volume->block.bytes;
    return std::ranges::all_of(bytes, [&](std::byte byte) { return byte == bytes[0]; });
  };
  int told = 0;
  for (int i = 0; i < 20; ++i) {
    const int rests_before = rests;
    const Result<LoadedSource> loaded = LoadWhole(DataSource(file, ""));
    if (loaded.ok()) {
      for (const int seen = slices; slices == seen;) std::this_thread::yield();  // the writer has counted a rest that it had meanwhile
      EXPECT_TRUE(is_whole(*loaded) || rests > rests_before) << "bytes of two files";
      continue;
    }
    EXPECT_EQ(loaded.status().code(), StatusCode::kUnavailable);
    EXPECT_THAT(loaded.status().message(), HasSubstr("is being written"));
    ++told;
  }
  EXPECT_GT(told, 0) << "the writer was never met at work";
  done = true;
  writer.join();
  const Result<LoadedSource> loaded = LoadWhole(DataSource(file, ""));
  ASSERT_TRUE(loaded.ok()) << loaded.status().message();
  EXPECT_TRUE(is_whole(*loaded));
}

}  // namespace
}  // namespace slabstream
