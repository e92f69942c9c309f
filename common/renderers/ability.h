// Ability: what some renderers can do and others cannot. A request for what its renderer cannot do is refused, except that lights and
// transfer functions have no effect without kLights and kTransfer.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace slabstream {

enum class Ability : std::uint8_t {
  kPerspective = 0,      // draws perspective views, too
  kIsosurfaces = 1,      // draws TransferFunction::isosurfaces
  kGradientOpacity = 2,  // multiplies opacities by TransferFunction::gradient_opacities
  kLabels = 3,           // shows the labels of a dataset
  kCells = 4,            // draws the cells of unstructured grids; other datasets are refused
  kLights = 5,           // lights surfaces (Shading)
  kDepthShading = 6,     // lights them by ShadingModel::kDepthGradient, too
  kTransfer = 7,         // shows values by the transfer function
  kLevels = 8,           // draws boxes of one picture from several levels of the dataset
  kShadows = 9,          // shows shadows and ambient occlusion (Shading)
  kRegions = 10,         // shows TransferFunction::regions
  kFields = 11,          // shows several fields of a dataset in one picture
  kSmoothLabels = 12,    // draws LabelSurface::kSmooth
  kRectilinear = 13,     // draws voxels at uneven distances (common/volume/stretch.h)
  kShapes = 14,          // shows meshes, lines and points beside the volume (common/shapes/shape.h)
};

// By value; as the service tells them to clients.
inline constexpr std::array<std::string_view, 15> kAbilityNames = {
    "perspective", "isosurfaces", "gradient-opacity", "labels", "cells",         "lights",      "depth-shading", "transfer",
    "levels",      "shadows",     "regions",          "fields", "smooth-labels", "rectilinear", "shapes"};
constexpr std::string_view NameOf(Ability ability) { return kAbilityNames.at(std::size_t(ability)); }

}  // namespace slabstream
