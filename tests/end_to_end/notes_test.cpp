// What commands say beside their results: one line on stderr, and the result is there all the same.
#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>

#include "common/json/json.h"
#include "tests/end_to_end/picture_file.h"
#include "tests/end_to_end/program.h"

namespace slabstream {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::StartsWith;

class NotesTest : public EndToEndTest {
 protected:
  NotesTest() { MakeSphere("ball.nrrd", 2, 24); }

  // A picture of the ball in this process, with these options. Returns what was said on stderr.
  std::vector<std::string> SaidBy(const std::string& command, const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {command, "ball.nrrd", "--local=1", "--size", "32", "-o", "x.png"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return MustRun(arguments).err_lines();
  }
};

TEST_F(NotesTest, AFileIsRenderedHereWhereNoServiceRuns) {
  const ProgramResult here = MustRun({"render", "ball.nrrd", "-o", "here.png", "--size", "32"});
  EXPECT_THAT(here.err_lines(), ElementsAre(AllOf(StartsWith("slabstream: note: no service is named and none runs here"),
                                                  HasSubstr("ball.nrrd"), HasSubstr("--local"))));
  EXPECT_THAT(MustRun({"render", "ball.nrrd", "-o", "asked.png", "--size", "32", "--local"}).err_lines(), IsEmpty());
  EXPECT_EQ(LargestDifference(ReadPicture(Path("here.png")), ReadPicture(Path("asked.png"))), 0);
  EXPECT_THAT(MustRun({"slice", "ball.nrrd:opaque", "-o", "slice.png", "--size", "32"}).err, HasSubstr("no service"));
  EXPECT_THAT(MustRun({"value", "ball.nrrd", "--at", "1,1,1", "--json"}).err, HasSubstr("no service"));
  EXPECT_THAT(MustRun({"turntable", "ball.nrrd", "--frames", "2", "--size", "32", "-o", "f%d.png"}).err, HasSubstr("no service"));
  // A service that is named is meant, and so is a name that is no file.
  EXPECT_EQ(Slabstream({"render", "ball.nrrd", "-o", "no.png", "--endpoint", "ipc://" + Path("nobody")}).exit_status, 1);
  EXPECT_EQ(Slabstream({"render", "ball", "-o", "no.png"}).exit_status, 1);
  EXPECT_EQ(Slabstream({"render", "ball", "--memory", "1G", "-o", "no.png"}).err,
            "slabstream render: --memory needs --local: the processes of "
            "a service have limits of their own\n");
}

TEST_F(NotesTest, LocalRenderingKeepsToItsMemory) {
  EXPECT_THAT(SaidBy("render", {"--memory", "1G"}), IsEmpty());
  // No more workers than the memory suits, on a machine with any number of cores.
  MustRun({"render", "ball.nrrd", "--local", "--memory", "768M", "--size", "32", "-o", "one.png", "--stats", "one.json"});
  EXPECT_EQ(Json::Parse(ReadFile("one.json")).value()["plan"]["workers"], 1);
  MustRun({"render", "ball.nrrd", "--local=3", "--memory", "2G", "--size", "32", "-o", "three.png", "--stats", "three.json"});
  EXPECT_EQ(Json::Parse(ReadFile("three.json")).value()["plan"]["workers"], 3);
  const ProgramResult large =
      Slabstream({"render", "ball.nrrd", "--local=1", "--memory", "800M", "--size", "8000x8000", "-o", "large.png"});
  EXPECT_EQ(large.exit_status, 1);
  EXPECT_THAT(large.err, HasSubstr("MiB"));
  EXPECT_THAT(Slabstream({"render", "ball.nrrd", "--local=4", "--memory", "512M", "-o", "x.png"}).err,
              HasSubstr("--memory 512 MiB is too little for a coordinator and 4 workers, which need 1536 MiB"));
}

TEST_F(NotesTest, AnEmptyPictureSaysWhatWouldShowSomething) {
  EXPECT_THAT(SaidBy("render", {}), IsEmpty());
  EXPECT_THAT(SaidBy("render", {"--clip-box", "100:200,:,:"}),
              ElementsAre("slabstream: warning: the picture is empty: --clip-box leaves nothing of the volume, which lies in "
                          "-0.5:23.5,-0.5:23.5,-0.5:23.5"));
  EXPECT_THAT(SaidBy("render", {"--clip-box", "25:30,:,:v"}), ElementsAre(HasSubstr("which lies in 0:24,0:24,0:24v")));
  EXPECT_THAT(SaidBy("render", {"--clip-plane", "1,0,0,-99"}), ElementsAre(HasSubstr("--clip-plane leaves nothing")));
  EXPECT_THAT(SaidBy("render", {"--transfer", R"({"RGBPoints": [300, 1, 1, 1], "Points": [300, 0, 0.5, 0, 400, 1, 0.5, 0]})"}),
              ElementsAre(AllOf(HasSubstr("the transfer function shows values above 300"), HasSubstr("values run from 0 to "))));
  EXPECT_THAT(SaidBy("render", {"--renderer", "raycast", "--isovalue", "999"}), ElementsAre(HasSubstr("no surface of --isovalue")));
  EXPECT_THAT(SaidBy("render", {"--look-at", "900,900,900"}), ElementsAre(HasSubstr("--fit frames what is shown")));
  EXPECT_THAT(SaidBy("slice", {"--plane", "z", "--at", "0,0,99"}), ElementsAre(HasSubstr("the plane of --at leaves nothing")));
}

TEST_F(NotesTest, WhoConvertsOneChannelOfSeveralIsToldWhichOne) {
  std::filesystem::create_directories(Path("em/4_4_4"));
  std::ofstream(Path("em/info")) << R"({"data_type": "uint8", "num_channels": 2, "type": "image", "scales": [{"key": "4_4_4",
      "size": [4, 4, 4], "chunk_sizes": [[4, 4, 4]], "resolution": [4, 4, 4], "encoding": "raw"}]})";
  std::ofstream(Path("em/4_4_4/0-4_0-4_0-4"), std::ios::binary) << std::string(64, char(10)) << std::string(64, char(20));
  const std::string note = "em: shows channel 0 of 2; --channel takes another one: 0 to 1";
  EXPECT_THAT(MustRun({"render", "em", "--local=1", "--size", "16", "-o", "x.png", "--channel", "1"}).err_lines(), IsEmpty());
  EXPECT_THAT(MustRun({"info", "em", "--channel", "1"}).out,
              AllOf(HasSubstr("channels     2: name, colour, window; this is number 1\n   0  \"\"  no colour  no window\n   1  \"\""),
                    HasSubstr("values       20 ... 20")));
  EXPECT_THAT(MustRun({"convert", "em", "em.ome.zarr"}).err_lines(), ElementsAre(HasSubstr(note)));
}

