#include "data/volume_io/raw_volume.h"

#include <fmt/format.h>

#include <bit>
#include <cstdint>
#include <utility>

#include "common/volume/memory_budget.h"
#include "data/volume_io/chosen_channel.h"

namespace slabstream {

Status SetSize(RawHeader& header, const std::string& path, std::vector<double> sizes, const ReadOptions& options, double channels) {
  while (sizes.size() > 3 && sizes.back() == 1) sizes.pop_back();
  if (sizes.size() == 2) sizes.push_back(1);
  if (sizes.size() != 3 && sizes.size() != 4) {
    return Status::InvalidArgument(fmt::format("{}: has {} dimensions, must have 2 or 3, or 4 with time", path, sizes.size()));
  }
  for (const Axis axis : kAxes) {
    const double side = sizes[std::size_t(Number(axis))];
    if (!(side >= 1 && side <= kMaxVolumeSide && side == std::floor(side))) {
      return Status::InvalidArgument(
          fmt::format("{}: the size along {} is {}, must be a whole number in [1, {}]", path, Letter(axis), side, kMaxVolumeSide));
    }
    header.size[axis] = std::int32_t(side);
  }
  const double count = sizes.size() == 4 ? sizes[3] : 1;
  if (!(count >= 1 && count <= kMaxVolumes && count == std::floor(count))) {
    return Status::InvalidArgument(fmt::format("{}: the fourth size is {}, must be a whole number in [1, {}]", path, count, kMaxVolumes));
  }
  const Result<std::int64_t> number = ChosenVolume(path, std::int64_t(count), options);
  if (!number.ok()) return number.status();
  header.times.count = int(count);
  header.number = *number;
  if (channels == 1) return Status::Ok();
  if (!(channels >= 1 && channels <= double(kMostChannels) && channels == std::floor(channels))) {
    return Status::InvalidArgument(fmt::format("{}: has {} channels, must be a whole number in [1, {}]", path, channels, kMostChannels));
  }
  if (header.components > 1) {
    return Status::InvalidArgument(
        fmt::format("{}: has {} channels of {} components a voxel, which is not supported", path, channels, header.components));
  }
  header.channels.resize(std::size_t(channels));
  const Result<int> channel = ChosenChannel(path, header.channels, options);
  if (!channel.ok()) return channel.status();
  header.channel = *channel;
  return Status::Ok();
}

Result<std::int64_t> ChosenVolume(const std::string& path, std::int64_t count, const ReadOptions& options) {
  if (options.time && options.time->count() > 1) {
    return Status::InvalidArgument(
        fmt::format("{}: time is {}:{}, must be one volume here", path, options.time->first, options.time->last));
  }
  if (options.time && options.time->first >= count) {
    return Status::InvalidArgument(fmt::format("{}: time is {}, must be in [0, {}]", path, options.time->first, count - 1));
  }
  if (!options.time && count > 1 && !options.describe) {
    return Status::InvalidArgument(fmt::format("{}: holds {} volumes, of which --time takes one: 0 to {}", path, count, count - 1));
  }
  return std::int64_t{options.time.value_or(TimeRange{}).first};
}

Status CheckChannel(const std::string& path, const RawHeader& header, const ReadOptions& options) {
  const int components = header.components;
  const auto wrong = [&](const std::string& why) { return Status::InvalidArgument(fmt::format("{}: {}", path, why)); };
  if (!options.channel && options.describe) return Status::Ok();
  const bool luminance = options.channel == kLuminance, colour = components == 3 || components == 4;
  if (components == 1 && (options.channel.value_or(0) == 0 || !header.channels.empty())) return Status::Ok();
  if (components == 1) return wrong("has 1 component a voxel, so channel must be 0");
  const std::string which = fmt::format("0 to {}{}", components - 1, colour ? ", or luminance, of red, green and blue" : "");
  if (!options.channel) return wrong(fmt::format("has {} components a voxel, of which --channel takes one: {}", components, which));
  if (luminance ? colour : *options.channel >= 0 && *options.channel < components) return Status::Ok();
  return wrong(fmt::format("has {} components a voxel, so channel must be {}", components, which));
}

Result<RawVolume> TakeMemory(const std::string& path, const RawHeader& header, const ReadOptions& options) {
  if (Status status = CheckChannel(path, header, options); !status.ok()) return status;
  if (Status status = CheckFitsMemory(header.sample_bytes(), path); !status.ok()) return status;
  if (options.progress != nullptr) options.progress->Begin(header.sample_bytes());
  return RawVolume{header, AlignedVector<std::byte>(options.headers_only ? 0 : std::size_t(header.sample_bytes())), {}};
}

namespace {

// Samples in a file of their own: the volume's name first.
Status OfSamples(const std::string& path, const Payload& payload, const Status& status) {
  return payload.file == path || status.ok() ? status : Status(status.code(), path + ": samples in " + status.message());
}

}  // namespace

Result<Payload> PayloadOfVolume(const std::string& path, const LocatedSamples& located) {
  const RawHeader& header = located.header;
  constexpr std::int64_t kMost = std::int64_t{1} << 61;  // longer than any file
  const std::int64_t number = std::int64_t{header.channel} * header.times.count + header.number;
  if (number > kMost / header.sample_bytes()) return Status::DataLoss(path + ": truncated: the volume lies behind the file's end");
  Payload payload = located.payload;
  payload.Pass(number * header.sample_bytes());
  const Status holds = OfSamples(path, payload, CheckHolds(payload, header.sample_bytes()));
  return holds.ok() ? Result<Payload>(std::move(payload)) : holds;
}

Result<RawVolume> ReadSamples(const std::string& path, const LocatedSamples& located, const ReadOptions& options) {
  const Result<Payload> payload = PayloadOfVolume(path, located);
  if (!payload.ok()) return payload.status();
  Result<RawVolume> raw = TakeMemory(path, located.header, options);
  if (!raw.ok()) return raw;
  raw->other_files = payload->FilesBeside(path);
  if (!options.headers_only) {
    const Status read = ReadPayload(*payload, raw->bytes, Extent::kWholeStream, options.progress);
    if (!read.ok()) return OfSamples(path, *payload, read);
    static_assert(std::endian::native == std::endian::little, "this machine's samples are little endian");
    if (payload->big_endian) SwapByteOrder(located.header.type, raw->bytes);
  }
  return raw;
}

void TakeChannel(RawVolume& raw, const ReadOptions& options) {
  const auto components = std::size_t(raw.header.components);
  if (components == 1) return;
  const std::size_t count = CountIn(raw.header.size);
  VisitSampleType(raw.header.type, [&]<class T>(const T*) {
    T* const samples = reinterpret_cast<T*>(raw.bytes.data());
    for (std::size_t i = 0; i < count; ++i) samples[i] = TakenComponent(samples + i * components, options.channel);
  });
  raw.header.components = 1;
  raw.bytes.resize(std::size_t(raw.header.sample_bytes()));
  raw.bytes.shrink_to_fit();
}

}  // namespace slabstream
