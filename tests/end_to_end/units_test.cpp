// The unit that a volume file states, wherever lengths are shown.
#include <gmock/gmock.h>

#include <fstream>

#include "common/json/json.h"
#include "tests/end_to_end/picture_file.h"
#include "tests/end_to_end/program.h"

namespace slabstream {
namespace {

class UnitsTest : public EndToEndTest {
 protected:
  // 40 x 30 x 20 voxels, spaced 0.5, 0.5 and 2.
  void Make(const std::string& name, const std::string& lines) const {
    std::ofstream file(Path(name), std::ios::binary);
    file << "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 40 30 20\nspacings: 0.5 0.5 2\n" << lines << "encoding: raw\n\n";
    for (int i = 0; i < 40 * 30 * 20; ++i) file.put(char(i % 40 * 6));
  }
};

TEST_F(UnitsTest, AreShownAsTheFileStatesThem) {
  Make("cells.nrrd", "units: \"um\" \"um\" \"um\"\n");
  const std::string info = MustRun({"info", "cells.nrrd"}).out;
  EXPECT_THAT(info, HasSubstr("spacing      0.5 0.5 2 \u00b5m\n"));
  EXPECT_THAT(info, HasSubstr("extent       20 x 15 x 40 \u00b5m\n"));
  EXPECT_EQ(Json::Parse(MustRun({"info", "cells.nrrd", "--json"}).out).value()["unit"], "\u00b5m");
  const std::vector<std::string> measure = {"measure", "cells.nrrd", "--local=1", "--distance", "0,0,0:3,4,0", "--box", ":,:,:"};
  EXPECT_THAT(MustRun(measure).out, AllOf(HasSubstr("distance 5 \u00b5m\n"), HasSubstr("12000 \u00b5m^3\n")));
  MustRun({"render", "cells.nrrd", "--local=1", "--size", "300x200", "--scale-bar", "-o", "bar.png"});
  EXPECT_EQ(Json::Parse(MustRun({"info", "bar.png", "--json"}).out).value()["geometry"]["unit"], "\u00b5m");
  MustRun({"convert", "cells.nrrd", "again.nrrd"});
  EXPECT_THAT(MustRun({"info", "again.nrrd"}).out, HasSubstr("spacing      0.5 0.5 2 \u00b5m\n"));
}

TEST_F(UnitsTest, AreNotMadeUp) {
  Make("bare.nrrd", "");
  EXPECT_THAT(MustRun({"info", "bare.nrrd"}).out, AllOf(HasSubstr("spacing      0.5 0.5 2\n"), Not(HasSubstr("unit"))));
  EXPECT_EQ(Json::Parse(MustRun({"info", "bare.nrrd", "--json"}).out).value()["unit"], "unknown");
  EXPECT_THAT(MustRun({"measure", "bare.nrrd", "--local=1", "--distance", "0,0,0:3,4,0"}).out, HasSubstr("distance 5 units\n"));
  MakeSphere("ball.nrrd", 1, 16);
  EXPECT_THAT(MustRun({"measure", "ball.nrrd", "--local=1", "--distance", "0,0,0:3,4,0"}).out, HasSubstr("distance 5 voxels\n"));
  // The letters of the scale bar differ, and nothing else.
  Make("cells.nrrd", "units: \"um\" \"um\" \"um\"\n");
  for (const std::string name : {"bare", "cells"}) {
    MustRun({"render", name + ".nrrd", "--local=1", "--size", "200", "--scale-bar", "-o", name + "-bar.png"});
    MustRun({"render", name + ".nrrd", "--local=1", "--size", "200", "-o", name + ".png"});
  }
  EXPECT_EQ(LargestDifference(ReadPicture(Path("bare.png")), ReadPicture(Path("cells.png"))), 0);
  EXPECT_GT(LargestDifference(ReadPicture(Path("bare-bar.png")), ReadPicture(Path("cells-bar.png"))), 0.5);
}

}  // namespace
}  // namespace slabstream
