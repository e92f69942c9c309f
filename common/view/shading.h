// How surfaces are lit: by Phong (1975) with white lights at infinity, or not at all.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "common/math/vec.h"
#include "common/view/material.h"

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
  // In place of the numbers of a material (On), and with their limits.
  std::optional<float> ambient, diffuse, specular, shininess;
  // From the light volume (worker/light): how strong shadows are, and ambient occlusion by matter nearer than a radius. 0: none.
  float shadows = 0, ambient_occlusion = 0;  // [0, 1]
  float occlusion_radius = 0.1F;             // [0.01, 1], of the longest side of the volume
  bool needs_light_volume() const { return shadows > 0 || ambient_occlusion > 0; }
  // The material with the numbers that stand here in place of its own: in a request on that of the transfer function, in a FrameSetup on
  // the standard one.
  Material On(const Material& material = {}) const {
    return {ambient.value_or(material.ambient), diffuse.value_or(material.diffuse), specular.value_or(material.specular),
            shininess.value_or(material.shininess)};
  }
  friend bool operator==(const Shading&, const Shading&) = default;
};

// Has all numbers of shading.On(material).
inline Shading OnMaterial(Shading shading, const Material& material) {
  const auto [ambient, diffuse, specular, shininess] = shading.On(material);
  shading.ambient = ambient;
  shading.diffuse = diffuse;
  shading.specular = specular;
  shading.shininess = shininess;
  return shading;
}

}  // namespace slabstream
