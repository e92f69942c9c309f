// What tests ask of a surface: its edges, area, volume, the same surface in another order, and what a file holds.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <map>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "common/base/check.h"
#include "common/math/vec.h"
#include "data/isosurface/surface_maker.h"

namespace slabstream {

inline Vec3 Point(const std::array<float, 3>& p) { return {p[0], p[1], p[2]}; }

struct EdgeCounts {
  std::int64_t edges = 0;
  std::int64_t open = 0;      // of one triangle
  std::int64_t repeated = 0;  // of several triangles in the same direction
  std::vector<std::array<std::int32_t, 2>> open_edges = {};
};

inline EdgeCounts CountEdges(const SurfacePart& surface) {
  std::map<std::pair<std::int32_t, std::int32_t>, int> directed;
  for (const SurfaceTriangle& triangle : surface.triangles) {
    for (std::size_t i = 0; i < 3; ++i) ++directed[{triangle[i], triangle[(i + 1) % 3]}];
  }
  EdgeCounts counts;
  for (const auto& [edge, times] : directed) {
    const bool opposite = directed.contains({edge.second, edge.first});
    counts.edges += edge.first < edge.second || !opposite ? 1 : 0;
    counts.repeated += times - 1;
    if (opposite) continue;
    ++counts.open;
    counts.open_edges.push_back({edge.first, edge.second});
  }
  return counts;
}

inline std::int64_t EulerCharacteristic(const SurfacePart& surface) {
  return std::int64_t(surface.vertices.size()) - CountEdges(surface).edges + std::int64_t(surface.triangles.size());
}

struct AreaAndVolume {
  double area = 0, volume = 0;  // volume: of a closed surface, above 0 if triangles are counterclockwise from outside
};
inline AreaAndVolume Measure(const SurfacePart& surface) {
  AreaAndVolume sum;
  for (const SurfaceTriangle& triangle : surface.triangles) {
    std::array<Vec3, 3> p;
    for (std::size_t i = 0; i < 3; ++i) p.at(i) = Point(surface.vertices[std::size_t(triangle.at(i))].position);
    sum.area += Length(Cross(p[1] - p[0], p[2] - p[0])) / 2;
    sum.volume += Dot(p[0], Cross(p[1], p[2])) / 6;
  }
  return sum;
}

// Its triangles by their corners, in an order that does not depend on the numbers of vertices.
inline std::vector<std::array<std::array<float, 6>, 3>> Sorted(const SurfacePart& surface) {
  std::vector<std::array<std::array<float, 6>, 3>> triangles;
  for (const SurfaceTriangle& triangle : surface.triangles) {
    std::array<std::array<float, 6>, 3> corners{};
    for (std::size_t i = 0; i < 3; ++i) {
      const SurfaceVertex& vertex = surface.vertices[std::size_t(triangle.at(i))];
      std::ranges::copy(vertex.position, corners.at(i).begin());
      std::ranges::copy(vertex.normal, corners.at(i).begin() + 3);
    }
    std::rotate(corners.begin(), std::ranges::min_element(corners), corners.end());
    triangles.push_back(corners);
  }
  std::ranges::sort(triangles);
  return triangles;
}

inline SurfacePart ReadPly(const std::string& bytes) {
  const std::size_t end = bytes.find("end_header\n") + 11;
  const auto count = [&](const std::string& element) {
    return std::size_t(std::stoll(bytes.substr(bytes.find("element " + element + " ") + 9 + element.size())));
  };
  SurfacePart surface;
  surface.vertices.resize(count("vertex"));
  surface.triangles.resize(count("face"));
  const std::size_t vertices = surface.vertices.size() * sizeof(SurfaceVertex);
  CHECK_EQ(bytes.size(), end + vertices + 13 * surface.triangles.size());
  std::memcpy(surface.vertices.data(), &bytes[end], vertices);
  for (std::size_t i = 0; i < surface.triangles.size(); ++i) {
    CHECK_EQ(bytes[end + vertices + 13 * i], 3);
    std::memcpy(surface.triangles[i].data(), &bytes[end + vertices + 13 * i + 1], 12);
  }
  return surface;
}

}  // namespace slabstream
