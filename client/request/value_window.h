// Windows: the range of data values that slices show from black to white, by width and level as radiologists say it.
#pragma once

#include <array>
#include <string>
#include <string_view>

#include "common/base/status.h"

namespace slabstream {

struct ValueWindow {
  double width = 1, level = 0.5;  // data values; width above 0
  double low() const { return level - width / 2; }
  double high() const { return level + width / 2; }
  friend bool operator==(const ValueWindow&, const ValueWindow&) = default;
};

// The usual windows of CT, in Hounsfield units. The only list: the page and the Python package get it with the option --window.
struct NamedWindow {
  std::string_view name, purpose;
  ValueWindow window;
};
inline constexpr std::array<NamedWindow, 6> kNamedWindows = {{
    {"bone", "width 1800, level 400", {1800, 400}},
    {"lung", "width 1500, level -600", {1500, -600}},
    {"mediastinum", "width 350, level 50", {350, 50}},
    {"soft-tissue", "width 400, level 40", {400, 40}},
    {"brain", "width 80, level 40", {80, 40}},
    {"liver", "width 150, level 30", {150, 30}},
}};

// A width in (0, 1e30], whose level is half of it, or the name of a window. InvalidArgument, beginning with `option`.
Result<ValueWindow> ParseValueWindow(const std::string& option, const std::string& text);

}  // namespace slabstream
