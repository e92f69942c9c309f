// Pictures of datasets with several channels and times, as users ask for them. The blobs are analytic, and so is what follows from them.
#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>

#include "common/json/json.h"
#include "tests/end_to_end/picture_file.h"
#include "tests/end_to_end/program.h"

namespace slabstream {
namespace {

constexpr int kSide = 24, kChannels = 2, kTimes = 3;
const std::vector<std::string> kShadows = {"--shadows", "1", "--ambient-occlusion", "1"};

// The sample at x, y, z of a channel at a time.
using Sample = std::function<int(int channel, int time, double x, double y, double z)>;

// A blob for each channel; they overlap, and the second one moves along x.
int Blob(int channel, int time, double x, double y, double z) {
  const double at = channel == 0 ? 9 : 11 + 2 * time;
  return int(200 * std::exp(-((x - at) * (x - at) + (y - 11) * (y - 11) + (z - 12) * (z - 12)) / 30));
}

class FieldsTest : public EndToEndTest {
 protected:
  // An OME-Zarr of uint8: a chunk for each channel and time. `omero`: what it says of channels.
  void MakeStore(const std::string& name, const Sample& sample, const std::string& omero) {
    std::filesystem::create_directories(Path(name + "/0"));
    std::ofstream(Path(name + "/.zgroup")) << R"({"zarr_format": 2})";
    std::ofstream(Path(name + "/.zattrs"))
        << R"({"multiscales": [{"version": "0.4", "axes": [{"name": "t", "type": "time", "unit": "second"},
        {"name": "c", "type": "channel"}, {"name": "z", "type": "space"}, {"name": "y", "type": "space"}, {"name": "x", "type": "space"}],
        "datasets": [{"path": "0", "coordinateTransformations": [{"type": "scale", "scale": [2.5, 1, 1, 1, 1]}]}]}],
        "omero": {"channels": [)"
        << omero << "]}}";
    std::ofstream(Path(name + "/0/.zarray")) << R"({"zarr_format": 2, "shape": [3, 2, 24, 24, 24], "chunks": [1, 1, 24, 24, 24],
        "dtype": "|u1", "compressor": null, "filters": null, "fill_value": 0, "order": "C"})";
    for (int time = 0; time < kTimes; ++time) {
      for (int channel = 0; channel < kChannels; ++channel) {
        std::string samples;
        for (int i = 0; i < kSide * kSide * kSide; ++i) {
          samples += char(sample(channel, time, i % kSide, i / kSide % kSide, i / kSide / kSide));
        }
        std::ofstream(Path(name + "/0/" + std::to_string(time) + "." + std::to_string(channel) + ".0.0.0"), std::ios::binary) << samples;
      }
    }
  }
  // The picture with these options, in this process.
  auto Rendered(const std::string& source, const std::vector<std::string>& more = {}, const std::string& local = "--local=1") {
    const std::string file = "p" + std::to_string(pictures_++) + ".png";
    std::vector<std::string> arguments = {"render", source, local, "--size", "48", "--background", "black", "-o", file};
    arguments.insert(arguments.end(), more.begin(), more.end());
    MustRun(arguments);
    return ReadPicture(Path(file));
  }

  const std::string red_ = R"({"label": "GFP", "color": "FF0000", "window": {"start": 20, "end": 180}})";
  const std::string green_ = R"({"label": "Actin", "color": "00FF00", "window": {"start": 20, "end": 180}})";
  int pictures_ = 0;
};

TEST_F(FieldsTest, ChannelsThatAreExchangedWithTheirColoursAreTheSamePicture) {
  MakeStore("a.zarr", Blob, red_ + "," + green_);
  MakeStore(
      "b.zarr", [](int channel, int time, double x, double y, double z) { return Blob(1 - channel, time, x, y, z); }, green_ + "," + red_);
  for (const std::vector<std::string>& more : std::vector<std::vector<std::string>>{{}, {"--renderer", "mip"}, {"--time", "2"}, kShadows}) {
    EXPECT_LE(LargestDifference(Rendered("a.zarr", more), Rendered("b.zarr", more)), 1.01 / 255);
  }
  EXPECT_GT(LargestDifference(Rendered("a.zarr"), Rendered("a.zarr", {"--channel", "0"})), 0.1);
}

TEST_F(FieldsTest, WorkersAndBoxesDoNotMatter) {
  MakeStore("a.zarr", Blob, red_ + "," + green_);
  for (const std::vector<std::string>& more :
       std::vector<std::vector<std::string>>{{},
                                             {"--renderer", "mip"},
                                             {"--blend", "over"},
                                             kShadows,
                                             {"--channel", "0", "--overlay", "a.zarr?channel=1,time=2", "--shadows", "1"}}) {
    const auto one = Rendered("a.zarr", more);
    EXPECT_LE(LargestDifference(one, Rendered("a.zarr", more, "--local=3")), 1.01 / 255);
    EXPECT_LE(LargestDifference(one, Rendered("a.zarr", more, "--local=8")), 1.01 / 255);
  }
}

