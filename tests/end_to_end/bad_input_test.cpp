// Bad input of every kind: exit status 2, one line on stderr that names what is wrong, nothing on stdout, no picture.
#include <gmock/gmock.h>

#include <fstream>

#include "tests/end_to_end/program.h"

namespace slabstream {
namespace {

class BadInputTest : public EndToEndTest {
 protected:
  void Write(const std::string& name, const std::string& text) { std::ofstream(Path(name), std::ios::binary) << text; }
};

TEST_F(BadInputTest, CommandLines) {
  std::vector<std::string> many(131, "a");
  many[0] = "data";
  many[1] = "remove";
  const std::vector<Refusal> cases = {
      {{"rendr"}, "slabstream: there is no command 'rendr'"},
      {{"rendr", "v"}, "; did you mean 'render'?"},
      {{"keys", "lst"}, "slabstream keys: there is no command 'lst', but list, issue, rotate, revoke; did you mean 'list'?"},
      {{"help", "turntabel"}, "did you mean 'turntable'?"},
      {{"render", "v", "--ouput", "x.png"}, "`slabstream render` has no option '--ouput'; did you mean '--output'?"},
      {{"render", "v", "-o", "x.png", "-size", "5"}, "did you mean '--size'?"},
      {{"render", "v", "--isovalue=", "-o", "x.png"}, "--isovalue has no value behind its '='"},
      {{"up", "--thread=2"}, "did you mean '--threads'?"},
      {{"render", "no/v", "--endpoint", "ipc:///nobody", "-o", "x.png"}, "SOURCE no/v: no such file"},
      {{"view", "no/v.nrrd"}, "SOURCE no/v.nrrd: no such file"},
      {{"experiment", "papr"}, "did you mean 'paper'?"},
      {{"render"}, "required"},
      {{"render", "v", "w", "-o", "x.png"}, "w"},
      {{"render", "v"}, "--output"},
      {{"turntable", "v", "-o", "%d.png"}, "--frames"},
      {{"sphere", "--size", "8", "-o", "s.nrrd"}, "--class"},
      {{"info"}, "SOURCE"},
      {{"bench", "class3-256"}, "CASE 'class3-256'"},
      {{"bench", "brain", "brain"}, "a case called brain is given before it"},
      {{"bench", "--size", "8193"}, "--size 8193 is out of range [1, 8192]"},
      {{"bench", "--frames", "0"}, "--frames 0 is out of range [1, 100000]"},
      {{"bench", "--turns", "1001"}, "--turns 1001 is out of range [1, 1000]"},
      {{"bench", "--workers", "0"}, "--workers 0 is out of range [1, 256]"},
      {{"bench", "--renderer", "ray"}, "--renderer 'ray' is not one of splat, raycast"},
      {{"bench", "--json", "no/r.json"}, "--json 'no/r.json'"},
      {{"bench", "--pictures", "/proc/no"}, "--pictures '/proc/no'"},
      {{"bench", "--export", "/proc/no"}, "--export '/proc/no'"},
      {{"bench", "--endpoint", "tcp://127.0.0.1:1", "--workers", "2"}, "--workers"},
      {{"up", "--workers", "257"}, "--workers 257 is out of range [1, 256]"},
      {{"up", "--threads", "0"}, "--threads 0 is out of range [1, 1024]"},
      {{"up", "--threads", "1025"}, "--threads 1025 is out of range [1, 1024]"},
      {{"render", "v", "--threads", "2", "-o", "x.png"}, "--local"},
      {{"render", "v", "--local", "--threads", "two", "-o", "x.png"}, "--threads 'two'"},
      {{"up", "--listen", "http://x"}, "--listen"},
      {{"render", "v", "-o", "x.png", "--decomposition", "auto"}, "--decomposition 'auto'"},
      {{"render", "v", "-o", "x.png", "--combine", "auto"}, "--combine 'auto' is not one of fan-in"},
      {{"status", "--endpoint", "tcp://0.0.0.0:1"}, "--endpoint"},
      {{"down", "--endpoint", "tcp://127.0.0.1:*"}, "--endpoint"},
      {{"data"}, "slabstream data: a command is needed: list, add, remove, reload"},
      {{"data", "add"}, "DATA"},
      {{"data", "add", "a=x.nrrd"},
       "a=x.nrrd: the path must be absolute, since it is a path on the coordinator's host; on this host it would be /"},
      {{"data", "add", "x"}, "x: the path must be absolute"},
      {{"data", "add", "a="}, "a path of 0 bytes, must have 1 to 4096"},
      {{"data", "add", "a=/" + std::string(4096, 'p')}, "a path of 4097 bytes, must have 1 to 4096"},
      {{"data", "add", "a/b=/x.nrrd"}, "dataset name \"a/b\" must have 1 to 256 letters"},
      {{"data", "add", std::string(257, 'n') + "=/x.nrrd"}, "must have 1 to 256"},
      {{"data", "remove"}, "NAME"},
      {{"data", "remove", ""}, "NAME has 0 bytes, must have 1 to 5120"},
      {{"data", "reload", std::string(5121, 'n')}, "NAME has 5121 bytes, must have 1 to 5120"},
      {{"data", "list", "all"}, "all"},
      {{"data", "list", "--endpoint", "nowhere"}, "--endpoint"},
      {many, "129 datasets at a time, at most 128 can be named"},
      {{"logs", "--since", "yesterday"}, "--since 'yesterday'"},
      {{"logs", "--endpoint", "nowhere"}, "--endpoint"},
      {{"up", "--log-level", "loud"}, "--log-level 'loud'"},
      {{"status", "--log-level", "loud"}, "--log-level 'loud'"},
      {{"--log-level", "loud", "status"}, "--log-level 'loud'"},
      {{"sphere", "--class", "3", "--size", "8", "-o", "s.nrrd"}, "--class 3"},
      {{"sphere", "--class", "1", "--size", "1", "-o", "s.nrrd"}, "--size 1"},
      {{"sphere", "--class", "2", "--size", "8", "--occupancy", "0.9", "-o", "s.nrrd"}, "occupancy"},
      {{"sphere", "--class", "2", "--size", "8", "-o", "s.txt"}, "s.txt"},
      {{"sphere", "--class", "2", "--size", "8", "-o", "no/s.nrrd"}, "no"},
      {{"info", "missing.nrrd"}, "missing.nrrd"},
      {{"transfer", "auto", "missing.nrrd"}, "missing.nrrd"},
      {{"transfer", "nice", "missing.nrrd"}, "PRESET 'nice' is not one of auto, gray-ramp"},
      {{"transfer", "auto"}, "SOURCE"},
      {{"turntable", "v", "--frames", "2", "-o", "f.png"}, "f.png"},
      {{"turntable", "v", "--frames", "2", "-o", "%d_%d.png"}, "%d_%d.png"},
      {{"turntable", "v", "--frames", "2", "-o", "%d.gif"}, ".gif"},
      {{"turntable", "v", "--frames", "0", "-o", "%d.png"}, "--frames 0"},
      {{"turntable", "v", "--frames", "2", "--in-flight", "0", "-o", "%d.png"}, "--in-flight 0"},
  };
  ExpectEachRefused({}, cases);
}

TEST_F(BadInputTest, WhoTypesNoCommandSeesExamples) {
  const std::string help = Slabstream({}).out;
  EXPECT_THAT(help, HasSubstr("Examples:\n  slabstream view head.nii.gz"));
  EXPECT_THAT(help, HasSubstr("turntable"));
  const std::string render = MustRun({"render", "--help"}).out, all = MustRun({"render", "--help-all"}).out;
  EXPECT_THAT(render, HasSubstr("options: slabstream render --help-all\n"));
  EXPECT_THAT(render, Not(HasSubstr("--pixel-error")));
  EXPECT_THAT(all, HasSubstr("--pixel-error"));
  EXPECT_EQ(render, MustRun({"help", "render"}).out);
}

TEST_F(BadInputTest, OptionsOfSlice) {
  MakeSphere("ball.nrrd", 2, 16);
  const std::vector<Refusal> cases = {
      {{"--plane", "oblique"}, "--plane 'oblique' is not one of axial, coronal"},
      {{"--plane", "axial"}, "no patient's orientation"},
      {{"--index", "3"}, "--index 3 is the number of a slice of one --plane"},
      {{"--plane", "z", "--index", "16"}, "clip.slab.index is 16, but the volume has slices 0 to 15 along z"},
      {{"--plane", "z", "--index", "-1"}, "--index -1"},
      {{"--plane", "z", "--index", "1", "--at", "1,2,3"}, "--at"},
      {{"--at", "1,2"}, "--at '1,2'"},
      {{"--thickness", "-1"}, "--thickness -1"},
      {{"--window", "0"}, "--window 0"},
      {{"--level", "5"}, "--window"},
      {{"--window", "5", "--transfer", "opaque"}, "--transfer"},
      {{"--interpolation", "cubic"}, "linear, nearest"},
      {{"--size", "9000"}, "size"},
  };
  ExpectEachRefused({"slice", Path("ball.nrrd"), "--local=1", "-o", Path("x.png")}, cases);
}

TEST_F(BadInputTest, OptionsOfRender) {
  MakeSphere("ball.nrrd", 2, 16);
  Write("empty.json", "");
  Write("broken.json", "[{\"RGBPoints\": [0, 1");
  Write("short.json", R"([{"RGBPoints": [0, 1, 1]}])");
  Write("descending.json", R"([{"RGBPoints": [1, 0, 0, 0, 0, 1, 1, 1]}])");
  Write("huge.json", R"([{"RGBPoints": [0, 0, 0, 0, 1e999, 1, 1, 1]}])");
  std::vector<std::string> nine_lights;
  for (int i = 0; i < 9; ++i) nine_lights.insert(nine_lights.end(), {"--light", "1,0,0"});
  const std::vector<Refusal> cases = {
      {{"--zoom", "0"}, "slabstream render: --zoom 0 is out of range [0.001, 10000]\n"},
      {{"--zoom", "nan"}, "--zoom"},
      {{"--zoom", "-1"}, "--zoom -1"},
      {{"--zoom", "two"}, "--zoom 'two'"},
      {{"--zoom"}, "--zoom"},
      {{"--azimuth", "inf"}, "--azimuth"},
      {{"--elevation", "1e7"}, "--elevation"},
      {{"--roll", ""}, "--roll"},
      {{"--fov", "0.5"}, "--fov 0.5"},
      {{"--fov", "61"}, "--fov 61"},
      {{"--size", "0"}, "--size 0"},
      {{"--size", "100x0"}, "--size 0"},
      {{"--size", "99999x1"}, "--size 99999"},
      {{"--size", "1x2x3"}, "--size '1x2x3'"},
      {{"--projection", "fisheye"}, "orthographic, perspective"},
      {{"--renderer", "ray"}, "splat, raycast"},
      {{"--shading", "toon"}, "phong, none, depth-gradient"},
      {{"--shading", "depth-gradient", "--jitter", "1"},
       "no renderer does all that is asked: shading 'depth-gradient' needs one of: zbuffer; jitter needs one of: raycast"},
      {{"--transfer", "no-such-preset"}, "no-such-preset"},
      {{"--transfer", "missing.json"}, "missing.json"},
      {{"--transfer", "empty.json"}, "empty.json"},
      {{"--transfer", "broken.json"}, "broken.json"},
      {{"--transfer", "short.json"}, "short.json"},
      {{"--transfer", "descending.json"}, "descending.json"},
      {{"--transfer", "huge.json"}, "huge.json"},
      {{"--opacity-distance", "0"}, "--opacity-distance 0"},
      {{"--scalar-range", "5"}, "--scalar-range '5' is neither LOW:HIGH nor LOW%:HIGH%"},
      {{"--scalar-range", "5%:104%"}, "--scalar-range 104"},
      {{"--scalar-range", "5:4"}, "--scalar-range '5:4' must rise"},
      {{"--isovalue", "5", "--energy", "60"},
       "no renderer does all that is asked: isovalue needs one of: raycast, zbuffer; energy needs one of: xray"},
      {{"--isovalue", "5", "--renderer", "mip"}, "renderer is 'mip', but isovalue needs one of: raycast, zbuffer"},
      {{"--isovalue", "red"}, "--isovalue 'red'"},
      {{"--isovalue", "5:rouge"}, "nor the name of a colour"},
      {{"--isovalue", "5:red:2"}, "--isovalue 2"},
      {{"--isovalue", "5:red:1:1"}, "--isovalue '5:red:1:1' is not V[:COLOUR[:OPACITY]]"},
      {{"--isovalue", "5,7,5"}, "--isovalue '5,7,5' has the value 5 twice"},
      {{"--isovalue", "1,2,3,4,5,6,7,8,9"}, "has more than 8 values"},
      {{"--gradient-opacity", "1:1", "--renderer", "zbuffer"}, "renderer is 'zbuffer', but gradient-opacity needs one of: raycast, shear"},
      {{"--projection", "perspective", "--renderer", "shear"},
       "renderer is 'shear', but projection 'perspective' needs one of: splat, raycast, zbuffer, mip"},
      {{"--transfer", "ct-bone-2d", "--renderer", "splat"},
       "renderer is 'splat', but a two-dimensional transfer function needs one of: raycast"},
      {{"--gradient-opacity", "1"}, "--gradient-opacity '1' is not GRADIENT:OPACITY"},
      {{"--gradient-opacity", "2:1,1:1"}, "slope of gradient opacity point 1 is 1, must be at least that of the one before, 2"},
      {{"--gradient-opacity", "1:7"}, "--gradient-opacity 7"},
      {{"--light", "0,0,0"}, "--light 0,0,0"},
      {{"--light", "1,2"}, "--light '1,2'"},
      {nine_lights, "at most 8"},
      {{"--background", "1,1,2"}, "--background 2"},
      {{"--background", "#12"}, "is neither #rgb nor #rrggbb nor #rrggbbaa"},
      {{"--background", "rouge"}, "nor the name of a colour"},
      {{"--clip-box", "0:1,0:1"}, "--clip-box '0:1,0:1' is not X0:X1,Y0:Y1,Z0:Z1"},
      {{"--clip-box", "0:1,3:2,:"}, "y runs from 3 to 2, but must rise"},
      {{"--clip-box", "0:x,:,:"}, "--clip-box 'x'"},
      {{"--clip-plane", "1,0,0"}, "--clip-plane '1,0,0' is not NX,NY,NZ,D"},
      {{"--clip-plane", "0,0,0,1"}, "has no direction"},
      {{"--clip-mode", "away"}, "keep, cut-away"},
      {{"--termination", "0.6"}, "--termination 0.6"},
      {{"--title", "two\nlines"}, "--title has a control character at byte 3"},
      {{"--title", "\xFF"}, "--title is not UTF-8: byte 0 is 0xFF"},
      {{"--title", std::string(121, 'x')}, "--title has 121 characters, at most 120 are possible"},
      {{"--title"}, "--title"},
      {{"--scale-bar=wide"}, "--scale-bar"},
      {{"--axes", "cube"}, "--axes 'cube' is not one of off, box, axes, grid"},
      {{"--decomposition", "cheese"}, "--decomposition 'cheese' is not one of slab"},
      {{"--balance-by", "hairs"}, "--balance-by 'hairs'"},
      {{"--assignment", "lots"}, "--assignment 'lots'"},
      {{"--balance", "act"}, "--balance 'act'"},
      {{"--combine", "glue"}, "--combine 'glue'"},
      {{"--axis", "w"}, "x, y, z, auto"},
      {{"--groups", "-1"}, "--groups -1"},
      {{"--groups", "1025"}, "--groups 1025"},
      {{"--depth", "12"}, "--depth '12'"},
      {{"--no-such-option"}, "--no-such-option"},
      {{"--stats", "no/s.json"}, "--stats"},
      {{"--trace", "no/t.json"}, "--trace"},
      {{"--endpoint", "nowhere"}, "--endpoint"},
  };
  ExpectEachRefused({"render", "ball.nrrd", "-o", "x.png", "--local=1"}, cases);
  ExpectRefused({"render", "ball.nrrd", "-o", "x.png", "--local=0"}, "--local 0");
  ExpectRefused({"render", "ball.nrrd", "-o", "x.png", "--local=many"}, "--local 'many'");
  ExpectRefused({"render", "ball.nrrd", "--local=1", "-o", "x.gif"}, "x.gif");
  ExpectRefused({"render", "ball.nrrd", "--local=1", "-o", "x"}, "'x'");
  ExpectRefused({"render", "ball.nrrd", "--local=1", "-o", "no/such/x.png"}, "no/such");
}

TEST_F(BadInputTest, OptionsOfSlurm) {
  MakeSphere("ball.nrrd", 2, 16);
  const std::vector<Refusal> cases = {
      {{"--nodes", "0"}, "--nodes 0"},
      {{"--nodes", "1001"}, "--nodes 1001"},
      {{"--workers-per-node", "257"}, "--workers-per-node 257"},
      {{"--threads", "-1"}, "--threads -1"},
      {{"--time", "1\nx"}, "option 'time=1?x' of sbatch"},
      {{"--notice", "0"}, "--notice 0"},
      {{"--data", "missing=no.nrrd"}, "no.nrrd"},
      {{"--data", "a/b=ball.nrrd"}, "a/b"},
      {{"--folder", "ball.nrrd"}, "--folder 'ball.nrrd'"},
      {{"--sbatch", "array=0-9"}, "option 'array=0-9' of sbatch"},
  };
  ExpectEachRefused({"slurm", "--data", "ball=ball.nrrd"}, cases);
  ExpectRefused({"slurm"}, "--data");
}

TEST_F(BadInputTest, VolumeFiles) {
  MakeSphere("ball.nrrd", 2, 16);
  const std::string whole = ReadFile("ball.nrrd");
  const std::string header = "NRRD0004\ntype: uint8\ndimension: 3\nencoding: raw\n";
  Write("empty.nrrd", "");
  Write("text.nrrd", "this is no volume\n");
  Write("truncated.nrrd", whole.substr(0, whole.size() / 2));
  Write("short.nrrd", header + "sizes: 100 100 100\n\nabc");
  Write("absurd.nrrd", header + "sizes: 2000000000 2000000000 2000000000\n\nabc");
  Write("wide.nrrd", header + "sizes: 65536 1 1\n\n" + std::string(65536, 'x'));
  Write("flat.nrrd", header + "sizes: 0 10 10\n\nabc");
  Write("negative.nrrd", header + "sizes: -5 10 10\n\nabc");
  Write("empty.nii", "");
  Write("garbage.nii", std::string(400, '\x7f'));
  Write("notes.txt", "a volume it is not");
  for (const char* name : {"missing.nrrd", "empty.nrrd", "text.nrrd", "truncated.nrrd", "short.nrrd", "absurd.nrrd", "wide.nrrd",
                           "flat.nrrd", "negative.nrrd", "empty.nii", "garbage.nii", "notes.txt", "."}) {
    ExpectRefused({"render", Path(name), "--local=1", "-o", "x.png"}, name);
    ExpectRefused({"info", Path(name)}, name);
    ExpectRefused({"bench", Path(name)}, name);
  }
}

TEST_F(BadInputTest, PicturesOfInfo) {
  MakeSphere("ball.nrrd", 2, 16);
  MustRun({"render", "ball.nrrd", "--local=1", "--size", "16", "-o", "good.png"});
  const std::string whole = ReadFile("good.png");
  Write("empty.png", "");
  Write("text.png", "this is no picture\n");
  Write("short.png", whole.substr(0, 40));
  Write("bitten.png", whole.substr(0, whole.find("slabstream") + 50));
  Write("volume.exr", ReadFile("ball.nrrd"));
  std::string altered = whole;
  altered[altered.find("\"program\"") + 1] = 'P';  // the checksum does not hold any more
  Write("altered.png", altered);
  for (const char* name : {"missing.png", "missing.exr", "empty.png", "text.png", "short.png", "bitten.png", "volume.exr", "altered.png"}) {
    ExpectRefused({"info", Path(name)}, name);
    ExpectRefused({"info", Path(name), "--json"}, name);
  }
  ExpectRefused({"info", "good.png", "--transfer", "opaque"}, "is a picture");
  ExpectRefused({"info", "good.png:opaque"}, "is a picture");
}

TEST_F(BadInputTest, UnstructuredGrids) {
  const std::string header = "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid><Piece NumberOfPoints=\"4\" NumberOfCells=\"1\">";
  Write("empty.vtu", "");
  Write("text.vtu", "this is no grid\n");
  Write("image.vtu", "<VTKFile type=\"ImageData\"><ImageData/></VTKFile>");
  Write("bare.vtu", header + "</Piece></UnstructuredGrid></VTKFile>");
  Write("open.vtu", header);
  for (const char* name : {"missing.vtu", "empty.vtu", "text.vtu", "image.vtu", "bare.vtu", "open.vtu"}) {
    ExpectRefused({"info", Path(name)}, name);
    ExpectRefused({"info", Path(name), "--json"}, name);
    ExpectRefused({"render", Path(name), "--local=1", "-o", "x.png"}, name);
  }
  ExpectRefused({"info", "bare.vtu", "--transfer", "opaque"}, "is an unstructured grid");
}

}  // namespace
}  // namespace slabstream
