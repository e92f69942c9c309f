#include "client/request/value_window.h"

#include <fmt/format.h>

#include <cctype>

#include "common/base/did_you_mean.h"
#include "common/base/find_named.h"
#include "common/cli/parse.h"

namespace slabstream {

Result<ValueWindow> ParseValueWindow(const std::string& option, const std::string& text) {
  if (const NamedWindow* const named = FindNamed(kNamedWindows, text)) return named->window;
  if (!text.empty() && std::isalpha(static_cast<unsigned char>(text.front())) != 0) {
    return Status::InvalidArgument(
        fmt::format("{} '{}' is neither a number nor one of {}{}", option, text, NamesOf(kNamedWindows), DidYouMean(text, kNamedWindows)));
  }
  const Result<double> width = ParseNumber(option, text, {0, 1e30, true});
  if (!width.ok()) return width.status();
  return ValueWindow{*width, *width / 2};
}

}  // namespace slabstream
