// Labels by name, and labels that are not shown.
#include <gmock/gmock.h>

#include <cmath>
#include <fstream>

#include "tests/end_to_end/picture_file.h"
#include "tests/end_to_end/program.h"

namespace slabstream {
namespace {

class LabelsTest : public EndToEndTest {
 protected:
  // A ramp along z; label 3 where x < 16, label 5 elsewhere.
  LabelsTest() {
    const auto write = [&](const char* name, auto value) {
      std::ofstream file(Path(name), std::ios::binary);
      file << "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 32 32 32\nencoding: raw\n\n";
      for (int i = 0; i < 32 * 32 * 32; ++i) file.put(char(value(i % 32, i / 1024)));
    };
    write("ramp.nrrd", [](int, int z) { return 60 + 6 * z; });
    write("sides.nrrd", [](int x, int) { return x < 16 ? 3 : 5; });
    std::ofstream(Path("sides.txt")) << "3 Precentral_L 255 0 0 0\n5 Precentral_R 0 0 255 0\n";
  }

  PictureFile Picture(const std::string& command, const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {command, "ramp.nrrd", "--local=1", "--size", "64", "-o", Path("picture.png")};
    if (command == "render") arguments.insert(arguments.end(), {"--azimuth", "0", "--elevation", "0", "--no-fit"});
    arguments.insert(arguments.end(), more.begin(), more.end());
    MustRun(arguments);
    return ReadPicture(Path("picture.png"));
  }
  std::vector<std::string> Labelled(const std::string& renderer, const std::string& mode, const std::string& shown) const {
    std::vector<std::string> options = {"--labels", "sides.nrrd:sides.txt", "--label-mode", mode, "--labels-shown", shown};
    if (!renderer.empty()) options.insert(options.end(), {"--renderer", renderer, "--shading", "none"});
    return options;
  }

  // Largest difference of a channel in columns [begin, end).
  static double Difference(const PictureFile& a, const PictureFile& b, int begin, int end) {
    double largest = 0;
    for (int y = 0; y < a.height; ++y) {
      for (int x = begin; x < end; ++x) {
        for (std::size_t c = 0; c < 4; ++c) largest = std::max(largest, std::abs(double(a.At(x, y, c)) - double(b.At(x, y, c))));
      }
    }
    return largest;
  }
};

// The labels meet in the middle of the picture.
TEST_F(LabelsTest, SlicesShowTheValuesOfLabelsThatAreNotShown) {
  const std::vector<std::string> across = {"--plane", "y"};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.end(), across.begin(), across.end());
    return Picture("slice", more);
  };
  const PictureFile plain = with({}), highlight = with(Labelled("", "highlight", "Precentral_R")),
                    tint = with(Labelled("", "tint", "Precentral_R"));
  const int half = plain.width / 2;
  EXPECT_LE(Difference(highlight, plain, 0, half - 1), 1 / 255.0 + 1e-6) << "as without labels";
  EXPECT_GT(Difference(highlight, plain, half + 1, plain.width), 0.1);
  EXPECT_EQ(Difference(highlight, tint, 0, plain.width), 0) << "a slice has no material to take away";
}

TEST_F(LabelsTest, PicturesShowTheVolumeWhereALabelIsNotHighlighted) {
  for (const std::string renderer : {"raycast", "zbuffer"}) {
    SCOPED_TRACE(renderer);
    const PictureFile plain = Picture("render", {"--renderer", renderer, "--shading", "none"});
    const PictureFile highlight = Picture("render", Labelled(renderer, "highlight", "5"));
    const int half = plain.width / 2;
    EXPECT_LE(Difference(highlight, plain, 0, half - 1), 1 / 255.0 + 1e-6);
    EXPECT_GT(Difference(highlight, plain, half + 1, plain.width), 0.1);
    EXPECT_EQ(Difference(highlight, Picture("render", Labelled(renderer, "tint", "5")), half + 1, plain.width), 0);
  }
}

TEST_F(LabelsTest, HaveNamesBesideTheirNumbers) {
  const auto shown = [&](const std::string& which) { return Picture("render", Labelled("raycast", "surface", which)); };
  const PictureFile right = shown("5"), both = shown("3,5");
  EXPECT_GT(LargestDifference(right, both), 0.1);
  for (const char* name : {"Precentral_R", "*_R", "*R,5-9"}) EXPECT_EQ(LargestDifference(shown(name), right), 0) << name;
  for (const char* name : {"*", "Precentral_?", "Pre*", "Precentral_L,5", "3,Precentral_R"})
    EXPECT_EQ(LargestDifference(shown(name), both), 0) << name;
  ExpectRefused({"render", "ramp.nrrd", "--local=1", "-o", "x.png", "--renderer", "raycast", "--labels", "sides.nrrd:sides.txt",
                 "--labels-shown", "3,Postcentral_*"},
                "labels.shown: no label is named 'Postcentral_*'; there are Precentral_L, Precentral_R");
}

}  // namespace
}  // namespace slabstream
