// Reads volumes for tests/oracles/run.py. Each line of standard input is a JSON object:
//
//   source   PATH?OPTION=VALUE,..., as users name it
//   output   where the voxels go: level L to OUTPUT.L, the samples as they are kept in memory, x fastest
//   box      voxels along x, y and z that are read at a time
//
// For each one line of JSON is answered: the format, and for each level its size, type, mapping, spacing and origin; or the error.
#include <fmt/format.h>

#include <cstring>
#include <fstream>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "common/json/json.h"
#include "common/volume/box.h"
#include "common/volume/volume.h"
#include "data/open/open_source.h"

namespace slabstream {
namespace {

Json Numbers(const Vec3& v) { return {v.x, v.y, v.z}; }
Json Numbers(const Index3& v) { return {v.x, v.y, v.z}; }

// The voxels of a level, which are read box by box.
Result<std::vector<std::byte>> ReadBoxes(VolumeSource& source, int level, const Index3& side) {
  const VolumeDescription& description = source.info().levels[std::size_t(level)].description;
  const Index3& size = description.geometry.size;
  const auto bytes = std::int64_t(BytesPerSample(description.type));
  std::vector<std::byte> all(std::size_t(description.voxel_bytes()));
  Index3 begin;
  for (begin.z = 0; begin.z < size.z; begin.z += side.z) {
    for (begin.y = 0; begin.y < size.y; begin.y += side.y) {
      for (begin.x = 0; begin.x < size.x; begin.x += side.x) {
        const Box box{begin, Min(begin + side, size)};
        std::vector<std::byte> part(std::size_t(box.voxel_count() * bytes), std::byte{0xa5});
        if (Status status = source.ReadNow(level, box, part); !status.ok()) return status;
        const Index3 sides = box.size();
        for (std::int64_t row = 0; row < std::int64_t{sides.y} * sides.z; ++row) {
          const std::int64_t y = begin.y + row % sides.y, z = begin.z + row / sides.y;
          std::memcpy(all.data() + ((z * size.y + y) * size.x + begin.x) * bytes, part.data() + row * sides.x * bytes,
                      std::size_t(sides.x * bytes));
        }
      }
    }
  }
  return all;
}

Result<Json> ReadLevels(const Json& request) {
  const Result<SourceText> text = ParseSourceText(request.at("source").get<std::string>());
  if (!text.ok()) return text.status();
  const Result<std::shared_ptr<VolumeSource>> source = OpenSource(text->path, text->options, ProcessReadContext());
  if (!source.ok()) return source.status();
  const SourceInfo& info = (*source)->info();
  const std::vector<std::int32_t> box = request.at("box").get<std::vector<std::int32_t>>();
  Json answer = {{"format", info.format}, {"labels", info.labels}, {"levels", Json::array()}};
  for (std::size_t level = 0; level < info.levels.size(); ++level) {
    const Result<std::vector<std::byte>> voxels = ReadBoxes(**source, int(level), {box.at(0), box.at(1), box.at(2)});
    if (!voxels.ok()) return voxels.status();
    std::ofstream file(fmt::format("{}.{}", request.at("output").get<std::string>(), level), std::ios::binary);
    file.write(reinterpret_cast<const char*>(voxels->data()), std::streamsize(voxels->size()));
    const VolumeDescription& description = info.levels[level].description;
    answer["levels"].push_back({{"size", Numbers(description.geometry.size)},
                                {"type", NameOf(description.type)},
                                {"scale", description.mapping.scale},
                                {"offset", description.mapping.offset},
                                {"spacing", Numbers(description.geometry.spacing)},
                                {"origin", Numbers(description.geometry.orientation.origin)}});
    if (!file.flush()) return Status::Unavailable("the voxels cannot be written");
  }
  return answer;
}

}  // namespace
}  // namespace slabstream

int main() {
  std::string line;
  while (std::getline(std::cin, line)) {
    const slabstream::Result<slabstream::Json> answer = slabstream::ReadLevels(slabstream::Json::Parse(line).value());
    const slabstream::Json told = answer.ok() ? *answer : slabstream::Json{{"error", answer.status().message()}};
    std::cout << told.dump() << std::endl;
  }
}
