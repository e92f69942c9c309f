// The planes that `slice` cuts, by name: how one looks at each, as radiologists do at those of a patient.
#pragma once

#include <array>
#include <span>
#include <string_view>

#include "common/math/vec.h"

namespace slabstream {

struct SlicePlane {
  std::string_view name;
  std::string_view view;  // its name in kNamedViews
  Vec3 normal;            // a direction of the world
  bool of_patient = false;
};

inline constexpr std::array<SlicePlane, 6> kSlicePlanes = {{
    {"axial", "inferior", {0, 0, 1}, true},
    {"coronal", "anterior", {0, 1, 0}, true},
    {"sagittal", "left", {1, 0, 0}, true},
    {"z", "top", {0, 0, 1}},
    {"y", "front", {0, 1, 0}},
    {"x", "right", {1, 0, 0}},
}};

// What --plane takes: one plane, or three of them side by side.
struct SliceChoice {
  std::string_view name, purpose;
  std::span<const SlicePlane> planes;
};
inline constexpr std::array<SliceChoice, 8> kSliceChoices = {{
    {"axial", "across a patient, seen from the feet", std::span(kSlicePlanes).subspan(0, 1)},
    {"coronal", "along a patient, seen from the front", std::span(kSlicePlanes).subspan(1, 1)},
    {"sagittal", "along a patient, seen from the left", std::span(kSlicePlanes).subspan(2, 1)},
    {"anatomical", "axial, coronal and sagittal, side by side", std::span(kSlicePlanes).subspan(0, 3)},
    {"x", "across x, seen from +x", std::span(kSlicePlanes).subspan(5, 1)},
    {"y", "across y, seen from -y", std::span(kSlicePlanes).subspan(4, 1)},
    {"z", "across z, seen from +z", std::span(kSlicePlanes).subspan(3, 1)},
    {"zyx", "z, y and x, side by side", std::span(kSlicePlanes).subspan(3, 3)},
}};

}  // namespace slabstream
