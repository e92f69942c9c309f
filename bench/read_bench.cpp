// How long a source takes to read and decode a level into nothing: boxes of 256^3 voxels, four at a time. One line of JSON, for
// bench/big_volumes.
#include <chrono>
#include <future>
#include <iostream>
#include <list>
#include <memory>
#include <vector>

#include "common/json/json.h"
#include "common/memory/aligned_buffer.h"
#include "common/volume/box.h"
#include "data/open/open_source.h"

namespace slabstream {
namespace {

constexpr std::int32_t kSide = 256;
constexpr std::size_t kAtATime = 4;

std::vector<Box> BoxesOf(const Index3& size) {
  std::vector<Box> boxes;
  for (std::int32_t z = 0; z < size.z; z += kSide) {
    for (std::int32_t y = 0; y < size.y; y += kSide) {
      for (std::int32_t x = 0; x < size.x; x += kSide) boxes.push_back({{x, y, z}, Min(Index3{x, y, z} + Uniform(kSide), size)});
    }
  }
  return boxes;
}

struct UnderWay {
  AlignedVector<std::byte> bytes;
  std::promise<Status> done;
};

Result<std::int64_t> ReadAll(VolumeSource& source, int level) {
  const VolumeDescription& description = source.info().levels[std::size_t(level)].description;
  std::list<UnderWay> under_way;
  std::int64_t read = 0;
  const auto finish = [&] {
    const Status status = under_way.front().done.get_future().get();
    read += std::int64_t(under_way.front().bytes.size());
    under_way.pop_front();
    return status;
  };
  Status first = Status::Ok();
  for (const Box& box : BoxesOf(description.geometry.size)) {
    if (under_way.size() == kAtATime) first = finish();
    if (!first.ok()) break;
    UnderWay& next = under_way.emplace_back();
    next.bytes.resize(std::size_t(box.voxel_count()) * BytesPerSample(description.type));
    source.Read(level, box, next.bytes, {}, [&next](const Status& status) { next.done.set_value(status); });
  }
  while (!under_way.empty()) {
    if (Status status = finish(); first.ok()) first = status;
  }
  if (!first.ok()) return first;
  return read;
}

int Run(const std::string& path) {
  const Result<SourceText> text = ParseSourceText(path);
  const auto source = text.ok() ? OpenSource(text->path, text->options, ProcessReadContext()) : text.status();
  if (!source.ok()) {
    std::cerr << "read_bench: " << source.status().message() << '\n';
    return 2;
  }
  const auto begin = std::chrono::steady_clock::now();
  const Result<std::int64_t> bytes = ReadAll(**source, 0);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  if (!bytes.ok()) {
    std::cerr << "read_bench: " << bytes.status().message() << '\n';
    return 1;
  }
  std::cout << Json{{"seconds", seconds}, {"bytes", *bytes}} << '\n';
  return 0;
}

}  // namespace
}  // namespace slabstream

int main(int argc, char** argv) {
  if (argc == 2) return slabstream::Run(argv[1]);
  std::cerr << "usage: read_bench SOURCE\n";
  return 2;
}
