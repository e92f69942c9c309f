#include "data/sources/view_setups.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <span>
#include <string_view>

#include "common/files/files.h"
#include "common/text/parse_number.h"
#include "common/text/trimmed.h"
#include "data/volume_io/length_names.h"
#include "data/volume_io/xml_events.h"

namespace slabstream {
namespace {

constexpr std::size_t kMostXmlBytes = std::size_t{64} << 20, kMostSetups = 65536;

// "0.4 0.4 2.0"
std::optional<Vec3> Spacing(std::string_view text) {
  Vec3 spacing;
  for (int axis = 0; axis < 3; ++axis) {
    text = Trimmed(text);
    const std::size_t end = std::min(text.find_first_of(" \t\r\n"), text.size());
    const std::optional<double> number = ParseNumber<double>(text.substr(0, end));
    if (!number || !(*number > 0) || !std::isfinite(*number)) return std::nullopt;
    spacing[axis] = *number;
    text.remove_prefix(end);
  }
  return Trimmed(text).empty() ? std::optional(spacing) : std::nullopt;
}

// What stands behind the prefix.
std::optional<int> NumberOf(std::string_view name, std::string_view prefix) { return ParseNumber<int>(name.substr(prefix.size())); }

}  // namespace

ViewSetup ViewSetupFile::Of(const std::string& name, std::string_view prefix) const {
  const auto found = std::ranges::find(setups, NumberOf(name, prefix).value_or(-1), &ViewSetup::id);
  return found == setups.end() ? ViewSetup{} : *found;
}

std::vector<std::string> Numbered(const std::vector<std::string>& names, std::string_view prefix) {
  std::vector<std::string> found;
  for (const std::string& name : names) {
    if (name.starts_with(prefix) && NumberOf(name, prefix).value_or(-1) >= 0) found.push_back(name);
  }
  return found;
}

Result<std::vector<ViewSetup>> ParseViewSetups(const std::string& xml) {
  struct Element {
    std::string name;
    std::int64_t text_begin = 0;
  };
  std::vector<Element> open;  // from the root to where the reader is
  std::vector<ViewSetup> setups;
  ViewSetup setup;
  bool numbered = false;
  const auto inside = [&](std::size_t above, std::string_view name) {
    return open.size() > above && open.end()[-1 - std::ptrdiff_t(above)].name == name;
  };
  const auto start = [&](const XmlTag& tag) {
    open.push_back({tag.name, tag.end});
    if (tag.name == "ViewSetup") {
      setup = {};
      numbered = false;
    }
    return setups.size() < kMostSetups;
  };
  const auto end = [&](const XmlTag& tag) {
    const std::string_view text = Trimmed(std::string_view(xml).substr(
        std::size_t(open.back().text_begin), std::size_t(std::max<std::int64_t>(0, tag.begin - open.back().text_begin))));
    if (inside(1, "ViewSetup")) {
      if (tag.name == "id") {
        const std::optional<int> id = ParseNumber<int>(text);
        numbered = id.has_value();
        setup.id = id.value_or(0);
      } else if (tag.name == "name") {
        setup.name = text.substr(0, 256);
      }
    } else if (inside(1, "voxelSize") && inside(2, "ViewSetup")) {
      if (tag.name == "unit") setup.unit = LengthUnitNamed(text);
      if (tag.name == "size") setup.spacing = Spacing(text);
    }
    if (tag.name == "ViewSetup" && numbered) setups.push_back(setup);
    open.pop_back();
  };
  std::size_t at = 0;
  const auto read = [&](std::span<char> buffer) {
    const std::size_t count = std::min(buffer.size(), xml.size() - at);
    std::copy_n(xml.begin() + std::ptrdiff_t(at), count, buffer.begin());
    at += count;
    return count;
  };
  if (Status status = ReadXml(read, {start, end}); !status.ok()) return status;
  return setups;
}

Result<ViewSetupFile> ReadViewSetupsBeside(const std::string& path) {
  const std::string file = std::filesystem::path(path).replace_extension(".xml").string();
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) return ViewSetupFile{};
  const Result<std::string> xml = ReadTextFile(file, kMostXmlBytes);
  if (!xml.ok()) return xml.status();
  Result<std::vector<ViewSetup>> setups = ParseViewSetups(*xml);
  if (!setups.ok()) return Status(setups.status().code(), file + ": " + setups.status().message());
  return ViewSetupFile{file, *std::move(setups)};
}

}  // namespace slabstream
