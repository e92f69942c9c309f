#include "data/sources/view_setups.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <map>

#include "common/base/log.h"
#include "common/files/files.h"
#include "common/text/parse_number.h"
#include "common/text/trimmed.h"
#include "data/volume_io/length_names.h"
#include "data/volume_io/stated_field.h"
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

// Names of elements, from the root to where the reader is.
using Open = std::vector<std::string>;
bool IsInside(const Open& open, std::initializer_list<std::string_view> innermost) {
  return open.size() >= innermost.size() && std::equal(innermost.begin(), innermost.end(), open.end() - std::ptrdiff_t(innermost.size()));
}

// `start` gets the name of each element; false: to stop. `end` gets what is open around it, its name, and its text, if no other element
// begins in it. InvalidArgument: no well-formed XML.
Status ForEachElement(const std::string& xml, const std::function<bool(const std::string&)>& start,
                      const std::function<void(const Open&, const std::string&, std::string_view)>& end) {
  Open open;
  std::vector<std::int64_t> text_begins;
  const auto on_start = [&](const XmlTag& tag) {
    open.push_back(tag.name);
    text_begins.push_back(tag.end);
    return start(tag.name);
  };
  const auto on_end = [&](const XmlTag& tag) {
    const std::int64_t begin = text_begins.back(), size = std::max<std::int64_t>(0, tag.begin - begin);
    open.pop_back();
    text_begins.pop_back();
    end(open, tag.name, Trimmed(std::string_view(xml).substr(std::size_t(begin), std::size_t(size))));
  };
  return ReadXml(xml, {on_start, on_end});
}

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
  std::vector<ViewSetup> setups;
  ViewSetup setup;
  bool numbered = false;
  const auto start = [&](const std::string& name) {
    if (name != "ViewSetup") return true;
    setup = {};
    numbered = false;
    return setups.size() < kMostSetups;
  };
  const auto end = [&](const Open& open, const std::string& name, std::string_view text) {
    if (IsInside(open, {"ViewSetup"})) {
      if (name == "id") {
        const std::optional<int> id = ParseNumber<int>(text);
        numbered = id.has_value();
        setup.id = id.value_or(0);
      } else if (name == "name") {
        setup.channel.name = text.substr(0, 256);
      }
    } else if (IsInside(open, {"ViewSetup", "voxelSize"})) {
      if (name == "unit") setup.unit = LengthUnitNamed(text);
      if (name == "size") setup.spacing = Spacing(text);
    }
    if (name == "ViewSetup" && numbered) setups.push_back(setup);
  };
  if (Status status = ForEachElement(xml, start, end); !status.ok()) return status;
  return setups;
}

Status TakeViewSettings(const std::string& xml, std::vector<ViewSetup>& setups) {
  std::optional<int> id;
  std::optional<double> min, max;
  std::optional<std::int32_t> color;
  std::size_t sources = 0;
  std::map<int, ViewSetup*> by_id;
  for (ViewSetup& setup : setups) by_id.emplace(setup.id, &setup);
  const auto start = [&](const std::string& name) {
    if (name == "ConverterSetup") id.reset(), min.reset(), max.reset(), color.reset();
    return true;
  };
  const auto end = [&](const Open& open, const std::string& name, std::string_view text) {
    if (IsInside(open, {"ConverterSetup"})) {
      if (name == "id") id = ParseNumber<int>(text);
      if (name == "min") min = ParseNumber<double>(text);
      if (name == "max") max = ParseNumber<double>(text);
      if (name == "color") color = ParseNumber<std::int32_t>(text);
    }
    // Sources are the setups in their order.
    if (IsInside(open, {"Sources", "Source"}) && name == "active" && sources < setups.size()) {
      setups[sources++].channel.shown = text != "false";
    }
    const auto setup = name == "ConverterSetup" && id ? by_id.find(*id) : by_id.end();
    if (setup == by_id.end()) return;
    FieldInfo& channel = setup->second->channel;
    if (min && max) channel.window = StatedWindow(*min, *max);
    if (color) channel.color = ColorOfBits(std::uint32_t(*color));  // alpha lies above
  };
  return ForEachElement(xml, start, end);
}

Result<ViewSetupFile> ReadViewSetupsBeside(const std::string& path) {
  const std::string file = std::filesystem::path(path).replace_extension(".xml").string();
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) return ViewSetupFile{};
  const Result<std::string> xml = ReadTextFile(file, kMostXmlBytes);
  if (!xml.ok()) return xml.status();
  Result<std::vector<ViewSetup>> setups = ParseViewSetups(*xml);
  if (!setups.ok()) return Status(setups.status().code(), file + ": " + setups.status().message());
  ViewSetupFile found{{file}, *std::move(setups)};
  const std::string settings = std::filesystem::path(path).replace_extension(".settings.xml").string();
  if (!std::filesystem::is_regular_file(settings, error)) return found;
  found.files.push_back(settings);
  const Result<std::string> text = ReadTextFile(settings, kMostXmlBytes);
  std::vector<ViewSetup> shown = found.setups;
  const Status taken = text.ok() ? TakeViewSettings(*text, shown) : text.status();
  if (taken.ok()) {
    found.setups = std::move(shown);
  } else {
    LogWarning(fmt::format("{}: colours and windows are not taken: {}", settings, taken.message()));
  }
  return found;
}

}  // namespace slabstream
