// Datasets of a service of real processes, while it runs: files that change, come and go, and orders to add, remove and reload. Each
// picture is that of one file.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>

#include "data/catalogue/catalogue.h"
#include "data/volume_io/volume_writer.h"
#include "tests/service/multi_process_fixture.h"
#include "tests/support/whole_file.h"

namespace slabstream {
namespace {

using testing::ElementsAre;

class DatasetsTest : public MultiProcessTest {
 protected:
  void SetUp() override {
    std::filesystem::create_directory(folder_);
    StartCoordinator("tcp://127.0.0.1:*", "tcp://127.0.0.1:*", {"--data", folder_.string()});
    for (int i = 0; i < 3; ++i) StartWorker();
    client_.emplace(Connect());
    AwaitWorkers(*client_, workers_.size());
  }

  static std::shared_ptr<const Volume> Sphere(int size) {
    return std::make_shared<const Volume>(MakeSphere({.sphere_class = SphereClass::kFilled, .size = size, .occupancy = 0.2}).value());
  }
  // Puts the volume in the place of the file, as a whole.
  static void Replace(const std::filesystem::path& file, const Volume& volume) {
    const Status written = WriteVolume(volume, file.string());
    ASSERT_TRUE(written.ok()) << written.message();
  }
  FrameRequest RequestOf(const std::string& dataset) const {
    FrameRequest request = TestRequest(ZBuffer(), 30, 3);  // pictures are the same bit for bit
    request.dataset = dataset;
    return request;
  }
  bool Shows(const PictureImage& picture, const Volume& volume) const {
    const FrameRequest request = RequestOf("ball");
    return LargestDifference(picture, RenderDirectly(request, volume), request.size) <= AllowedDifference(request);
  }
  void ExpectShows(const std::string& dataset, const Volume& volume) {
    const Result<Picture> picture = client_->Render(RequestOf(dataset));
    ASSERT_TRUE(picture.ok()) << picture.status().message();
    EXPECT_TRUE(Shows(picture->image, volume)) << dataset;
  }
  Status FailureOf(const std::string& dataset) { return client_->Render(RequestOf(dataset)).status(); }
  std::vector<std::string> Names() {
    const std::vector<DatasetStatus> datasets = client_->OrderData({}).value();
    std::vector<std::string> names;
    for (const DatasetStatus& dataset : datasets) names.push_back(dataset.name);
    return names;
  }
  Result<std::vector<DatasetStatus>> Order(DataAction action, const std::vector<std::string>& items) {
    return client_->OrderData({.action = action, .items = items});
  }

