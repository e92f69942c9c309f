#include "data/isosurface/cell_cases.h"

#include <algorithm>
#include <cstddef>
#include <vector>

#include "common/base/check.h"

namespace slabstream {
namespace {

constexpr int kNone = -1;

int EdgeBetween(int a, int b) {
  const int low = std::min(a, b), x = low >> 2, y = low & 1, z = low >> 1 & 1;
  switch (a ^ b) {
    case 4: return y + 2 * z;
    case 1: return 4 + x + 2 * z;
    default: return 8 + x + 2 * y;
  }
}

// The corners of each face, counterclockwise for who looks from outside the cell.
std::array<std::array<int, 4>, 6> Faces() {
  constexpr std::array<int, 3> kBits = {4, 1, 2};  // of x, y, z in the number of a corner
  std::array<std::array<int, 4>, 6> faces{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int u = kBits.at((axis + 1) % 3), v = kBits.at((axis + 2) % 3), far = kBits.at(axis);
    faces.at(2 * axis) = {0, v, u + v, u};
    faces.at(2 * axis + 1) = {far, far + u, far + u + v, far + v};
  }
  return faces;
}

CellCase MakeCase(int inside, const std::array<std::array<int, 4>, 6>& faces) {
  std::array<int, 12> next{};  // edge behind each edge of a loop
  next.fill(kNone);
  std::array<std::vector<int>, 12> faces_of;
  for (int f = 0; f < 6; ++f) {
    const auto corner = [&face = faces.at(std::size_t(f))](int i) { return face.at(std::size_t(i % 4)); };
    const auto is_in = [&](int i) { return (inside >> corner(i) & 1) != 0; };
    for (int i = 0; i < 4; ++i) {
      const int edge = EdgeBetween(corner(i), corner(i + 1));
      faces_of.at(std::size_t(edge)).push_back(f);
      if (is_in(i) || !is_in(i + 1)) continue;
      int last = i + 1;
      while (is_in(last + 1)) ++last;
      next.at(std::size_t(edge)) = EdgeBetween(corner(last), corner(last + 1));
    }
  }
  const auto share_face = [&](int a, int b) {
    return std::ranges::any_of(faces_of.at(std::size_t(a)), [&](int f) { return std::ranges::count(faces_of.at(std::size_t(b)), f) > 0; });
  };
  CellCase made;
  for (int first = 0; first < 12; ++first) {
    std::vector<std::uint8_t> loop;
    for (int edge = first; next.at(std::size_t(edge)) != kNone;) {
      loop.push_back(std::uint8_t(edge));
      const int behind = next.at(std::size_t(edge));
      next.at(std::size_t(edge)) = kNone;
      edge = behind;
    }
    while (loop.size() >= 3) {  // cut off a corner of the loop
      const std::size_t n = loop.size();
      std::size_t i = 0;
      while (n > 3 && share_face(loop[(i + n - 1) % n], loop[(i + 1) % n])) ++i;
      CHECK(i < n);
      made.triangles.at(made.count++) = {loop[(i + n - 1) % n], loop[i], loop[(i + 1) % n]};
      loop.erase(loop.begin() + std::ptrdiff_t(i));
    }
  }
  return made;
}

}  // namespace

const std::array<CellCase, 256>& CellCases() {
  static const std::array<CellCase, 256> kCases = [] {
    std::array<CellCase, 256> cases;
    for (int inside = 0; inside < 256; ++inside) cases.at(std::size_t(inside)) = MakeCase(inside, Faces());
    return cases;
  }();
  return kCases;
}

}  // namespace slabstream
