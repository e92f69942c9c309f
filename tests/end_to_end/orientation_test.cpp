// Where things are in a picture: one object, stored in any of the 48 orders of axes, gives one picture, with left on the side where a
// viewer expects it.
#include <gmock/gmock.h>

#include <algorithm>
#include <string>
#include <tuple>
#include <vector>

#include "common/json/json.h"
#include "tests/data/volume_io/stored_object.h"
#include "tests/end_to_end/picture_file.h"
#include "tests/end_to_end/program.h"

namespace slabstream {
namespace {

// A body with a bright block at its right, anterior, superior corner.
Object Body() {
  Object body{.size = {24, 20, 16}, .steps = {Vec3{2, 0, 0}, Vec3{0, 1.5, 0}, Vec3{0, 0, 3}}, .origin = {}, .value = {}};
  body.value = [](const Index3& at) -> std::uint8_t {
    if (at.x >= 18 && at.y >= 15 && at.z >= 11) return 250;
    return at.x > 2 && at.x < 20 && at.y > 4 && at.y < 17 && at.z > 1 && at.z < 13 ? std::uint8_t(60 + 3 * at.x + at.z) : 0;
  };
  return body;
}

// Where pixels lie, on average, from the picture's centre to the right and downwards, in pixels.
struct Spot {
  int pixels = 0;
  double x = 0, y = 0;
};
// Of those for which belongs(x, y) holds.
template <class Belongs>
Spot SpotOf(const PictureFile& picture, Belongs belongs) {
  Spot spot;
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      if (!belongs(x, y)) continue;
      ++spot.pixels;
      spot.x += x + 0.5 - picture.width / 2.0;
      spot.y += y + 0.5 - picture.height / 2.0;
    }
  }
  spot.x /= spot.pixels;
  spot.y /= spot.pixels;
  return spot;
}

