// Extents of structured grids in VTK's XML files.
//
// Pure. Any thread.
#pragma once

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>

#include "common/base/status.h"
#include "data/volume_io/vtk_xml.h"

namespace slabstream {

// Points of a grid, from `begin` to `end` along each axis, both included.
struct PointExtent {
  std::array<std::int64_t, 3> begin{}, end{};

  bool empty() const { return end[0] < begin[0] || end[1] < begin[1] || end[2] < begin[2]; }
  std::int64_t Points(std::size_t axis) const { return end[axis] - begin[axis] + 1; }
  friend bool operator==(const PointExtent&, const PointExtent&) = default;
};

// By an attribute of a tag. InvalidArgument: it has not six whole numbers, or some beyond 2^30.
inline Result<PointExtent> ExtentOf(const VtkXmlFile& file, const XmlTag& tag, const std::string& key) {
  const Result<std::vector<double>> numbers = file.Numbers(tag, key, 6, {});
  if (!numbers.ok()) return numbers.status();
  PointExtent extent;
  for (std::size_t i = 0; i < 6; ++i) {
    constexpr double kMost = 1 << 30;
    const double number = (*numbers)[i];
    if (!(std::abs(number) <= kMost) || number != std::floor(number)) {
      return file.Wrong(fmt::format("{} of {} is '{}', must be 6 whole numbers", key, tag.name, tag.Attribute(key)));
    }
    (i % 2 == 0 ? extent.begin : extent.end)[i / 2] = std::int64_t(number);
  }
  return extent;
}

}  // namespace slabstream
