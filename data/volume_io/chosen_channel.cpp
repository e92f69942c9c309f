#include "data/volume_io/chosen_channel.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/base/printable.h"

namespace slabstream {
namespace {

// "0 to 2 (0: DAPI, 1, 2: GFP)"
std::string Listed(const std::vector<FieldInfo>& channels) {
  constexpr std::size_t kMostTold = 16;
  const std::string range = channels.size() == 1 ? "0" : fmt::format("0 to {}", channels.size() - 1);
  if (std::ranges::all_of(channels, &std::string::empty, &FieldInfo::name)) return range;
  std::string names;
  for (std::size_t i = 0; i < std::min(channels.size(), kMostTold); ++i) {
    names += fmt::format("{}{}{}", i > 0 ? ", " : "", i, channels[i].name.empty() ? "" : ": " + channels[i].name);
  }
  return fmt::format("{} ({}{})", range, Printable(names), channels.size() > kMostTold ? ", ..." : "");
}

}  // namespace

Result<int> ChosenChannel(const std::string& path, const std::vector<FieldInfo>& channels, const ReadOptions& options) {
  const int channel = options.channel.value_or(0);
  if (channel >= 0 && std::size_t(channel) < channels.size()) return channel;
  return Status::InvalidArgument(
      fmt::format("{}: has {} channel{}, so channel must be {}", path, channels.size(), channels.size() == 1 ? "" : "s", Listed(channels)));
}

std::optional<std::string> ShownChannelText(const std::string& path, const std::vector<FieldInfo>& channels, int shown,
                                            const ReadOptions& options) {
  if (options.channel || channels.size() < 2) return std::nullopt;
  return fmt::format("{}: shows channel {} of {}; --channel takes another one: {}", path, shown, channels.size(), Listed(channels));
}

}  // namespace slabstream
