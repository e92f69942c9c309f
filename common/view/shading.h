// How surfaces are lit: by Phong (1975) with white lights at infinity, or not at all.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "common/math/vec.h"

namespace slabstream {

inline constexpr int kMaxLights = 8;

enum class ShadingModel : std::uint8_t {
  kPhong = 0,          // normals from the voxels
  kNone = 1,           // the colours of the transfer function
  kDepthGradient = 2,  // Phong with normals from the depths of the finished frame; renderers with depths only
};
inline constexpr std::array<std::string_view, 3> kShadingModelNames = {"phong", "none", "depth-gradient"};  // by ShadingModel
constexpr std::string_view NameOf(ShadingModel model) { return kShadingModelNames.at(std::size_t(model)); }

struct Shading {
  ShadingModel model = ShadingModel::kPhong;
  std::vector<Vec3> lights;  // directions towards the lights, not zero; of a request in the world, of a FrameSetup along the voxels' axes;
                             // empty: a headlight
  // Ambient and diffuse add up to 1: a surface that faces a single light has exactly the colour of its transfer function.
  float ambient = 0.2F, diffuse = 0.8F, specular = 0.2F;  // [0, 1]
  float shininess = 20;                                   // [1, 1000]
  friend bool operator==(const Shading&, const Shading&) = default;
};

}  // namespace slabstream