TEST_F(NotesTest, OfSeveralTimesTheFirstIsShown) {
  const std::string header = "{'descr': '|u1', 'fortran_order': False, 'shape': (3, 2, 2, 2), }\n";
  std::ofstream(Path("beat.npy"), std::ios::binary)
      << "\x93NUMPY\x01" << '\0' << char(header.size()) << '\0' << header << "abcdefghijklmnopqrstuvwx";
  const std::vector<std::string> render = {"render", "beat.npy", "--local=1", "--size", "16", "--transfer", "opaque", "-o"};
  const auto picture = [&](const std::string& name, const std::vector<std::string>& more) {
    std::vector<std::string> arguments = render;
    arguments.push_back(name);
    arguments.insert(arguments.end(), more.begin(), more.end());
    return MustRun(arguments).err_lines();
  };
  EXPECT_THAT(picture("any.png", {}), IsEmpty());
  EXPECT_THAT(picture("first.png", {"--time", "0"}), IsEmpty());
  EXPECT_EQ(LargestDifference(ReadPicture(Path("any.png")), ReadPicture(Path("first.png"))), 0);
  EXPECT_THAT(MustRun({"info", "beat.npy"}).out,
              AllOf(HasSubstr("times        3; this is number 0\n"), HasSubstr("values       97 ... 120 of 3 of 3 times")));
  ExpectRefused({"convert", "beat.npy", "beat.nrrd"}, "holds 3 volumes, of which --time takes one: 0 to 2");
}

TEST_F(NotesTest, InfoTellsHowChannelsAreShownAndHowFarTimesAreApart) {
  std::filesystem::create_directories(Path("cells.zarr/0"));
  std::ofstream(Path("cells.zarr/.zgroup")) << R"({"zarr_format": 2})";
  std::ofstream(Path("cells.zarr/.zattrs")) << R"({"multiscales": [{"version": "0.4", "axes": [
      {"name": "t", "type": "time", "unit": "second"}, {"name": "c", "type": "channel"}, {"name": "z", "type": "space"},
      {"name": "y", "type": "space"}, {"name": "x", "type": "space"}],
      "datasets": [{"path": "0", "coordinateTransformations": [{"type": "scale", "scale": [0.5, 1, 1, 1, 1]}]}]}],
      "omero": {"channels": [{"label": "DAPI", "color": "0000FF", "window": {"start": 5, "end": 200}}, {"active": false}]}})";
  std::ofstream(Path("cells.zarr/0/.zarray")) << R"({"zarr_format": 2, "shape": [3, 2, 2, 2, 2], "chunks": [1, 1, 2, 2, 2], "dtype": "|u1",
      "compressor": null, "filters": null, "fill_value": 0, "order": "C"})";
  EXPECT_THAT(MustRun({"info", "cells.zarr"}).out, HasSubstr("times        3, 0.5 s apart; this is number 0\n"
                                                             "channels     2: name, colour, window; this is number 0\n"
                                                             "   0  \"DAPI\"  #0000ff  5 ... 200\n"
                                                             "   1  \"\"  no colour  no window  (hidden)\n"));
  const Json json = Json::Parse(MustRun({"info", "cells.zarr", "--json"}).out).value();
  EXPECT_EQ(json["channels"], Json::Parse(R"([{"name": "DAPI", "color": "#0000ff", "window": {"min": 5, "max": 200}, "shown": true},
      {"name": "", "color": null, "window": null, "shown": false}])")
                                  .value());
  EXPECT_EQ(json["times"], 3);
  EXPECT_EQ(json["time_step"], 0.5);
  EXPECT_EQ(json["time_unit"], "s");
}

