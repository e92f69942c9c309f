#include "data/zarr/axis_choice.h"

#include <fmt/format.h>

#include <algorithm>

#include "data/volume_io/raw_volume.h"

namespace slabstream::zarr {
namespace {

constexpr std::uint64_t kMostChannels = 65536;  // that ReadOptions::channel can take

Status Wrong(const std::string& array, const std::string& why) { return Status::InvalidArgument(fmt::format("{}: {}", array, why)); }

Result<std::size_t> ChosenChannel(const std::string& array, std::uint64_t count, const ReadOptions& options, bool any_channel) {
  if (count > kMostChannels) return Wrong(array, fmt::format("has {} channels, at most {} are supported", count, kMostChannels));
  if (!options.channel && (count == 1 || any_channel)) return std::size_t{0};
  const std::string range = count == 1 ? "0" : fmt::format("0 to {}", count - 1);
  const std::string has = count == 1 ? "has 1 channel" : fmt::format("has {} channels", count);
  if (!options.channel) return Wrong(array, fmt::format("{}, of which --channel takes one: {}", has, range));
  if (*options.channel < 0 || std::uint64_t(*options.channel) >= count)
    return Wrong(array, fmt::format("{}, so channel must be {}", has, range));
  return std::size_t(*options.channel);
}

}  // namespace

Result<std::vector<AxisKind>> KindsOfPlainAxes(const std::string& array, const std::vector<std::string>& names,
                                               const ReadOptions& options) {
  if (names.size() < 2) return Wrong(array, fmt::format("has {} axis, must have 2 or more", names.size()));
  std::vector<AxisKind> kinds;
  for (const std::string& name : names) kinds.push_back(AxisNamed(name));
  const auto count = [&](AxisKind kind) { return std::ranges::count(kinds, kind); };
  const bool twice = std::ranges::any_of(kinds, [&](AxisKind kind) { return kind != AxisKind::kOther && count(kind) > 1; });
  if (twice) std::ranges::fill(kinds, AxisKind::kOther);
  if (count(AxisKind::kX) != 1 || count(AxisKind::kY) != 1) {
    std::array<AxisKind, 3> rest = {AxisKind::kX, AxisKind::kY, AxisKind::kZ};
    auto next = rest.begin();
    for (auto kind = kinds.rbegin(); kind != kinds.rend(); ++kind) {
      if (*kind == AxisKind::kTime || *kind == AxisKind::kChannel) continue;
      *kind = next == rest.end() ? AxisKind::kOther : *next++;
    }
  }
  // What is left over before them.
  const auto unknown = count(AxisKind::kOther);
  const auto take = [&](AxisKind kind) {
    if (const auto found = std::ranges::find(kinds, AxisKind::kOther); found != kinds.end() && count(kind) == 0) *found = kind;
  };
  if (unknown > 1 || !options.channel) take(AxisKind::kTime);
  if (unknown > 1 || options.channel) take(AxisKind::kChannel);
  return kinds;
}

Result<AxisChoice> ChooseAxes(const std::string& array, const std::vector<AxisKind>& kinds, const std::vector<std::uint64_t>& sizes,
                              const ReadOptions& options, bool any_channel) {
  AxisChoice choice{.at = std::vector<std::uint64_t>(kinds.size(), 0)};
  std::uint64_t times = 1, channels = 1;
  for (std::size_t axis = 0; axis < kinds.size(); ++axis) {
    switch (kinds[axis]) {
      case AxisKind::kX: choice.axes[0] = int(axis); break;
      case AxisKind::kY: choice.axes[1] = int(axis); break;
      case AxisKind::kZ: choice.axes[2] = int(axis); break;
      case AxisKind::kTime: times = sizes[axis]; break;
      case AxisKind::kChannel: channels = sizes[axis]; break;
      case AxisKind::kOther:
        if (sizes[axis] == 1) break;
        return Wrong(array,
                     fmt::format("axis {} has {} indices and is none of x, y, z, time and channel, so it must have 1", axis, sizes[axis]));
    }
  }
  if (times > std::uint64_t{kMaxVolumes}) return Wrong(array, fmt::format("has {} times, at most {} are supported", times, kMaxVolumes));
  const Result<std::int64_t> time = ChosenVolume(array, std::int64_t(times), options);
  if (!time.ok()) return time.status();
  const Result<std::size_t> channel = ChosenChannel(array, channels, options, any_channel);
  if (!channel.ok()) return channel.status();
  choice.times = int(times);
  choice.channels = int(channels);
  choice.channel = *channel;
  for (std::size_t axis = 0; axis < kinds.size(); ++axis) {
    if (kinds[axis] == AxisKind::kTime) choice.at[axis] = std::uint64_t(*time);
    if (kinds[axis] == AxisKind::kChannel) choice.at[axis] = *channel;
  }
  return choice;
}

}  // namespace slabstream::zarr
