// The same object in each of the 48 ways in which a file can store its voxels.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "tests/data/volume_io/volume_files.h"

namespace slabstream {

using Steps = std::array<Vec3, 3>;

// Voxels along three directions of a patient's space (right, anterior, superior), in the order in which they are to be shown.
struct Object {
  Index3 size = {4, 3, 2};
  Steps steps = {Vec3{0.5, 0, 0}, Vec3{0, 1.25, 0}, Vec3{0, 0, 3}};
  Vec3 origin = {-20, 30.5, 7};
  std::function<std::uint8_t(const Index3&)> value;  // the value of a voxel; none: its number
};

// Stored axis i is the object's axis from[i], backwards if flipped[i].
struct Storage {
  std::array<int, 3> from{};
  std::array<bool, 3> flipped{};
};

std::vector<Storage> AllStorages();
std::string Text(const Storage& storage);

struct Stored {
  Index3 size;
  Steps steps;
  Vec3 origin;
  FileBytes samples;  // uint8
};

Stored StoredAs(const Object& object, const Storage& storage);

std::string Text(const Vec3& v, const char* separator = ",");
// `space`: NRRD's name of it. `signs`: from right, anterior, superior to it.
FileBytes NrrdFile(const Stored& stored, const std::string& space = "right-anterior-superior", const Vec3& signs = {1, 1, 1});

}  // namespace slabstream