TEST_F(NotesTest, OfSeveralComponentsTheFirstIsShownAndToldOf) {
  std::ofstream(Path("rgb.nrrd"), std::ios::binary) << "NRRD0004\ntype: uint8\ndimension: 4\nencoding: raw\nsizes: 3 2 2 2\n"
                                                    << "kinds: RGB-color domain domain domain\n\n"
                                                    << "a..b..c..d..e..f..g..h..";
  EXPECT_THAT(MustRun({"render", "rgb.nrrd", "--local=1", "--size", "16", "--transfer", "opaque", "-o", "x.png"}).err_lines(),
              ElementsAre(HasSubstr("rgb.nrrd: shows component 0 of 3; --channel takes another one: 0 to 2, or luminance")));
  EXPECT_THAT(MustRun({"info", "rgb.nrrd"}).out,
              AllOf(HasSubstr("components   3 of a voxel; this is number 0\n"), HasSubstr("values       97 ... 104")));
  ExpectRefused({"convert", "rgb.nrrd", "grey.nrrd"}, "has 3 components a voxel, of which --channel takes one");
}

TEST_F(NotesTest, AVolumeOfOneValueHasNothingToShow) {
  std::ofstream(Path("empty.nrrd")) << "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 9 9 9\nencoding: raw\n\n" << std::string(729, '\3');
  const ProgramResult result = MustRun({"render", "empty.nrrd", "--local=1", "--size", "32", "-o", "x.png"});
  EXPECT_THAT(result.err_lines(), ElementsAre("slabstream: warning: the picture is empty: all values of the volume are 3"));
  EXPECT_EQ(ReadPicture(Path("x.png")).At(16, 16, 3), 0);
}

TEST_F(NotesTest, PresetsAreListed) {
  const std::string list = MustRun({"transfer", "--list", "--preview", "maps.png"}).out;
  for (const char* name : {"auto  ", "ct-bone  ", "viridis  ", "magma  ", "cividis  ", "turbo  ", "coolwarm  ", "grey  "}) {
    EXPECT_THAT(list, HasSubstr(name));
  }
  const PictureFile maps = ReadPicture(Path("maps.png"));
  EXPECT_EQ(maps.width, 500);
  // Viridis is the second line, and its last colour the published one.
  EXPECT_NEAR(maps.At(499, 42, 0), 0.993, 0.02);
  EXPECT_NEAR(maps.At(499, 42, 2), 0.144, 0.02);
  EXPECT_EQ(Slabstream({"transfer"}).exit_status, 2);
}

TEST_F(NotesTest, ColourMapsAreOpaqueInSlices) {
  EXPECT_THAT(SaidBy("slice", {"--plane", "z", "--transfer", "viridis"}), IsEmpty());
  const PictureFile slice = ReadPicture(Path("x.png"));
  for (int i = 4; i < 28; ++i) EXPECT_EQ(slice.At(i, i, 3), 1) << i;
}

TEST_F(NotesTest, SlicesHaveLettersAndScaleBarsOfTheirOwn) {
  EXPECT_THAT(SaidBy("slice", {"--scale-bar", "--orientation-marker", "--title", "A ball", "--color-bar=value"}), IsEmpty());
  EXPECT_EQ(ReadPicture(Path("x.png")).width, 3 * 32);
  EXPECT_THAT(SaidBy("slice", {"--plane", "z", "--window", "bone"}), IsEmpty());
  EXPECT_THAT(Slabstream({"slice", "ball.nrrd", "--local=1", "-o", "y.png", "--window", "bones"}).err, HasSubstr("one of bone, lung"));
}

TEST_F(NotesTest, ARangeWithoutValuesIsTold) {
  EXPECT_THAT(SaidBy("slice", {"--window", "80", "--level", "5000"}),
              ElementsAre(AllOf(StartsWith("slabstream: warning: --window shows values from 4960 to 5040"), HasSubstr("run from 0 to "))));
  EXPECT_THAT(SaidBy("slice", {"--window", "80", "--level", "100"}), IsEmpty());
  EXPECT_THAT(SaidBy("render", {"--scalar-range", "-900:-100"}), ElementsAre(HasSubstr("--scalar-range shows values from -900 to -100")));
  EXPECT_THAT(SaidBy("render", {"--scalar-range", "2%:98%"}), IsEmpty());
}

}  // namespace
}  // namespace slabstream
