#include "data/sources/axis_choice.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "data/volume_io/chosen_channel.h"
#include "data/volume_io/raw_volume.h"

namespace slabstream {
namespace {

Status Wrong(const std::string& array, const std::string& why) { return Status::InvalidArgument(fmt::format("{}: {}", array, why)); }

}  // namespace

void ChosenAxes::Describe(SourceInfo& info) const {
  info.times.count = times;
  info.time = time;
  info.channel = channel;
  if (channels.size() > 1 || channels.front() != FieldInfo{}) info.channels = channels;
}

Result<std::vector<AxisKind>> KindsOfPlainAxes(const std::string& array, const std::vector<std::string>& names,
                                               const ReadOptions& options) {
  if (names.size() < 2) return Wrong(array, fmt::format("has {} axis, must have 2 or more", names.size()));
  std::vector<AxisKind> kinds;
  for (const std::string& name : names) kinds.push_back(AxisNamed(name));
  const auto count = [&](AxisKind kind) { return std::ranges::count(kinds, kind); };
  const bool twice = std::ranges::any_of(kinds, [&](AxisKind kind) { return kind != AxisKind::kOther && count(kind) > 1; });
  if (twice) std::ranges::fill(kinds, AxisKind::kOther);
  // The last axes that are left take the letters that are.
  for (const AxisKind kind : {AxisKind::kX, AxisKind::kY, AxisKind::kZ}) {
    const auto last = std::find(kinds.rbegin(), kinds.rend(), AxisKind::kOther);
    if (count(kind) == 0 && last != kinds.rend()) *last = kind;
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

Result<ChosenAxes> ChooseAxes(const std::string& array, const std::vector<AxisKind>& kinds, const std::vector<std::uint64_t>& sizes,
                              const ReadOptions& options, std::vector<FieldInfo> channels) {
  ChosenAxes choice{.at = std::vector<std::uint64_t>(kinds.size(), 0)};
  for (std::size_t axis = 0; axis < kinds.size(); ++axis) {
    switch (kinds[axis]) {
      case AxisKind::kX: choice.axes[0] = int(axis); break;
      case AxisKind::kY: choice.axes[1] = int(axis); break;
      case AxisKind::kZ: choice.axes[2] = int(axis); break;
      case AxisKind::kTime: choice.time_axis = int(axis); break;
      case AxisKind::kChannel: choice.channel_axis = int(axis); break;
      case AxisKind::kOther:
        if (sizes[axis] == 1) break;
        return Wrong(array,
                     fmt::format("axis {} has {} indices and is none of x, y, z, time and channel, so it must have 1", axis, sizes[axis]));
    }
  }
  const auto count_along = [&](int axis) { return axis < 0 ? std::uint64_t{1} : sizes[std::size_t(axis)]; };
  const std::uint64_t times = count_along(choice.time_axis), channel_count = count_along(choice.channel_axis);
  if (times > std::uint64_t{kMaxVolumes}) return Wrong(array, fmt::format("has {} times, at most {} are supported", times, kMaxVolumes));
  const Result<std::int64_t> time = ChosenVolume(array, std::int64_t(times), options);
  if (!time.ok()) return time.status();
  if (channel_count > kMostChannels) {
    return Wrong(array, fmt::format("has {} channels, at most {} are supported", channel_count, kMostChannels));
  }
  channels.resize(std::size_t(channel_count));
  const Result<int> channel = ChosenChannel(array, channels, options);
  if (!channel.ok()) return channel.status();
  choice.times = int(times);
  choice.channels = std::move(channels);
  choice.time = int(*time);
  choice.channel = *channel;
  if (choice.time_axis >= 0) choice.at[std::size_t(choice.time_axis)] = std::uint64_t(*time);
  if (choice.channel_axis >= 0) choice.at[std::size_t(choice.channel_axis)] = std::uint64_t(*channel);
  return choice;
}

}  // namespace slabstream
