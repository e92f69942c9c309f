#include "data/isosurface/cell_cases.h"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "common/base/check.h"

namespace slabstream {
namespace {

using Faces = std::array<std::array<std::size_t, 4>, 6>;

std::size_t EdgeBetween(std::size_t a, std::size_t b) {
  const std::size_t low = std::min(a, b), x = low >> 2, y = low & 1, z = low >> 1 & 1;
  return (a ^ b) == 4 ? y + 2 * z : (a ^ b) == 1 ? 4 + x + 2 * z : 8 + x + 2 * y;
}

// The corners of each face, counterclockwise for who looks from outside the cell.
Faces CornersOfFaces() {
  constexpr std::array<std::size_t, 3> kBits = {4, 1, 2};  // of x, y, z in the number of a corner
  Faces faces{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t u = kBits.at((axis + 1) % 3), v = kBits.at((axis + 2) % 3), far = kBits.at(axis);
    faces.at(2 * axis) = {0, v, u + v, u};
    faces.at(2 * axis + 1) = {far, far + u, far + u + v, far + v};
  }
  return faces;
}

CellCase MakeCase(unsigned inside, const Faces& faces) {
  std::array<std::optional<std::size_t>, 12> next;  // edge behind each edge of a loop
  std::array<unsigned, 12> faces_of{};              // of each edge: a bit each
  for (std::size_t f = 0; f < faces.size(); ++f) {
    const auto corner = [&](std::size_t i) { return faces.at(f).at(i % 4); };
    const auto is_in = [&](std::size_t i) { return (inside >> corner(i) & 1) != 0; };
    for (std::size_t i = 0; i < 4; ++i) {
      const std::size_t edge = EdgeBetween(corner(i), corner(i + 1));
      faces_of.at(edge) |= 1U << f;
      if (is_in(i) || !is_in(i + 1)) continue;
      std::size_t last = i + 1;
      while (is_in(last + 1)) ++last;
      next.at(edge) = EdgeBetween(corner(last), corner(last + 1));
    }
  }
  CellCase made;
  for (std::size_t first = 0; first < next.size(); ++first) {
    std::vector<std::size_t> loop;
    for (std::size_t edge = first; next.at(edge); edge = *std::exchange(next.at(edge), std::nullopt)) loop.push_back(edge);
    for (std::size_t n = loop.size(); n >= 3; --n) {  // cuts off a corner
      std::size_t i = 0;
      while (n > 3 && (faces_of.at(loop[(i + n - 1) % n]) & faces_of.at(loop[(i + 1) % n])) != 0) ++i;
      CHECK_LT(i, n);
      made.triangles.at(made.count++) = {std::uint8_t(loop[(i + n - 1) % n]), std::uint8_t(loop[i]), std::uint8_t(loop[(i + 1) % n])};
      loop.erase(loop.begin() + std::ptrdiff_t(i));
    }
  }
  return made;
}

}  // namespace

const std::array<CellCase, 256>& CellCases() {
  static const std::array<CellCase, 256> kCases = [] {
    std::array<CellCase, 256> cases;
    for (unsigned inside = 0; inside < 256; ++inside) cases.at(inside) = MakeCase(inside, CornersOfFaces());
    return cases;
  }();
  return kCases;
}

}  // namespace slabstream
