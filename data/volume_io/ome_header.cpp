// The model is that of the OME schema 2016-06: Image/Pixels with DimensionOrder, sizes and physical sizes; Channel with its name.
#include "data/volume_io/ome_header.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/parse_number.h"
#include "data/volume_io/chosen_channel.h"
#include "data/volume_io/raw_volume.h"
#include "data/volume_io/xml_events.h"

namespace slabstream {
namespace {

struct Ome {
  int images = 0;
  XmlTag pixels;  // of the first image
  std::vector<std::string> channels;
};

// A tag's name may have the prefix of its namespace.
bool Is(const XmlTag& tag, std::string_view name) { return std::string_view(tag.name).substr(tag.name.find(':') + 1) == name; }

Result<Ome> ParseOme(const std::string& path, const std::string& description) {
  Ome ome;
  const XmlEvents events{[&](const XmlTag& tag) {
                           if (Is(tag, "Image")) ++ome.images;
                           if (ome.images == 1 && Is(tag, "Pixels")) ome.pixels = tag;
                           if (ome.images == 1 && Is(tag, "Channel")) ome.channels.push_back(tag.Attribute("Name"));
                           return true;
                         },
                         [](const XmlTag&) {}};
  std::size_t at = 0;
  const auto read = [&](std::span<char> out) {
    const std::size_t count = description.copy(out.data(), out.size(), at);
    at += count;
    return count;
  };
  const Status status = ReadXml(read, events);
  if (!status.ok()) return Status::InvalidArgument(path + ": its OME description: " + status.message());
  return ome;
}

// Micrometres of a unit, µm if none is named.
std::optional<double> Micrometres(const std::string& unit) {
  static constexpr std::pair<std::string_view, double> kUnits[] = {{"", 1},      {"\xc2\xb5m", 1},  {"\xce\xbcm", 1}, {"um", 1},
                                                                   {"nm", 1e-3}, {"mm", 1e3},       {"cm", 1e4},      {"m", 1e6},
                                                                   {"pm", 1e-6}, {"\xc3\x85", 1e-4}};
  const auto* const found = std::ranges::find(kUnits, unit, [](const auto& known) { return known.first; });
  return found == std::end(kUnits) ? std::nullopt : std::optional(found->second);
}

// None unless the sizes are stated; that of z may be missing, as for a single slice.
std::optional<Vec3> SpacingOf(const XmlTag& pixels) {
  Vec3 spacing;
  for (const Axis axis : kAxes) {
    const std::string key = std::string("PhysicalSize") + char(Letter(axis) - 'x' + 'X');
    const std::optional<double> number = ParseNumber<double>(pixels.Attribute(key)), unit = Micrometres(pixels.Attribute(key + "Unit"));
    if (!number || !unit || !(*number > 0) || !std::isfinite(*number)) return std::nullopt;
    spacing[axis] = *number * *unit;
  }
  return spacing;
}

}  // namespace

bool IsOmeHeader(const std::string& description) {
  return description.find("<OME") != std::string::npos || description.find(":OME ") != std::string::npos;
}

Result<PageOrder> ReadOmeHeader(const std::string& path, const std::string& description, std::int64_t pages, const ReadOptions& options) {
  const Result<Ome> ome = ParseOme(path, description);
  if (!ome.ok()) return ome.status();
  const auto wrong = [&](const std::string& why) { return Status::InvalidArgument(fmt::format("{}: {}", path, why)); };
  if (ome->images != 1) return wrong(fmt::format("an OME file of {} images, must have 1", ome->images));
  std::array<std::int64_t, 3> counts{};  // of z, c and t
  constexpr std::string_view kLetters = "ZCT";
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const std::string key = std::string("Size") + kLetters[i], text = ome->pixels.Attribute(key);
    counts[i] = ParseNumber<std::int64_t>(text).value_or(0);
    if (counts[i] < 1 || counts[i] > kMaxVolumes) return wrong(fmt::format("{} is '{}', must be in [1, {}]", key, text, kMaxVolumes));
  }
  const auto [slices, channels, times] = counts;
  // Limits keep the product far below 2^63. Components of one page count as channels, but are no pages.
  const std::int64_t in_page = channels > 1 && slices * times * channels != pages && slices * times == pages ? channels : 1;
  if (slices * times * (channels / in_page) != pages) {
    return wrong(
        fmt::format("its OME description speaks of {} slices, {} channels and {} times, the file has {} pages; volumes in several "
                    "files are not supported",
                    slices, channels, times, pages));
  }
  const Result<std::int64_t> time = ChosenVolume(path, times, options);
  if (!time.ok()) return time.status();

  // "XYZCT": z runs fastest from page to page, then c, then t.
  const std::string order = ome->pixels.Attribute("DimensionOrder");
  PageOrder pages_of{.count = slices, .of_channel = in_page == 1 && channels > 1, .spacing = SpacingOf(ome->pixels), .times = int(times)};
  pages_of.channels = ome->channels;
  if (pages_of.of_channel) {
    pages_of.channels.resize(std::size_t(channels));
    const Result<int> channel = ChosenChannel(path, pages_of.channels, options);
    if (!channel.ok()) return channel.status();
    pages_of.channel = *channel;
  }
  std::int64_t step = 1;
  for (const char letter : order.substr(std::min<std::size_t>(2, order.size()))) {
    switch (letter) {
      case 'Z':
        pages_of.step = step;
        step *= slices;
        break;
      case 'C':
        pages_of.first += pages_of.channel * step;
        step *= channels / in_page;
        break;
      case 'T':
        pages_of.first += *time * step;
        step *= times;
        break;
      default: break;
    }
  }
  const bool known = order.size() == 5 && order.starts_with("XY") && step == pages &&
                     std::ranges::all_of(kLetters, [&](char letter) { return order.find(letter) != std::string::npos; });
  if (!known) return wrong(fmt::format("DimensionOrder is '{}', must be such as XYZCT", order));
  return pages_of;
}

}  // namespace slabstream
