#include "tests/data/volume_io/stored_object.h"

#include <fmt/format.h>

#include <algorithm>

namespace slabstream {

std::vector<Storage> AllStorages() {
  std::vector<Storage> all;
  std::array<int, 3> from = {0, 1, 2};
  do {
    for (unsigned flips = 0; flips < 8; ++flips) all.push_back({from, {(flips & 1) != 0, (flips & 2) != 0, (flips & 4) != 0}});
  } while (std::ranges::next_permutation(from).found);
  return all;
}

std::string Text(const Storage& storage) {
  const auto& [from, flipped] = storage;
  return fmt::format("axes {}{}{}, flipped {}{}{}", from[0], from[1], from[2], int(flipped[0]), int(flipped[1]), int(flipped[2]));
}

Stored StoredAs(const Object& object, const Storage& storage) {
  Stored stored{.size = {}, .steps = {}, .origin = object.origin, .samples = {}};
  for (int i = 0; i < 3; ++i) {
    const auto j = std::size_t(i);
    const int axis = storage.from[j];
    const Vec3 step = object.steps[std::size_t(axis)];
    stored.size[i] = object.size[axis];
    stored.steps[j] = storage.flipped[j] ? -step : step;
    if (storage.flipped[j]) stored.origin = stored.origin + double(object.size[axis] - 1) * step;
  }
  for (int z = 0; z < stored.size.z; ++z) {
    for (int y = 0; y < stored.size.y; ++y) {
      for (int x = 0; x < stored.size.x; ++x) {
        Index3 at;
        for (int i = 0; i < 3; ++i) {
          const int along = Index3{x, y, z}[i], axis = storage.from[std::size_t(i)];
          at[axis] = storage.flipped[std::size_t(i)] ? object.size[axis] - 1 - along : along;
        }
        stored.samples += char(object.value ? object.value(at) : std::uint8_t(NumberIn(object.size, at)));
      }
    }
  }
  return stored;
}

std::string Text(const Vec3& v, const char* separator) { return fmt::format("{}{}{}{}{}", v.x, separator, v.y, separator, v.z); }

FileBytes NrrdFile(const Stored& stored, const std::string& space, const Vec3& signs) {
  return fmt::format(
             "NRRD0004\ntype: uint8\ndimension: 3\nsizes: {} {} {}\nencoding: raw\nspace: {}\nspace directions: ({}) ({}) ({})\n"
             "space origin: ({})\n\n",
             stored.size.x, stored.size.y, stored.size.z, space, Text(signs * stored.steps[0]), Text(signs * stored.steps[1]),
             Text(signs * stored.steps[2]), Text(signs * stored.origin)) +
         stored.samples;
}

}  // namespace slabstream
