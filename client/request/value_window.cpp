#include "client/request/value_window.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "common/cli/parse.h"

namespace slabstream {

Result<ValueWindow> ParseValueWindow(const std::string& option, const std::string& text) {
  const auto* const named = std::ranges::find(kNamedWindows, text, &NamedWindow::name);
  if (named != kNamedWindows.end()) return named->window;
  if (!text.empty() && std::isalpha(static_cast<unsigned char>(text.front())) != 0) {
    std::string names;
    for (const NamedWindow& window : kNamedWindows) names.append(names.empty() ? "" : ", ").append(window.name);
    return Status::InvalidArgument(fmt::format("{} '{}' is neither a number nor one of {}", option, text, names));
  }
  const Result<double> width = ParseNumber(option, text, {0, 1e30, true});
  if (!width.ok()) return width.status();
  return ValueWindow{*width, *width / 2};
}

}  // namespace slabstream
