// DICOM as users have it: folders of series, at the command line and at a service.
#include <gmock/gmock.h>

#include <filesystem>
#include <string>
#include <vector>

#include "common/json/json.h"
#include "tests/data/volume_io/dicom_files.h"
#include "tests/end_to_end/picture_file.h"
#include "tests/end_to_end/program.h"

namespace slabstream {
namespace {

class DicomTest : public EndToEndTest {
 protected:
  // A block in a box, stored sagittally, with slices from left to right.
  DicomTest() {
    Object body{.size = {16, 14, 12}, .steps = {Vec3{2, 0, 0}, Vec3{0, 1.5, 0}, Vec3{0, 0, 3}}, .origin = {}, .value = {}};
    body.value = [](const Index3& at) -> std::uint8_t {
      if (at.x >= 11 && at.y >= 9 && at.z >= 8) return 250;
      return at.x > 2 && at.y > 3 && at.z > 1 && at.z < 10 ? std::uint8_t(60 + 3 * at.x + at.z) : 0;
    };
    stored_ = StoredAs(body, {{1, 2, 0}, {true, true, true}});
    const DicomValues patient = {{0x00100010, "Doe^Jane"}, {0x00100020, "ID4711"}, {0x00100030, "19700102"}};
    std::filesystem::create_directory(Path("study"));
    WriteSeries(Path("study"), stored_, SampleType::kUint8, patient);
    WriteFile(Path("body.nrrd"), NrrdFile(stored_));
  }
  // Adds a series in a sub-folder.
  void AddSecondSeries() const {
    std::filesystem::create_directory(Path("study/2"));
    Stored thin = stored_;
    thin.size.z = 2;
    WriteSeries(Path("study/2"), thin, SampleType::kUint8,
                {{kTagSeriesUid, "1.2.4"}, {kTagSeriesNumber, "2"}, {kTagSeriesDescription, "THIN"}});
  }
  PictureFile Render(const std::string& volume, std::vector<std::string> more) const {
    std::vector<std::string> arguments = {"render", volume, "-o", Path("picture.png"), "--size", "64", "--azimuth", "200"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    MustRun(arguments);
    return ReadPicture(Path("picture.png"));
  }
  Stored stored_;
};

TEST_F(DicomTest, IsThePictureOfTheSameObjectAsNrrd) {
  for (const char* renderer : {"splat", "zbuffer", "raycast"}) {
    const PictureFile picture = Render("study", {"--local=2", "--renderer", renderer});
    EXPECT_GT(*std::ranges::max_element(picture.samples), 0.5);
    EXPECT_EQ(LargestDifference(picture, Render("body.nrrd", {"--local=2", "--renderer", renderer})), 0) << renderer;
  }
}

TEST_F(DicomTest, OfSeveralSeriesIsChosenByTheUser) {
  AddSecondSeries();
  const ProgramResult refused = Slabstream({"render", "study", "--local=1", "-o", "x.png"});
  EXPECT_EQ(refused.exit_status, 2);
  ASSERT_EQ(refused.err_lines().size(), 1U);
  EXPECT_THAT(refused.err, AllOf(HasSubstr("2 series"), HasSubstr("--series"), HasSubstr("THIN")));
  const PictureFile expected = Render("body.nrrd", {"--local=1"});
  EXPECT_EQ(LargestDifference(Render("study", {"--local=1", "--series", "1"}), expected), 0);
  EXPECT_EQ(LargestDifference(Render("study?series=1.2.3", {"--local=1"}), expected), 0);

  const std::string endpoint = "ipc://" + Path("s");
  MustRun({"up", "--detach", "--workers", "1", "--listen", endpoint, "--data", "body=study?series=1"});
  EXPECT_EQ(LargestDifference(Render("body", {"--endpoint", endpoint}), expected), 0);
  const ProgramResult unclear = Slabstream({"up", "--detach", "--listen", "ipc://" + Path("t"), "--data", "all=study"});
  EXPECT_EQ(unclear.exit_status, 2);
  EXPECT_THAT(unclear.err, AllOf(HasSubstr("dataset \"all\""), HasSubstr("choose one")));
  MustRun({"down", "--endpoint", endpoint});
}

TEST_F(DicomTest, IsListedWithoutThePatient) {
  for (const bool several : {false, true}) {
    if (several) AddSecondSeries();
    const std::string text = MustRun({"info", "study"}).out, json = MustRun({"info", "study", "--json"}).out;
    EXPECT_THAT(text, AllOf(HasSubstr("CT"), HasSubstr("14 x 12 x 16"), HasSubstr("1.5 x 3 x 2"), HasSubstr("1.2.3"), HasSubstr("HEAD")));
    EXPECT_EQ(text.find("--series") != std::string::npos, several);
    const auto series = Json::Parse(json).value().at("series");
    ASSERT_EQ(series.size(), several ? 2U : 1U);
    EXPECT_EQ(series[0]["uid"], "1.2.3");
    EXPECT_EQ(series[0]["size"], (Json{14, 12, 16}));
    for (const std::string& output : {text, json}) {
      EXPECT_THAT(output, AllOf(Not(HasSubstr("Doe")), Not(HasSubstr("Jane")), Not(HasSubstr("4711")), Not(HasSubstr("1970"))));
    }
  }
  EXPECT_THAT(MustRun({"info", "study", "--series", "2"}).out, HasSubstr("size "));
}

TEST_F(DicomTest, ThatIsWrongIsOneLine) {
  const std::vector<std::string> files = [&] {
    std::vector<std::string> found;
    for (const auto& entry : std::filesystem::directory_iterator(Path("study"))) found.push_back(entry.path());
    return found;
  }();
  const std::string whole = slabstream::ReadFile(files.front());
  const auto expect = [&](const std::string& word) {
    const ProgramResult result = Slabstream({"render", "study", "--local=1", "-o", "x.png"});
    EXPECT_EQ(result.exit_status, 2) << word;
    EXPECT_EQ(result.err_lines().size(), 1U) << result.err;
    EXPECT_THAT(result.err, HasSubstr(word));
  };
  slabstream::WriteFile(files.front(), whole.substr(0, whole.size() - 60));
  expect("truncated");
  slabstream::WriteFile(files.front(), whole.substr(0, 300));
  expect("truncated or damaged at byte");
  std::filesystem::remove(files.front());
  for (const std::string& file : files) {
    if (std::filesystem::exists(file) && file.ends_with("_7")) std::filesystem::remove(file);
  }
  expect("missing");
  EXPECT_THAT(Slabstream({"render", files.back(), "--local=1", "-o", "x.png"}).err, HasSubstr("the folder of a series is read as a whole"));
}

}  // namespace
}  // namespace slabstream
