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

TEST_F(LabelsTest, SmoothSurfacesAreOfSurfacesAlone) {
  std::ofstream file(Path("ball.nrrd"), std::ios::binary);
  file << "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 32 32 32\nencoding: raw\n\n";
  for (int i = 0; i < 32 * 32 * 32; ++i) {
    const double x = i % 32 - 15.4, y = i / 32 % 32 - 15.7, z = i / 1024 - 16.2;
    file.put(x * x + y * y + z * z < 81 ? 1 : 0);
  }
  file.close();
  std::vector<std::string> options = {"--labels", "ball.nrrd", "--label-mode", "surface", "--transfer", "none"};
  const PictureFile blocky = Picture("render", options);
  options.insert(options.end(), {"--label-surface", "smooth"});
  EXPECT_GT(LargestDifference(Picture("render", options), blocky), 0.1);
  const auto refused = [&](const std::vector<std::string>& more, const std::string& why) {
    std::vector<std::string> arguments = {"render", "ramp.nrrd", "--local=1", "-o", "x.png", "--labels", "sides.nrrd", "--label-surface"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    ExpectRefused(arguments, why);
  };
  refused({"smooth", "--label-mode", "tint"}, "label-surface is 'smooth', but label-mode is not 'surface'");
  refused({"smooth", "--label-mode", "surface", "--renderer", "zbuffer"},
          "renderer is 'zbuffer', but label-surface 'smooth' needs one of: raycast");
  refused({"round", "--label-mode", "surface"}, "round");
}

// ---- labels alone

class LabelsAloneTest : public LabelsTest {
 protected:
  // Two balls of labels of 64 bits that touch.
  LabelsAloneTest() {
    std::ofstream file(Path("seg.nrrd"), std::ios::binary);
    file << "NRRD0004\ntype: uint64\ndimension: 3\nsizes: 32 32 32\nencoding: raw\nendian: little\n\n";
    for (int i = 0; i < 32 * 32 * 32; ++i) {
      const auto in_ball = [&](double x) { return std::hypot(i % 32 - x, i / 32 % 32 - 15.3, i / 1024 - 16.2) < 7.5; };
      const std::uint64_t label = in_ball(9.4) ? std::uint64_t{5} << 40 : in_ball(21.7) ? 70000 : 0;
      file.write(reinterpret_cast<const char*>(&label), sizeof(label));
    }
  }
  PictureFile Shown(const std::string& source, const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"render", source, "--local=2", "--size", "64", "--no-fit", "-o", Path("picture.png")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    MustRun(arguments);
    return ReadPicture(Path("picture.png"));
  }
};

TEST_F(LabelsAloneTest, ShowAsSurfacesWithoutBeingAsked) {
  for (const std::string renderer : {"raycast", "zbuffer"}) {
    SCOPED_TRACE(renderer);
    const PictureFile alone = Shown("seg.nrrd?ids=yes", {"--renderer", renderer});
    const PictureFile expected =
        Shown("ramp.nrrd", {"--renderer", renderer, "--labels", "seg.nrrd", "--label-mode", "surface", "--transfer", "none"});
    EXPECT_LE(LargestDifference(alone, expected), 1 / 255.0 + 1e-6);
    int seen = 0;
    for (int y = 0; y < alone.height; ++y) {
      for (int x = 0; x < alone.width; ++x) seen += alone.At(x, y, 3) > 0.99 ? 1 : 0;
    }
    EXPECT_GT(seen, 200);
  }
  const PictureFile raycast = Shown("seg.nrrd?ids=yes", {"--renderer", "raycast"});
  EXPECT_EQ(LargestDifference(Shown("seg.nrrd?ids=yes", {}), raycast), 0) << "what auto chooses";
  EXPECT_GT(LargestDifference(Shown("seg.nrrd?ids=yes", {"--labels-shown", "70000"}), raycast), 0.1);
}

TEST_F(LabelsAloneTest, ComeFromStoresThatSayThatTheyAreLabels) {
  MustRun({"convert", "seg.nrrd", "seg.ome.zarr", "--ids"});
  EXPECT_LE(LargestDifference(Shown("seg.ome.zarr", {}), Shown("seg.nrrd?ids=yes", {})), 1 / 255.0 + 1e-6);
}

TEST_F(LabelsAloneTest, WhatIsAboutValuesIsRefused) {
  const auto refused = [&](std::vector<std::string> more, const std::string& why) {
    more.insert(more.begin() + 1, {"seg.nrrd?ids=yes", "--local=1", "-o", "x.png"});
    ExpectRefused(more, why);
  };
  refused({"render", "--renderer", "splat"}, "has labels and no values, and renderer 'splat' shows no labels");
  refused({"render", "--transfer", "viridis"}, "has labels and no values, which transfer");
  const std::string why = "dataset \"volume\" has labels and no values to measure";
  ExpectRefused({"measure", "seg.nrrd?ids=yes", "--local=1", "--labels"}, why);
  ExpectRefused({"measure", "seg.nrrd?ids=yes", "--local=1", "--box", ":,:,:"}, why);
  refused({"render", "--isovalue", "3"}, "has labels and no values, which transfer");
  refused({"slice"}, "--label-mode surface chooses one that does");
  const std::string mode = "but dataset \"volume\" has labels and no values to colour, so it must be auto or surface";
  refused({"render", "--label-mode", "tint"}, "label-mode is 'tint', " + mode);
  refused({"render", "--label-mode", "highlight"}, "label-mode is 'highlight', " + mode);
  refused({"slice", "--label-mode", "tint"}, "label-mode is 'tint', " + mode);
  for (const std::string same : {"auto", "surface"})
    EXPECT_EQ(LargestDifference(Shown("seg.nrrd?ids=yes", {"--label-mode", same}), Shown("seg.nrrd?ids=yes", {})), 0) << same;
  MustRun({"slice", "seg.nrrd?ids=yes", "--local=1", "--label-mode", "surface", "-o", Path("slice.png")});
}

}  // namespace
}  // namespace slabstream