TEST_F(FieldsTest, AChannelAndATimeOfADatasetAreThoseOfItsFile) {
  MakeStore("a.zarr", Blob, red_ + "," + green_);
  const std::vector<std::string> look = {"--renderer", "raycast", "--transfer", "gray-ramp", "--scalar-range", "10:200"};
  const auto of = [&](const std::string& source, std::vector<std::string> more) {
    more.insert(more.end(), look.begin(), look.end());
    return Rendered(source, more);
  };
  EXPECT_EQ(LargestDifference(of("a.zarr?channel=1,time=2", {}), of("a.zarr", {"--channel", "Actin", "--time", "2"})), 0);
  EXPECT_EQ(LargestDifference(of("a.zarr", {"--channel", "1", "--time", "5s"}), of("a.zarr", {"--channel", "1", "--time", "last"})), 0);
  EXPECT_GT(LargestDifference(of("a.zarr", {"--channel", "1", "--time", "0"}), of("a.zarr", {"--channel", "1", "--time", "1"})), 0.1);
}

// The largest value of each channel has the same colour as in a picture of it alone, and colours add.
TEST_F(FieldsTest, ColoursOfLargestValuesAdd) {
  MakeStore("a.zarr", Blob, red_ + "," + green_);
  const auto mip = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"--renderer", "mip", "--no-fit"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return Rendered("a.zarr", arguments);
  };
  const auto both = mip({}), red = mip({"--channel", "GFP"}), green = mip({"--channel", "1"});
  EXPECT_GT(LargestDifference(red, green), 0.3);
  for (int i = 0; i < 48 * 48; ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      const auto at = [&](const PictureFile& picture) { return picture.At(i % 48, i / 48, c); };
      ASSERT_NEAR(at(both), std::min(at(red) + at(green), 1.0F), 2.01 / 255);
    }
  }
}

TEST_F(FieldsTest, AnOverlayCoversTheVolumeWhereItIsOpaque) {
  MakeStore("a.zarr", Blob, red_ + "," + green_);
  const std::vector<std::string> opaque = {"--renderer", "raycast", "--no-fit", "--shading", "none", "--overlay-transfer", "opaque"};
  std::vector<std::string> over = opaque;
  over.insert(over.end(), {"--overlay", "a.zarr?channel=1,time=0", "--channel", "0"});
  const auto covered = Rendered("a.zarr", over);
  const auto alone =
      Rendered("a.zarr?channel=1,time=0", {"--renderer", "raycast", "--no-fit", "--shading", "none", "--transfer", "opaque"});
  // Where the overlay alone is opaque, nothing of the volume inside it is seen.
  for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(covered.At(24, 24, c), alone.At(24, 24, c), 0.02);
  EXPECT_GT(LargestDifference(covered, Rendered("a.zarr", {"--renderer", "raycast", "--no-fit", "--shading", "none", "--channel", "0"})),
            0.1);
}

TEST_F(FieldsTest, AnOverlayWithoutWeightLeavesThePictureAsItIs) {
  MakeStore("a.zarr", Blob, red_ + "," + green_);
  const std::string volume = "a.zarr?channel=0,time=0", overlay = "a.zarr?channel=1,time=0";
  const auto alone = Rendered(volume, {"--renderer", "raycast"});
  EXPECT_EQ(LargestDifference(alone, Rendered(volume, {"--renderer", "raycast", "--overlay", overlay, "--overlay-weight", "0"})), 0);
  EXPECT_GT(LargestDifference(alone, Rendered(volume, {"--renderer", "raycast", "--overlay", overlay})), 0.1);
}

TEST_F(FieldsTest, QuestionsAreAboutTheFieldThatIsNamed) {
  MakeStore("a.zarr", Blob, R"({"label": "1", "color": "FF0000"}, {"label": "Actin", "color": "00FF00"})");
  const auto value = [this](const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"value", "a.zarr", "--local=1", "--at", "12,11,12", "--json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Json json = Json::Parse(MustRun(arguments).out).value();
    return json[0]["value"].get<int>();
  };
  EXPECT_EQ(value({"--channel", "1"}), Blob(0, 0, 12, 11, 12)) << "a name goes before a number";
  EXPECT_EQ(value({"--channel", "0"}), Blob(0, 0, 12, 11, 12));
  EXPECT_EQ(value({"--channel", "Actin", "--time", "last"}), Blob(1, 2, 12, 11, 12));
  // The overlay is the second channel at another time.
  EXPECT_EQ(value({"--channel", "overlay", "--overlay", "a.zarr?channel=1,time=1"}), Blob(1, 1, 12, 11, 12));
  EXPECT_EQ(value({"--overlay", "a.zarr?channel=1,time=1"}), Blob(0, 0, 12, 11, 12));
  const Json box =
      Json::Parse(MustRun({"measure", "a.zarr", "--local=1", "--channel", "1", "--box", "12:13,11:12,12:13", "--json"}).out).value();
  EXPECT_THAT(box.dump(), testing::HasSubstr(std::to_string(Blob(0, 0, 12, 11, 12))));
}

TEST_F(FieldsTest, OptionsOfChannelsSayHowAnOverlayOfAFileLooks) {
  MakeStore("a.zarr", Blob, red_ + "," + green_);
  const std::vector<std::string> file = {"--overlay", "a.zarr?channel=1,time=0", "--channel", "0", "--renderer", "raycast"};
  const auto rendered = [&](std::vector<std::string> more) {
    more.insert(more.begin(), file.begin(), file.end());
    return Rendered("a.zarr", more);
  };
  const auto expected = rendered({"--overlay-transfer", "hot", "--overlay-range", "50:150", "--overlay-weight", "0.5"});
  const auto found =
      rendered({"--channel-transfer", "overlay=hot", "--channel-range", "overlay=50:150", "--channel-opacity", "overlay=0.5"});
  EXPECT_EQ(LargestDifference(found, expected), 0);
  EXPECT_GT(LargestDifference(found, rendered({})), 0.05);
}

}  // namespace
}  // namespace slabstream
