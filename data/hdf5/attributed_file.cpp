#include "data/hdf5/attributed_file.h"

#include <fmt/format.h>

#include <algorithm>

namespace slabstream {

Status AttributedFile::CheckSize(const std::string& dataset, const std::vector<std::uint64_t>& size) const {
  const auto refused = [&](const std::string& why) { return Status::InvalidArgument(Named(dataset) + why); };
  if (size.empty()) return refused(" has no axes: it is one value, or none");
  if (size.size() > kMaxArrayAxes) return refused(fmt::format(" has {} axes, must have at most {}", size.size(), kMaxArrayAxes));
  if (std::ranges::find(size, 0U) != size.end()) return refused(fmt::format(" is empty: it is of {}", fmt::join(size, " x ")));
  return Status::Ok();
}

}  // namespace slabstream