  const std::filesystem::path file_ = directory_ / "ball.nrrd", folder_ = directory_ / "inbox";
  std::optional<Client> client_;
};

TEST_F(DatasetsTest, AReplacedFileIsSeenByTheNextFrame) {
  ExpectShows("ball", *volume_);
  for (const int size : {40, 52, 64}) {
    const auto next = Sphere(size);
    Replace(file_, *next);
    ExpectShows("ball", *next);
  }
  EXPECT_EQ(client_->QueryStatus()->frames_failed, 0U);
}

// Labels on the ball, in x-slices of this width.
TEST_F(DatasetsTest, LayersOfADatasetAreThoseOfTheirFiles) {
  const auto labels_of = [&](std::int32_t width) {
    Volume labels{volume_->description, MakeVoxelBlock(volume_->block.box, ScalarType::kUint8)};
    labels.description.type = ScalarType::kUint8;
    for (Index3 v; v.z < 64; ++v.z) {
      for (v.y = 0; v.y < 64; ++v.y) {
        for (v.x = 0; v.x < 64; ++v.x) labels.block.samples<std::uint8_t>()[labels.block.Offset(v)] = std::uint8_t(1 + v.x / width % 2);
      }
    }
    return labels;
  };
  const std::filesystem::path labels = directory_ / "labels.nrrd", table = directory_ / "table.txt";
  Replace(labels, labels_of(32));
  std::ofstream(table) << "1 left 255 0 0 0\n2 right 0 255 0 0\n";
  const std::string source = file_.string() + ",labels=" + labels.string() + ":" + table.string();
  ASSERT_TRUE(Order(DataAction::kAdd, {"layered=" + source}).ok());

  FrameRequest request = TestRequest(FindRenderer("raycast"), 30, 3);
  request.dataset = "layered";
  ShownLabels(request) = {.mode = LabelMode::kTint, .tint = 1};
  request.shading.model = ShadingModel::kNone;
  // What the picture is, by definition: from the same files, in one box.
  const auto expected = [&] {
    const DataSource files("", "", {.labels = labels.string(), .label_colors = table.string()});
    const LoadedSource read = std::get<LoadedSource>(ReadSource(*files.labels, std::uint64_t{1} << 30).value());
    auto summary = std::make_shared<VolumeSummary>(Summarize(*read.volume));
    summary->labels = read.labels;
    const ShownFields fields{.others = {{.number = 1, .labels = true, .levels = {{2, summary}}, .of_volume = {0}}}};
    const auto of_volume = std::make_shared<const VolumeSummary>(Summarize(*volume_));
    const FrameSetup setup = MakeFrameSetup(ResolveRequest(request, 1, of_volume, fields).value()).value();
    BoxData data(CutBlock(volume_->block, volume_->block.box)), of_labels{BrickedVoxels(read.volume->block)};
    data.SetFields({&of_labels});
    RankReport report;
    LocalImage frame = MakeRenderer(*setup.renderer)->Render(data, volume_->block.box, setup, {}, RenderControl(), report).value();
    return FinishPicture(frame, setup);
  };
  const auto expect_shows = [&](const LocalImage& image) {
    const Result<Picture> picture = client_->Render(request);
    ASSERT_TRUE(picture.ok()) << picture.status().message();
    EXPECT_LE(LargestDifference(picture->image, image, request.size), AllowedDifference(request));
  };
  const LocalImage first = expected();
  expect_shows(first);
  const std::vector<DatasetStatus> datasets = client_->OrderData({}).value();
  for (const DatasetStatus& dataset : datasets) EXPECT_EQ(dataset.fields && dataset.fields->labels(), dataset.name == "layered");

  // Another file, then other colours: the next frame has them.
  Replace(labels, labels_of(16));
  const LocalImage second = expected();
  EXPECT_GT(LargestDifference(first, second, request.size), 0.1);
  expect_shows(second);
  std::ofstream(table) << "1 left 0 0 255 0\n2 right 0 255 0 0\n";
  const LocalImage third = expected();
  EXPECT_GT(LargestDifference(second, third, request.size), 0.1);
  expect_shows(third);

  // Layers that there are not are refused in one line.
  FrameRequest overlay = request;
  overlay.fields = {{.field = "overlay"}};
  EXPECT_THAT(client_->Render(overlay).status().message(), testing::HasSubstr("dataset \"layered\" has no field 'overlay'"));
  request.dataset = "ball";
  EXPECT_THAT(client_->Render(request).status().message(), testing::HasSubstr("dataset \"ball\" has no labels"));
  request.dataset = "layered";
  ShownLabels(request).shown = {{3, 9}};
  EXPECT_THAT(client_->Render(request).status().message(), testing::HasSubstr("no label from 3 to 9; it has 2 from 1 to 2"));
  ShownLabels(request).shown = {{.name = "none*"}};
  EXPECT_THAT(client_->Render(request).status().message(),
              testing::HasSubstr("labels.shown: no label is named 'none*'; there are left, right"));
  // By name as by number.
  const auto shown = [&](LabelRange range, LabelMode mode) {
    ShownLabels(request) = {.mode = mode, .tint = 1, .shown = {std::move(range)}};
    return client_->Render(request).value().image;
  };
  for (const LabelMode mode : {LabelMode::kTint, LabelMode::kSurface, LabelMode::kHighlight}) {
    const PictureImage by_number = shown({2, 2}, mode);
    EXPECT_LE(LargestDifference(shown({.name = "right"}, mode), by_number, request.size), AllowedDifference(request));
    EXPECT_LE(LargestDifference(shown({.name = "*ght"}, mode), by_number, request.size), AllowedDifference(request));
    EXPECT_GT(LargestDifference(shown({.name = "l*"}, mode), by_number, request.size), 0.1);
  }
  request.renderer = "splat";
  ShownLabels(request).shown.clear();
  EXPECT_THAT(client_->Render(request).status().message(), testing::HasSubstr("labels needs one of: raycast, zbuffer"));
  EXPECT_FALSE(Order(DataAction::kAdd, {"wrong=" + file_.string() + ",labels=" + (directory_ / "none.nrrd").string()}).ok());
}

TEST_F(DatasetsTest, FramesInFlightShowTheOldFileOrTheNewOne) {
  std::vector<std::shared_ptr<const Volume>> volumes = {volume_};
  for (const int size : {40, 44, 48, 52, 56}) volumes.push_back(Sphere(size));
  ExpectShows("ball", *volume_);
  constexpr int kFrames = 60, kInFlight = 6;
  std::map<RequestId, std::size_t> open;  // the file when it was submitted
  std::set<std::size_t> shown;
  std::size_t file = 0;
  for (int submitted = 0, ended = 0; ended < kFrames;) {
    for (; submitted < kFrames && int(open.size()) < kInFlight; ++submitted) {
      if (submitted % 10 == 5 && file + 1 < volumes.size()) Replace(file_, *volumes[++file]);
      if (submitted % 20 == 15) {
        ASSERT_TRUE(Order(DataAction::kReload, {"ball"}).ok());
      }
      open.emplace(client_->Submit(RequestOf("ball")), file);
    }
    const std::optional<ClientEvent> event = client_->Next(seconds(60));
    ASSERT_TRUE(event.has_value());
    const auto request = open.find(event->request);
    ASSERT_TRUE(request != open.end());
    if (const auto* failure = std::get_if<Status>(&event->what)) FAIL() << failure->message();
    const auto* picture = std::get_if<Picture>(&event->what);
    if (picture == nullptr) continue;
    // Of the file as it was when the frame was asked for, or of a later one.
    const auto of = std::find_if(volumes.begin() + std::ptrdiff_t(request->second), volumes.begin() + std::ptrdiff_t(file) + 1,
                                 [&](const auto& volume) { return Shows(picture->image, *volume); });
    EXPECT_TRUE(of != volumes.begin() + std::ptrdiff_t(file) + 1) << "a picture of an older file, or of two files";
    shown.insert(std::size_t(of - volumes.begin()));
    open.erase(request);
    ++ended;
  }
  EXPECT_GE(shown.size(), 3U) << "the file has hardly been replaced while frames were rendered";
  ExpectShows("ball", *volumes[file]);
  AwaitStatus(*client_, [](const StatusReply& status) { return status.running == 0; });
}

TEST_F(DatasetsTest, ARemovedDatasetEndsWhatRunsAndRefusesWhatComes) {
  ExpectShows("ball", *volume_);
  std::set<RequestId> open;
  for (int i = 0; i < 20; ++i) open.insert(client_->Submit(RequestOf("ball")));
  ASSERT_TRUE(Order(DataAction::kRemove, {"ball"}).ok());
  while (!open.empty()) {
    const std::optional<ClientEvent> event = client_->Next(seconds(60));
    ASSERT_TRUE(event.has_value());
    if (const auto* picture = std::get_if<Picture>(&event->what)) {
      EXPECT_TRUE(Shows(picture->image, *volume_));
      open.erase(event->request);
    } else if (const auto* failure = std::get_if<Status>(&event->what)) {
      EXPECT_THAT(failure->message(), HasSubstr("dataset \"ball\" is not in the catalogue any more: an admin has removed it"));
      open.erase(event->request);
    }
  }
  EXPECT_THAT(FailureOf("ball").message(), HasSubstr("no dataset \"ball\""));
  EXPECT_EQ(client_->QueryStatus()->refused.unknown_dataset, 1U);
}

TEST_F(DatasetsTest, OrdersAddRemoveAndReload) {
  const auto other = Sphere(40);
  const std::string path = (directory_ / "other.nrrd").string();
  Replace(path, *other);
  EXPECT_THAT(Names(), ElementsAre("ball"));
  ASSERT_TRUE(Order(DataAction::kAdd, {"other=" + path}).ok());
  EXPECT_THAT(Names(), ElementsAre("ball", "other"));
  ExpectShows("other", *other);
  ASSERT_TRUE(Order(DataAction::kReload, {"other"}).ok());
  ExpectShows("other", *other);
  const std::vector<DatasetStatus> list = client_->OrderData({}).value();
  EXPECT_EQ(list[1].state, DatasetState::kReady);
  EXPECT_EQ(list[1].description, other->description);
  ASSERT_TRUE(Order(DataAction::kRemove, {"other"}).ok());
  EXPECT_THAT(Names(), ElementsAre("ball"));

  const std::string text = (directory_ / "notes.txt").string();
  std::ofstream(text) << "no volume";
  const std::pair<std::string, std::string> refused[] = {
      {"other=" + path + ".missing", "does not exist (paths are those of the coordinator's host, "},
      {"other=other.nrrd", "the path must be absolute"},
      {"a/b=" + path, "dataset name \"a/b\""},
      {"ball=" + path, "there is already a dataset named \"ball\""},
      {"text=" + text, "not a volume"},
      {"other=/" + std::string(4096, 'p'), "a path of 4097 bytes, must have 1 to 4096"},
  };
  for (const auto& [item, why] : refused) {
    const Status status = Order(DataAction::kAdd, {item}).status();
    EXPECT_FALSE(status.ok()) << item;
    EXPECT_THAT(status.message(), HasSubstr(why));
    EXPECT_THAT(status.message(), testing::Not(HasSubstr("\n")));
  }
  EXPECT_THAT(Names(), ElementsAre("ball"));
}

TEST_F(DatasetsTest, FilesOfAWatchedFolderComeChangeAndGo) {
  const auto first = Sphere(40), second = Sphere(44);
  EXPECT_THAT(FailureOf("new").message(), HasSubstr("no dataset \"new\""));
  Replace(folder_ / "new.nrrd", *first);
  ExpectShows("new", *first);  // nobody has to wait for the next look at the folder
  Replace(folder_ / "new.nrrd", *second);
  ExpectShows("new", *second);
  Replace(folder_ / "more.nrrd", *first);
  EXPECT_THAT(Names(), ElementsAre("ball", "more", "new"));
  std::filesystem::remove(folder_ / "new.nrrd");
  EXPECT_FALSE(FailureOf("new").ok());
  EXPECT_THAT(Names(), ElementsAre("ball", "more"));
  // A folder that is renamed, as when a file system is not there for a while, takes nothing away.
  std::filesystem::rename(folder_, directory_ / "away");
  EXPECT_THAT(Names(), ElementsAre("ball", "more"));
  std::filesystem::rename(directory_ / "away", folder_);
  ExpectShows("more", *first);
}

TEST_F(DatasetsTest, AFileThatIsNotThereAsAWholeIsAnErrorUntilItIs) {
  Replace(directory_ / "whole.nrrd", *volume_);
  const std::string whole = ReadFile(directory_ / "whole.nrrd");
  std::ofstream file(folder_ / "slow.nrrd", std::ios::binary);
  file << whole.substr(0, whole.size() / 2) << std::flush;
  const Status status = FailureOf("slow");
  EXPECT_EQ(status.code(), StatusCode::kDataLoss) << status.message();
  EXPECT_THAT(status.message(), HasSubstr("slow.nrrd"));
  file << whole.substr(whole.size() / 2) << std::flush;
  ExpectShows("slow", *volume_);
  EXPECT_EQ(client_->QueryStatus()->frames_failed, 1U);
}

}  // namespace
}  // namespace slabstream
