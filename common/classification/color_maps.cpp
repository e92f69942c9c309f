#include "common/classification/color_maps.h"

#include <array>
#include <cstdint>
#include <span>

namespace slabstream {
namespace {

// Colours 0xrrggbb at equal distances, to be interpolated linearly: within 0.02 of the maps themselves.
using Table = std::array<std::uint32_t, 33>;

constexpr Table kViridis = {0x440154, 0x470d60, 0x48186a, 0x482374, 0x472d7b, 0x453681, 0x424086, 0x3f4989, 0x3b528b, 0x375a8d, 0x33638d,
                            0x2f6a8e, 0x2c728e, 0x297a8e, 0x26818e, 0x23898e, 0x21908c, 0x1f988b, 0x1f9f88, 0x21a685, 0x28ae80, 0x31b57b,
                            0x3ebc74, 0x4cc26c, 0x5dc963, 0x6ece58, 0x82d34c, 0x96d83f, 0xabdc32, 0xc0df24, 0xd5e21a, 0xeae51a, 0xfde725};
constexpr Table kMagma = {0x000004, 0x030311, 0x0a0822, 0x130d33, 0x1d1146, 0x28115a, 0x36106a, 0x430f76, 0x50127c, 0x5d177f, 0x691c81,
                          0x762181, 0x822681, 0x8f2a81, 0x9c2e7f, 0xa9327d, 0xb63779, 0xc33b75, 0xcf4170, 0xdb486a, 0xe65163, 0xee5c5e,
                          0xf5695c, 0xf9785d, 0xfb8761, 0xfd9668, 0xfea571, 0xfeb47b, 0xfec387, 0xfed194, 0xfde0a2, 0xfceeb0, 0xfcfdbf};
constexpr Table kInferno = {0x000004, 0x040312, 0x0b0724, 0x150b37, 0x210c4a, 0x2e0a5a, 0x3c0965, 0x4a0c6b, 0x57106d, 0x63146e, 0x70196e,
                            0x7d1e6d, 0x89226a, 0x962766, 0xa32b61, 0xaf315c, 0xbb3755, 0xc63e4d, 0xd14644, 0xdb4f3b, 0xe35932, 0xeb6528,
                            0xf1711e, 0xf67f14, 0xf98d0a, 0xfb9c06, 0xfcab0f, 0xfbba1f, 0xf9ca32, 0xf5d949, 0xf2e865, 0xf3f586, 0xfcffa4};
constexpr Table kPlasma = {0x0d0887, 0x220690, 0x310596, 0x3f049c, 0x4c02a1, 0x5901a5, 0x6600a7, 0x7201a8, 0x7e03a8, 0x8909a6, 0x9511a2,
                           0x9f1a9c, 0xa92396, 0xb22c8e, 0xbb3587, 0xc33e80, 0xcb4778, 0xd25071, 0xd9596a, 0xe06263, 0xe66c5c, 0xeb7555,
                           0xf07f4f, 0xf48a48, 0xf89441, 0xfb9f3a, 0xfdab33, 0xfeb72d, 0xfdc328, 0xfcd025, 0xf9dd25, 0xf5eb27, 0xf0f921};
constexpr Table kCividis = {0x00224e, 0x00285b, 0x002e6a, 0x043371, 0x1a386f, 0x273e6e, 0x32436d, 0x3b496c, 0x434e6c, 0x4b546c, 0x52596d,
                            0x5a5f6e, 0x61656f, 0x686a71, 0x6f7073, 0x757676, 0x7c7b78, 0x848179, 0x8b8778, 0x938d78, 0x9b9376, 0xa39a75,
                            0xaba072, 0xb3a670, 0xbbad6c, 0xc3b469, 0xccba64, 0xd4c15f, 0xddc958, 0xe6d051, 0xefd748, 0xf8df3c, 0xfee838};
constexpr Table kTurbo = {0x30123b, 0x392a73, 0x4040a1, 0x4456c7, 0x466be3, 0x467ff6, 0x4293ff, 0x37a7fa, 0x29bbec, 0x1dcdd8, 0x18dcc3,
                          0x1ee8b0, 0x31f299, 0x4cf97e, 0x6bfd64, 0x8aff4d, 0xa3fd3c, 0xb8f735, 0xcced34, 0xdee037, 0xedd03a, 0xf8c03a,
                          0xfdae35, 0xfe982c, 0xfb8022, 0xf56817, 0xec520f, 0xe04009, 0xd23105, 0xc02302, 0xac1701, 0x950d01, 0x7a0403};
constexpr Table kCoolwarm = {0x3b4cc0, 0x445acc, 0x4e68d7, 0x5875e1, 0x6282ea, 0x6c8ef1, 0x779af7, 0x82a5fb, 0x8db0fe, 0x98b9ff, 0xa3c2ff,
                             0xaec9fd, 0xb8d0f9, 0xc2d5f4, 0xccd9ee, 0xd5dbe6, 0xdddddd, 0xe5d8d1, 0xecd3c6, 0xf1ccb9, 0xf5c4ad, 0xf7bba0,
                             0xf7b194, 0xf7a687, 0xf49a7b, 0xf18d6f, 0xec7f63, 0xe57057, 0xde614c, 0xd55042, 0xcb3e38, 0xc0282f, 0xb40426};

std::vector<ColorMap::Point> PointsOf(std::span<const std::uint32_t> codes) {
  std::vector<ColorMap::Point> points;
  for (std::size_t i = 0; i < codes.size(); ++i) {
    const auto channel = [&](int shift) { return float(codes[i] >> shift & 0xFF) / 255; };
    points.push_back({double(i) / double(codes.size() - 1), {channel(16), channel(8), channel(0)}});
  }
  return points;
}

constexpr std::string_view kMatplotlib = "N. Smith and S. van der Walt for matplotlib, 2015; CC0";

}  // namespace

Rgb ColorMap::At(double place) const {
  const auto next = std::ranges::upper_bound(points, place, {}, &Point::at);
  if (next == points.end()) return points.back().color;
  if (next == points.begin()) return points.front().color;
  const auto& [at, from] = next[-1];
  const auto t = float((place - at) / (next->at - at));
  const auto mix = [t](float a, float b) { return a + t * (b - a); };
  return {mix(from.r, next->color.r), mix(from.g, next->color.g), mix(from.b, next->color.b)};
}

const std::vector<ColorMap>& NamedColorMaps() {
  static const std::vector<ColorMap> maps = {
      {"grey", "colour map: black to white", "two points", {{0, {0, 0, 0}}, {1, {1, 1, 1}}}},
      {"viridis", "colour map: dark violet, green, yellow; perceptually uniform", kMatplotlib, PointsOf(kViridis)},
      {"magma", "colour map: black, purple, light yellow; perceptually uniform", kMatplotlib, PointsOf(kMagma)},
      {"inferno", "colour map: black, red, light yellow; perceptually uniform", kMatplotlib, PointsOf(kInferno)},
      {"plasma", "colour map: dark blue, pink, yellow; perceptually uniform", kMatplotlib, PointsOf(kPlasma)},
      {"cividis", "colour map: dark blue to yellow; alike with and without colour blindness",
       "J. Nunez, C. Anderton and R. Renslow, PLoS ONE 13(7), 2018; CC BY 4.0", PointsOf(kCividis)},
      {"turbo", "colour map: a smooth rainbow", "A. Mikhailov, Google AI blog, 2019; Apache 2.0", PointsOf(kTurbo)},
      {"coolwarm", "colour map: blue, grey, red; diverging, for values with a middle",
       "formula of K. Moreland, Diverging Color Maps for Scientific Visualization, 2009", PointsOf(kCoolwarm)},
      {"hot",
       "colour map: black, red, yellow, white",
       "straight lines between these four",
       {{0, {0, 0, 0}}, {0.375, {1, 0, 0}}, {0.75, {1, 1, 0}}, {1, {1, 1, 1}}}},
      {"jet",
       "colour map: the old rainbow; shows bands that are not in the data",
       "straight lines between six colours",
       {{0, {0, 0, 0.5F}}, {0.125, {0, 0, 1}}, {0.375, {0, 1, 1}}, {0.625, {1, 1, 0}}, {0.875, {1, 0, 0}}, {1, {0.5F, 0, 0}}}},
  };
  return maps;
}

}  // namespace slabstream
