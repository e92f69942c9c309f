#include <fmt/format.h>

#include <algorithm>

#include "common/text/parse_number.h"
#include "data/volume_io/page_layout.h"

namespace slabstream {
namespace {

// What stands between `begin` and `end` behind a key.
std::string Behind(const std::string& text, std::string_view key, char begin, char end) {
  std::size_t at = text.find(key);
  if (at == std::string::npos) return "";
  at = text.find(begin, at + key.size());
  const std::size_t last = at == std::string::npos ? at : text.find(end, at + 1);
  return last == std::string::npos ? "" : text.substr(at + 1, last - at - 1);
}

std::vector<std::int64_t> NumbersIn(std::string text) {
  std::erase(text, ' ');
  std::vector<std::int64_t> numbers;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    numbers.push_back(ParseNumber<std::int64_t>(std::string_view(text).substr(begin, end - begin)).value_or(0));
    begin = end + 1;
  }
  return numbers;
}

// Takes the axes of a page off the end; whether they are there. Components stand behind x, or before y where they have planes of their own.
bool TakePage(std::vector<std::int64_t>& shape, std::string& axes, const RawHeader& page) {
  const std::int64_t x = page.size.x, y = page.size.y, c = page.components;
  std::vector<std::vector<std::int64_t>> ends = {{y, x}};
  if (c > 1) ends = {{y, x, c}, {c, y, x}};
  for (const std::vector<std::int64_t>& end : ends) {
    if (shape.size() < end.size() || !std::equal(end.rbegin(), end.rend(), shape.rbegin())) continue;
    if (axes.size() == shape.size()) axes.resize(axes.size() - end.size());
    shape.resize(shape.size() - end.size());
    return true;
  }
  return false;
}

// The axis of slices, channels or times that each letter stands for; "": more than one would be the same.
std::string AxesOf(const std::string& letters) {
  std::string axes;
  for (const char letter : letters) {
    const bool slices = letter == 'Z' || ((letter == 'Q' || letter == 'I') && letters.find('Z') == std::string::npos);
    const char axis = slices ? 'Z' : letter == 'C' || letter == 'S' ? 'C' : 'T';
    if (axes.find(axis) != std::string::npos) return "";
    axes += axis;
  }
  return axes;
}

}  // namespace

Result<std::optional<PageLayout>> ReadTifffileHeader(const std::string& path, const std::string& description, const RawHeader& page,
                                                     const ReadOptions& options) {
  const std::optional<PageLayout> none;
  if (!description.starts_with("{\"shape\": [")) return none;
  const std::string text = Behind(description, "\"shape\":", '[', ']');
  std::vector<std::int64_t> shape = NumbersIn(text);
  std::string letters = Behind(description, "\"axes\":", '"', '"');
  if (letters.size() != shape.size()) letters.clear();
  const bool named = !letters.empty();
  if (!TakePage(shape, letters, page) || std::ranges::any_of(shape, [](std::int64_t n) { return n < 1 || n > kMaxVolumes; })) return none;
  for (std::size_t i = shape.size(); i-- > 0;) {
    if (shape[i] != 1) continue;
    shape.erase(shape.begin() + std::ptrdiff_t(i));
    if (named) letters.erase(i, 1);
  }
  if (shape.empty()) return none;
  const std::size_t count = shape.size();
  const std::string axes = named        ? AxesOf(letters)
                           : count == 1 ? "Z"
                           : count == 2 ? (options.channel && !options.time ? "CZ" : "TZ")
                           : count == 3 ? "TCZ"
                                        : "";
  if (axes.empty()) {
    return Status::InvalidArgument(
        fmt::format("{}: the shape in its description, [{}], has more axes than time, channel, z, y and x", path, text));
  }
  PageLayout layout{.source = "tifffile", .order = ""};
  for (std::size_t i = count; i-- > 0;) {
    layout.order += axes[i];
    (axes[i] == 'Z' ? layout.slices : axes[i] == 'C' ? layout.channels : layout.times) = shape[i];
  }
  for (const char axis : {'C', 'Z', 'T'}) {
    if (axes.find(axis) == std::string::npos) layout.order += axis;
  }
  return std::optional(layout);
}

}  // namespace slabstream
