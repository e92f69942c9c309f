// `measure`: figures of balls and of a patient's grid that are known without it.
#include <gmock/gmock.h>

#include <cmath>
#include <fstream>

#include "common/json/json.h"
#include "tests/end_to_end/program.h"

namespace slabstream {
namespace {

class MeasureTest : public EndToEndTest {
 protected:
  // 4 x 3 x 2 voxels of a patient with the value x + 10 y + 100 z, spaced 2, 3 and 5 mm; voxel 0 0 0 is at 10, 20, 30.
  MeasureTest() {
    std::ofstream file(Path("ramp.nrrd"), std::ios::binary);
    file << "NRRD0004\ntype: uint8\ndimension: 3\nspace: right-anterior-superior\nsizes: 4 3 2\n"
            "space directions: (2,0,0) (0,3,0) (0,0,5)\nspace origin: (10,20,30)\nencoding: raw\n\n";
    for (int z = 0; z < 2; ++z) {
      for (int y = 0; y < 3; ++y) {
        for (int x = 0; x < 4; ++x) file.put(char(x + 10 * y + 100 * z));
      }
    }
  }

  Json Measure(std::vector<std::string> more) const {
    more.insert(more.begin(), {"measure", "ramp.nrrd", "--local=1", "--json"});
    return Json::Parse(MustRun(more).out).value();
  }
};

TEST_F(MeasureTest, DistancesAndAnglesAreThoseOfTheWorld) {
  const Json found = Measure({"--distance", "1,2,3:4,6,15", "--angle", "1,0,0:0,0,0:0,2,0", "--angle", "1,0,0:0,0,0:-1,0,0"});
  ASSERT_EQ(found.size(), 3U);
  EXPECT_EQ(found[0]["length"], 13);
  EXPECT_EQ(found[0]["unit"], "mm");
  EXPECT_NEAR(found[1]["degrees"].get<double>(), 90, 1e-9);
  EXPECT_NEAR(found[2]["degrees"].get<double>(), 180, 1e-9);
  EXPECT_THAT(MustRun({"measure", "ramp.nrrd", "--local=1", "--distance", "0,0,0:0,3,4"}).out, HasSubstr("distance 5 mm\n"));
}

TEST_F(MeasureTest, ProfilesInterpolateBetweenVoxels) {
  const Json found = Measure({"--profile", "10,20,30:16,26,35", "--samples", "5"});
  const Json& values = found[0]["values"];
  ASSERT_EQ(values.size(), 5U);
  for (int i = 0; i < 5; ++i) EXPECT_NEAR(values[i].get<double>(), (3 + 20 + 100) * i / 4.0, 1e-9) << i;
  EXPECT_NEAR(found[0]["length"].get<double>(), std::sqrt(36 + 36 + 25), 1e-12);
  const Json beyond = Measure({"--profile", "0,20,30:10,20,30", "--samples", "2"})[0]["values"];
  EXPECT_TRUE(beyond[0].is_null());
  EXPECT_EQ(beyond[1], 0);
}

TEST_F(MeasureTest, BoxesHaveTheMeanAndDeviationOfTheirVoxels) {
  const Json all = Measure({"--box", ":,:,:"})[0];
  EXPECT_EQ(all["voxels"], 24);
  EXPECT_EQ(all["volume"], 24 * 2 * 3 * 5);
  EXPECT_EQ(all["unit"], "mm^3");
  EXPECT_NEAR(all["mean"].get<double>(), 1.5 + 10 + 50, 1e-9);
  EXPECT_NEAR(all["deviation"].get<double>(), std::sqrt(1.25 + 200 / 3.0 + 2500), 1e-9);
  EXPECT_EQ(all["least"], 0);
  EXPECT_EQ(all["largest"], 123);
  for (const char* box : {"1:3,:,0:1v", "11:15,:,:31", "25:75,:,:50%"}) {
    const Json part = Measure({"--box", box})[0];
    EXPECT_EQ(part["voxels"], 6) << box;
    EXPECT_NEAR(part["mean"].get<double>(), 11.5, 1e-9) << box;
  }
  const Json none = Measure({"--box", "100:200,:,:"})[0];
  EXPECT_EQ(none["voxels"], 0);
  EXPECT_TRUE(none["mean"].is_null());
}

// The ramp is its own labels: each value but 0 is one.
TEST_F(MeasureTest, EachLabelHasItsVolumeAndValues) {
  const Json found = Measure({"--labels", "ramp.nrrd"})[0];
  EXPECT_EQ(found["unit"], "ml");
  ASSERT_EQ(found["labels"].size(), 23U);
  for (const Json& label : found["labels"]) {
    EXPECT_EQ(label["voxels"], 1);
    EXPECT_DOUBLE_EQ(label["volume"].get<double>(), 2 * 3 * 5 / 1000.0);
    for (const char* field : {"mean", "least", "largest"}) EXPECT_EQ(label[field], label["value"]) << field;
  }
  const std::string table = MustRun({"measure", "ramp.nrrd", "--local=1", "--labels", "ramp.nrrd", "--csv"}).out;
  EXPECT_THAT(table, HasSubstr("value,name,volume (ml),voxels,non_finite,mean,deviation,least,largest\r\n1,,0.03,1,0,1,0,1,1\r\n"));
}

TEST_F(MeasureTest, RefusesWhatIsNoMeasure) {
  ExpectEachRefused({"measure", "ramp.nrrd", "--local=1"},
                    {{{}, "--distance, --angle, --profile, --box or --labels must say what to measure"},
                     {{"--labels"}, "dataset \"volume\" has no labels to measure: --labels FILE"},
                     {{"--csv", "--box", ":,:,:"}, "--csv is the table of --labels"},
                     {{"--distance", "1,2,3"}, "--distance '1,2,3' is not X,Y,Z:X,Y,Z"},
                     {{"--angle", "1,2,3:1,2,3"}, "is not X,Y,Z:X,Y,Z:X,Y,Z"},
                     {{"--angle", "1,2,3:1,2,3:4,5,6"}, "two of its points are the same"},
                     {{"--profile", "1,2:3,4,5"}, "--profile '1,2' is not X,Y,Z"},
                     {{"--box", "1:2,3:4"}, "--box '1:2,3:4' is not X0:X1,Y0:Y1,Z0:Z1"}});
}

}  // namespace
}  // namespace slabstream