class OrientationTest : public EndToEndTest {
 protected:
  std::string Store(const Storage& storage) const {
    WriteFile(Path("body.nrrd"), NrrdFile(StoredAs(Body(), storage), "left-posterior-superior", {-1, -1, 1}));
    return Path("body.nrrd");
  }
  PictureFile Render(const std::string& volume, std::vector<std::string> more) const {
    std::vector<std::string> arguments = {"render", volume, "-o", Path("picture.png"), "--size", "64", "--local=2"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    MustRun(arguments);
    return ReadPicture(Path("picture.png"));
  }
};

TEST_F(OrientationTest, OneObjectInAnyStorageGivesOnePicture) {
  for (const std::vector<std::string>& look :
       {std::vector<std::string>{"--renderer", "zbuffer"}, {"--renderer", "mip"}, {"--renderer", "raycast", "--light", "1,2,3"}}) {
    std::vector<std::string> options = {"--azimuth", "200", "--elevation", "25"};
    options.insert(options.end(), look.begin(), look.end());
    const std::vector<Storage> storages = AllStorages();
    const PictureFile first = Render(Store(storages.front()), options);
    EXPECT_GT(*std::ranges::max_element(first.samples), 0.5);
    // Renderers share what places a volume: one of them draws all storages, the others some.
    const std::size_t step = look[1] == "raycast" ? 1 : 7;
    for (std::size_t i = 0; i < storages.size(); i += step) {
      const Storage& storage = storages[i];
      EXPECT_EQ(LargestDifference(Render(Store(storage), options), first), 0) << look[1] << ", " << Text(storage);
    }
  }
}

TEST_F(OrientationTest, NamedViewsShowTheCornerWhereItIs) {
  struct Case {
    const char* view;
    int x, y;  // side of the picture where the patient's right, anterior, superior corner appears: -1 left or top, 1 right or bottom
  };
  const std::string volume = Store(AllStorages()[29]);
  for (const auto& [view, side_x, side_y] : {Case{"anterior", -1, -1},
                                             {"posterior", 1, -1},
                                             {"right", 1, -1},
                                             {"left", -1, -1},
                                             {"superior", 1, -1},
                                             {"inferior", -1, -1},
                                             {"front", 1, -1},
                                             {"back", -1, -1}}) {
    const PictureFile picture = Render(volume, {"--renderer", "mip", "--transfer", "gray-ramp", "--view", view});
    const Spot block = SpotOf(picture, [&](int x, int y) { return picture.At(x, y, 3) >= 0.9; });  // by its opacity
    ASSERT_GT(block.pixels, 0) << view;
    EXPECT_GT(side_x * block.x, 3) << view;
    EXPECT_GT(side_y * block.y, 3) << view;
  }
}

// Clip boxes, planes and slices are in the world, so storage does not matter.
TEST_F(OrientationTest, CutsAreWhereTheyAreInAnyStorage) {
  const std::vector<std::string> options = {"--renderer",   "zbuffer",     "--azimuth",  "200",     "--elevation", "25",
                                            "--clip-plane", "-1,0,0.5,10", "--clip-box", ":,:20,:", "--clip-mode", "cut-away"};
  const std::vector<Storage> storages = AllStorages();
  const PictureFile first = Render(Store(storages.front()), options);
  EXPECT_GT(LargestDifference(first, Render(Store(storages.front()), {"--renderer", "zbuffer", "--azimuth", "200", "--elevation", "25"})),
            0.1);
  for (std::size_t i = 0; i < storages.size(); i += 5) {
    EXPECT_EQ(LargestDifference(Render(Store(storages[i]), options), first), 0) << Text(storages[i]);
  }
}

TEST_F(OrientationTest, SlicesShowVoxelsWhereRadiologistsExpectThem) {
  const std::string volume = Store(AllStorages()[29]);
  struct Case {
    const char* plane;
    Index3 voxel;  // in the middle of the slice
    int x, y;      // side of the picture where the bright corner appears
  };
  for (const auto& [plane, voxel, side_x, side_y] :
       {Case{"axial", {21, 17, 13}, -1, -1}, {"coronal", {21, 17, 13}, -1, -1}, {"sagittal", {21, 17, 13}, -1, -1}}) {
    const std::string at = std::to_string(2 * voxel.x) + "," + std::to_string(1.5 * voxel.y) + "," + std::to_string(3 * voxel.z);
    MustRun({"slice", volume, "--local=2", "-o", Path("slice.png"), "--size", "96", "--plane", plane, "--at", at, "--window", "255",
             "--interpolation", "nearest"});
    const PictureFile slice = ReadPicture(Path("slice.png"));
    const Spot block = SpotOf(slice, [&](int x, int y) { return std::abs(slice.At(x, y, 0) - 250 / 255.0F) <= 0.006F; });
    ASSERT_GT(block.pixels, 50) << plane;
    EXPECT_GT(side_x * block.x, 5) << plane;
    EXPECT_GT(side_y * block.y, 5) << plane;
  }
  // The same slice by its number.
  MustRun({"slice", volume, "--local=2", "-o", Path("index.png"), "--size", "96", "--plane", "sagittal", "--index", "21", "--window", "255",
           "--interpolation", "nearest"});
  EXPECT_EQ(LargestDifference(ReadPicture(Path("index.png")), ReadPicture(Path("slice.png"))), 0);
  MustRun({"slice", volume, "--local=2", "-o", Path("three.png"), "--size", "48x32", "--plane", "anatomical", "--thickness", "8"});
  EXPECT_EQ(ReadPicture(Path("three.png")).width, 3 * 48);
}

TEST_F(OrientationTest, InfoTellsHowVoxelsAreStored) {
  // Stored x is the patient's z, backwards; y is x; z is y, backwards.
  const std::string info = MustRun({"info", Store({.from = {2, 0, 1}, .flipped = {true, false, true}})}).out;
  EXPECT_THAT(info, HasSubstr("size         24 x 20 x 16 voxels"));
  EXPECT_THAT(info, HasSubstr("extent       48 x 30 x 48 mm"));
  EXPECT_THAT(info, HasSubstr("the file's voxel x runs superior to inferior"));
  EXPECT_THAT(info, HasSubstr("the file's voxel y runs left to right"));
  EXPECT_THAT(info, HasSubstr("the file's voxel z runs anterior to posterior"));
  EXPECT_THAT(info, HasSubstr("oblique      no"));
}

TEST_F(OrientationTest, AnatomicalViewsNeedAPatient) {
  const std::string sphere = MakeSphere("sphere.nrrd", 2, 16);
  const ProgramResult refused = Slabstream({"render", sphere, "--local", "-o", Path("p.png"), "--view", "anterior"});
  EXPECT_EQ(refused.exit_status, 2);
  EXPECT_THAT(refused.err, HasSubstr("no patient's orientation"));
  EXPECT_THAT(refused.err, HasSubstr("front, back, left, right, top and bottom"));
  MustRun({"render", sphere, "--local", "-o", Path("p.png"), "--view", "top"});
  const ProgramResult both = Slabstream({"render", sphere, "--local", "-o", Path("p.png"), "--view", "top", "--azimuth", "3"});
  EXPECT_EQ(both.exit_status, 2);
  EXPECT_THAT(both.err, HasSubstr("--azimuth"));
}

TEST_F(OrientationTest, ACameraIsSavedAndReadBack) {
  const std::string volume = Store(AllStorages()[5]);
  const std::vector<std::string> view = {"--projection", "perspective", "--look-at", "30,20,30", "--eye", "-90,140,60", "--up", "0,0.2,1"};
  std::vector<std::string> saving = view;
  saving.insert(saving.end(), {"--save-camera", Path("camera.json")});
  const PictureFile picture = Render(volume, saving);
  EXPECT_EQ(LargestDifference(Render(volume, {"--camera", Path("camera.json")}), picture), 0);
  const ProgramResult both = Slabstream({"render", volume, "--local", "-o", Path("p.png"), "--camera", Path("camera.json"), "--zoom", "2"});
  EXPECT_EQ(both.exit_status, 2);
  const ProgramResult inside =
      Slabstream({"render", volume, "--local", "-o", Path("p.png"), "--projection", "perspective", "--eye", "24,16,25"});
  EXPECT_EQ(inside.exit_status, 2);
  EXPECT_THAT(inside.err, HasSubstr("view.eye"));
  const ProgramResult turning = Slabstream({"turntable", volume, "--local", "-o", Path("p%d.png"), "--frames", "2", "--eye", "240,16,25"});
  EXPECT_EQ(turning.exit_status, 2);
  EXPECT_THAT(turning.err, HasSubstr("--eye fixes the viewpoint"));
}

// Of a patient and of a volume without orientation: what the default view is, and that the saved camera makes the same picture.
TEST_F(OrientationTest, TheDefaultViewIsThatOfItsVolumeAndIsSavedAsItWasUsed) {
  const std::string patient = Store(AllStorages()[5]), ball = MakeSphere("ball.nrrd", 2, 16);
  for (const auto& [volume, azimuth, elevation] : {std::tuple(patient, 180, 0), std::tuple(ball, 30, 20)}) {
    for (const char* projection : {"orthographic", "perspective"}) {
      const std::vector<std::string> options = {"--projection", projection, "--renderer", "raycast"};
      const auto with = [&](std::vector<std::string> more) {
        more.insert(more.end(), options.begin(), options.end());
        return Render(volume, more);
      };
      const PictureFile picture = with({"--save-camera", Path("camera.json")});
      const Json camera = Json::Parse(ReadFile("camera.json")).value();
      EXPECT_EQ(camera["azimuth"], azimuth);
      EXPECT_EQ(camera["elevation"], elevation);
      EXPECT_EQ(camera["fit"], false);
      EXPECT_TRUE(camera.contains("look-at")) << camera;
      EXPECT_EQ(LargestDifference(Render(volume, {"--renderer", "raycast", "--camera", Path("camera.json")}), picture), 0);
      EXPECT_EQ(LargestDifference(with({"--azimuth", std::to_string(azimuth), "--elevation", std::to_string(elevation), "--fit"}), picture),
                0);
      with({"--no-fit", "--azimuth", "0", "--save-camera", Path("whole.json")});
      EXPECT_EQ(Json::Parse(ReadFile("whole.json")).value()["elevation"], elevation) << "an angle that is not given keeps its default";
      EXPECT_FALSE(Json::Parse(ReadFile("whole.json")).value().contains("look-at"));
    }
  }
}

// A small object in a corner of a large volume.
TEST_F(OrientationTest, FitFramesWhatIsVisible) {
  Object corner = Body();
  corner.size = {96, 96, 96};
  corner.value = [](const Index3& at) -> std::uint8_t { return at.x < 20 && at.y >= 70 && at.y < 90 && at.z < 20 ? 200 : 0; };
  WriteFile(Path("corner.nrrd"), NrrdFile(StoredAs(corner, AllStorages().front())));
  const auto covered = [&](std::vector<std::string> options) {
    const PictureFile picture = Render(Path("corner.nrrd"), std::move(options));
    return SpotOf(picture, [&](int x, int y) { return picture.At(x, y, 3) > 0.5F; }).pixels;
  };
  for (const char* renderer : {"zbuffer", "raycast", "splat"}) {
    for (const char* projection : {"orthographic", "perspective"}) {
      const std::vector<std::string> fitted = {"--renderer",  renderer, "--projection", projection, "--azimuth", "30",
                                               "--elevation", "0",      "--transfer",   "opaque"};
      std::vector<std::string> plain = fitted;
      plain.emplace_back("--no-fit");
      EXPECT_LT(covered(plain), 64 * 64 / 20) << renderer << " " << projection;
      EXPECT_GT(covered(fitted), 64 * 64 / 6) << renderer << " " << projection;
    }
  }
}

}  // namespace
}  // namespace slabstream
