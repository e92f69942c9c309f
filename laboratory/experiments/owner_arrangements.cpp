#include "laboratory/experiments/owner_arrangements.h"

#include <array>
#include <bit>
#include <cmath>
#include <random>

#include "common/volume/indices.h"

namespace slabstream {
namespace {

// The place of a cell on Hilbert's curve through `side`^3 cells: Skilling, "Programming the Hilbert curve", AIP Conference Proceedings 707,
// 2004.
std::uint32_t OnHilbertCurve(const Index3& cell, std::uint32_t side) {
  std::array<std::uint32_t, 3> x = {std::uint32_t(cell.x), std::uint32_t(cell.y), std::uint32_t(cell.z)};
  for (std::uint32_t bit = side / 2; bit > 1; bit /= 2) {
    for (std::uint32_t& each : x) {
      const std::uint32_t below = bit - 1;
      const std::uint32_t exchanged = (each & bit) != 0 ? 0 : (x[0] ^ each) & below;
      x[0] ^= (each & bit) != 0 ? below : exchanged;
      each ^= exchanged;
    }
  }
  x[1] ^= x[0];
  x[2] ^= x[1];
  std::uint32_t turn = 0;
  for (std::uint32_t bit = side / 2; bit > 1; bit /= 2) {
    if ((x[2] & bit) != 0) turn ^= bit - 1;
  }
  std::uint32_t place = 0;
  for (std::uint32_t bit = side / 2; bit > 0; bit /= 2) {
    for (const std::uint32_t each : x) place = 2 * place + (((each ^ turn) & bit) != 0 ? 1 : 0);
  }
  return place;
}

std::uint32_t Scaled(std::uint32_t place, std::uint32_t places, std::uint32_t owners) {
  return std::uint32_t(std::uint64_t{place} * owners / places);
}

// Ranges of a Hilbert curve, as many codes of particles and adaptive meshes cut.
std::uint32_t OwnerOnCurve(const Index3& cell, std::uint32_t side, std::uint32_t owners) {
  return Scaled(OnHilbertCurve(cell, side), side * side * side, owners);
}

// Neighbours along any axis have different owners.
std::uint32_t OwnerOnBoard(const Index3& cell, std::uint32_t /*side*/, std::uint32_t owners) {
  return std::uint32_t(cell.x + cell.y + cell.z) % owners;
}

// As arrays are dealt in blocks: cell (x, y, z) to process (x mod a, y mod b, z mod c) of a grid of a x b x c.
std::uint32_t OwnerOfBlock(const Index3& cell, std::uint32_t /*side*/, std::uint32_t owners) {
  std::uint32_t a = std::uint32_t(std::cbrt(double(owners)) + 1e-9);
  while (owners % a != 0) --a;
  std::uint32_t b = std::uint32_t(std::sqrt(double(owners / a)) + 1e-9);
  while (owners / a % b != 0) --b;
  return std::uint32_t(cell.x) % a + a * (std::uint32_t(cell.y) % b + b * (std::uint32_t(cell.z) % (owners / a / b)));
}

// Layers of about equal numbers of owners, in each of which borders along x wind from row to row.
std::uint32_t OwnerOfJaggedPart(const Index3& cell, std::uint32_t side, std::uint32_t owners) {
  const std::uint32_t layers = std::uint32_t(std::sqrt(double(owners)));
  const std::uint32_t layer = Scaled(std::uint32_t(cell.z), side, layers);
  const std::uint32_t first = Scaled(layer, layers, owners), end = Scaled(layer + 1, layers, owners);
  const std::uint32_t shift = std::uint32_t(3 * cell.y + 5 * cell.z) % (side / 2);
  return first + Scaled(std::uint32_t(cell.x) + shift, side + side / 2, end - first);
}

// By chance, the same every time, as a scheduler of chunks may deal them.
std::uint32_t OwnerByChance(const Index3& cell, std::uint32_t side, std::uint32_t owners) {
  std::minstd_rand random(1 + std::uint32_t(cell.x) + side * (std::uint32_t(cell.y) + side * std::uint32_t(cell.z)));
  random.discard(3);
  return std::uint32_t(random() % owners);
}

}  // namespace

const std::vector<OwnerArrangement>& OwnerArrangements() {
  static const std::vector<OwnerArrangement> entries = {
      {"hilbert", OwnerOnCurve},      {"jagged", OwnerOfJaggedPart}, {"checkerboard", OwnerOnBoard},
      {"block-cyclic", OwnerOfBlock}, {"scattered", OwnerByChance},
  };
  return entries;
}

OwnedBoxes Arrange(const OwnerArrangement& arrangement, const Index3& size, std::uint32_t owners) {
  constexpr std::uint32_t kCellsAnOwner = 32;
  const auto side = std::int32_t(std::bit_ceil(std::uint32_t(std::ceil(std::cbrt(double(kCellsAnOwner) * owners)))));
  const Index3 cells = Min(Uniform(side), size);
  OwnedBoxes owned;
  for (const Index3& cell : IndicesIn(Box{{0, 0, 0}, cells})) {
    Box box;
    for (const Axis axis : kAxes) {
      box.begin[axis] = std::int32_t(std::int64_t{size[axis]} * cell[axis] / cells[axis]);
      box.end[axis] = std::int32_t(std::int64_t{size[axis]} * (cell[axis] + 1) / cells[axis]);
    }
    owned.push_back({box, arrangement.owner(cell, std::uint32_t(side), owners)});
  }
  return owned;
}

}  // namespace slabstream
