// Files that tests write and read as a whole.
#pragma once

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "common/base/check.h"

namespace slabstream {

// In place of what is there; makes the folders on its way.
inline void WriteFile(const std::filesystem::path& path, const std::string& bytes) {
  if (path.has_parent_path()) std::filesystem::create_directories(path.parent_path());
  std::filesystem::remove(path);  // some file systems write a file that is overwritten to the disk at once
  std::ofstream file(path, std::ios::binary);
  file.write(bytes.data(), std::streamsize(bytes.size()));
  CHECK(file.good()) << path.string();
}

// The file must be there.
inline std::string ReadFile(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  CHECK(file.good()) << path.string();
  return {std::istreambuf_iterator<char>(file), {}};
}

}  // namespace slabstream
