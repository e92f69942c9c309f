// Views with a name: along the axes of the volume's world.
#pragma once

#include <array>
#include <string_view>

namespace slabstream {

struct NamedView {
  std::string_view name;     // the side that one looks at
  std::string_view purpose;  // for help texts
  double azimuth_degrees = 0, elevation_degrees = 0;
  bool of_patient = false;  // makes sense only for volumes with a patient's orientation
};

inline constexpr std::array<NamedView, 10> kNamedViews = {{
    {"anterior", "a patient's front", 180, 0, true},
    {"posterior", "a patient's back", 0, 0, true},
    {"superior", "a patient from above, anterior side up", 0, 90, true},
    {"inferior", "a patient from below, anterior side up", 180, -90, true},
    {"left", "from -x, a patient's left", 270, 0, false},
    {"right", "from +x, a patient's right", 90, 0, false},
    {"front", "from -y", 0, 0, false},
    {"back", "from +y", 180, 0, false},
    {"top", "from +z, +y up", 0, 90, false},
    {"bottom", "from -z, -y up", 0, -90, false},
}};

}  // namespace slabstream
