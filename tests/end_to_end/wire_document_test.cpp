// The client that docs/wire.md prints, run as it stands there: only the endpoint is another.
#include <gmock/gmock.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "tests/end_to_end/picture_file.h"
#include "tests/end_to_end/program.h"

namespace slabstream {
namespace {

constexpr const char* kPython = "/usr/bin/python3";

std::string ReadAll(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

// All blocks of Python in a document, one after another.
std::string PythonOf(const std::string& document) {
  const std::string begin_mark = "```python\n", end_mark = "```\n";
  std::string code;
  for (std::size_t at = 0; (at = document.find(begin_mark, at)) != std::string::npos;) {
    const std::size_t begin = at + begin_mark.size();
    at = document.find(end_mark, begin);
    code += document.substr(begin, at - begin);
  }
  return code;
}

class WireDocumentTest : public EndToEndTest {
 protected:
  ProgramResult Run(const std::vector<std::string>& command) const { return RunningProgram(command, directory_).Wait(); }
};

TEST_F(WireDocumentTest, ItsClientGetsThePicture) {
  if (!std::filesystem::exists(kPython) || Run({kPython, "-c", "import zmq, numpy, zstandard, google.protobuf"}).exit_status != 0) {
    GTEST_SKIP() << "install python3-zmq, python3-protobuf, python3-numpy and python3-zstandard";
  }
  const std::string root = SLABSTREAM_SOURCE_DIRECTORY;
  std::vector<std::string> protoc = {SLABSTREAM_PROTOC, "--python_out=python", "-I", root + "/proto"};
  for (const auto& entry : std::filesystem::directory_iterator(root + "/proto/slabstream/v1")) {
    if (entry.path().extension() == ".proto") protoc.push_back(entry.path());
  }
  std::filesystem::create_directory(Path("python"));
  const ProgramResult generated = Run(protoc);
  ASSERT_EQ(generated.exit_status, 0) << generated.err;

  std::string client = PythonOf(ReadAll(root + "/docs/wire.md"));
  const std::string printed = "tcp://127.0.0.1:7420", endpoint = "ipc://" + Path("s");
  const std::size_t at = client.find(printed);
  ASSERT_NE(at, std::string::npos) << "the document's client connects elsewhere";
  client.replace(at, printed.size(), endpoint);
  // What it got, on the whole frame.
  client +=
      "\nb = answer.frame_reply.runs.image.bounds\nframe = numpy.zeros((512, 512, 4), numpy.float32)\n"
      "frame[b.y_begin:b.y_end, b.x_begin:b.x_end] = picture\nframe.tofile('frame.f32')\n";
  std::ofstream(Path("python/client.py")) << client;

  MustRun({"up", "--detach", "--workers", "2", "--listen", endpoint, "--data", "brain=" + MakeSphere("ball.nrrd", 2, 32)});
  const ProgramResult result = Run({kPython, "python/client.py"});
  ASSERT_EQ(result.exit_status, 0) << result.err;

  MustRun({"render", "brain", "--size", "512", "--azimuth", "45", "-o", "same.exr"});
  const PictureFile expected = ReadPicture(Path("same.exr"));
  PictureFile found{512, 512, {"R", "G", "B", "A"}, std::vector<float>(512 * 512 * 4)};
  const std::string bytes = ReadAll(Path("frame.f32"));
  ASSERT_EQ(bytes.size(), found.samples.size() * sizeof(float));
  std::memcpy(found.samples.data(), bytes.data(), bytes.size());
  EXPECT_GT(*std::max_element(found.samples.begin(), found.samples.end()), 0.5F);
  EXPECT_LE(LargestDifference(found, expected), 2e-5 + 1.0 / 1024);
}

}  // namespace
}  // namespace slabstream
