#include "tests/data/mosaic/amrex_files.h"

#include <fmt/format.h>

#include "tests/data/volume_io/volume_files.h"
#include "tests/support/whole_file.h"

namespace slabstream {
namespace {

// Both ends included.
std::string TextOf(const Box& box) {
  const Index3 low = box.begin, high = box.end - Uniform(1);
  return fmt::format("(({},{},{}) ({},{},{}) (0,0,0))", low.x, low.y, low.z, high.x, high.y, high.z);
}

std::string NumbersOf(const Vec3& v) { return fmt::format("{} {} {} ", v.x, v.y, v.z); }

// A box with its ghosts, as AMReX stores it.
std::string FabOf(const AmrexSpec& spec, const AmrexSpec::Level& level, const Box& box, const AmrexField& field) {
  const std::string real = spec.type == SampleType::kFloat64 ? "8, (64 11 52 0 1 12 0 1023)" : "8, (32 8 23 0 1 9 0 127)";
  const auto bytes = int(BytesPerSample(spec.type));
  std::string order;
  for (int i = 0; i < bytes; ++i) order += fmt::format("{}{}", i == 0 ? "" : " ", spec.big_endian ? i + 1 : bytes - i);
  const Index3 first = Uniform(level.factor) * spec.first;
  const Box stored = {box.begin - Uniform(spec.ghosts), box.end + Uniform(spec.ghosts)};
  std::vector<double> values;
  for (const double sign : {1.0, -1.0}) {
    for (std::int32_t z = stored.begin.z; z < stored.end.z; ++z) {
      for (std::int32_t y = stored.begin.y; y < stored.end.y; ++y) {
        for (std::int32_t x = stored.begin.x; x < stored.end.x; ++x) {
          values.push_back(sign * field(spec.corner + (spec.spacing / level.factor) * Vec3{x + 0.5, y + 0.5, z + 0.5}));
        }
      }
    }
  }
  return fmt::format("FAB (({}),({}, ({}))){} 2\n", real, bytes, order, TextOf({stored.begin + first, stored.end + first})) +
         EncodeSamples(spec.type, values, spec.big_endian);
}

}  // namespace

void WritePlotfile(const std::string& folder, const AmrexSpec& spec, const AmrexField& field) {
  std::string header = fmt::format("HyperCLaw-V1.1\n2\nv\nw\n3\n0.5\n{}\n", spec.levels.size() - 1);
  header += NumbersOf(spec.corner) + "\n" + NumbersOf(spec.corner + spec.spacing * ToVec3(spec.size)) + "\n";
  std::string domains, steps, sides, grids;
  for (std::size_t number = 0; number < spec.levels.size(); ++number) {
    const AmrexSpec::Level& level = spec.levels[number];
    const Index3 first = Uniform(level.factor) * spec.first;
    if (number > 0) header += fmt::format("{} ", level.factor / spec.levels[number - 1].factor);
    domains += TextOf({first, first + Uniform(level.factor) * spec.size}) + " ";
    steps += "7 ";
    sides += NumbersOf((spec.spacing / level.factor) * Vec3{1, 1, 1}) + "\n";
    grids += fmt::format("{} {} 0.5\n7\n", number, level.boxes.size());
    std::string of_level = fmt::format("1\n1\n2\n{}\n({} 0\n", spec.ghosts, level.boxes.size()), places;
    std::vector<std::string> files(level.boxes.size());
    for (const Box& box : level.boxes) {
      grids += "0 1\n0 1\n0 1\n";  // corners, which the boxes tell
      of_level += TextOf({box.begin + first, box.end + first}) + "\n";
      const std::size_t file = spec.apart ? std::size_t(&level.boxes.back() - &box) : 0;
      places += fmt::format("FabOnDisk: Cell_D_{:05} {}\n", file, files[file].size());
      files[file] += FabOf(spec, level, box, field);
    }
    const std::string path = fmt::format("{}/Level_{}/Cell", folder, number);
    WriteFile(path + "_H", of_level + fmt::format(")\n{}\n", level.boxes.size()) + places + "\n2,2\n0,0,\n0,0,\n");
    for (std::size_t file = 0; file < files.size(); ++file) {
      if (!files[file].empty()) WriteFile(fmt::format("{}_D_{:05}", path, file), files[file]);
    }
    grids += fmt::format("Level_{}/Cell\n", number);
  }
  WriteFile(folder + "/Header", header + "\n" + domains + "\n" + steps + "\n" + sides + "0\n0\n" + grids);
}

}  // namespace slabstream
