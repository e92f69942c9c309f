// Zip archives that tests write.
#pragma once

#include <string>
#include <vector>

namespace slabstream {

struct ZipMember {
  std::string name, bytes;
  bool deflated = false;
};
void WriteZip(const std::string& path, const std::vector<ZipMember>& members);

}  // namespace slabstream
