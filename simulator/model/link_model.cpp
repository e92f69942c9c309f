#include "simulator/model/link_model.h"

#include <fmt/format.h>

#include <limits>

#include "common/base/did_you_mean.h"
#include "common/base/find_named.h"
#include "common/text/parse_number.h"

namespace slabstream {
namespace {

constexpr double kBytesAGigabit = 1e9 / 8;
constexpr double kMaxLatencyMicroseconds = 1e6, kMaxGigabits = 1e6;

// NaN, which lies in no range, if it is no number.
double ToNumber(std::string_view text) { return ParseNumber<double>(text).value_or(std::numeric_limits<double>::quiet_NaN()); }

}  // namespace

const std::vector<LinkPreset>& LinkPresets() {
  // pvs: the paper's ratio of computing to communicating, with today's computing. From its tables for N = 200, p = 10 ... 30: centralised
  // combining takes about 0.20 s an image (table 2 less the other stages of table 5), of which compositing takes 0.117 s (table 5, p = 1:
  // 32 % of 72.89 s for 200 slices), so writing and reading an image takes 0.083 s. That is 1.1e-3 of the frame's 72.89 s on one processor.
  // Here rendering that frame (class I, N = 200, 5 % occupied, 200 x 200 pixels) takes kPvsFrameSeconds of one core, so 40000 pixels of 16
  // bytes have to pass in 1.1e-3 of it.
  constexpr double kPvsFrameSeconds = 4.0e-3, kPvsImageShare = 0.083 / 72.89, kPvsImageBytes = 200 * 200 * 16;
  static const std::vector<LinkPreset> presets = {
      {"host", {Contention::kNone, 30e-6, 8e9}},  // workers of one host: copies in memory
      {"1gbit", {Contention::kSwitched, 50e-6, 1 * kBytesAGigabit}},
      {"10gbit", {Contention::kSwitched, 20e-6, 10 * kBytesAGigabit}},
      {"fat-tree", {Contention::kFatTree, 20e-6, 10 * kBytesAGigabit, 16, 4}},
      {"bus", {Contention::kSharedBus, 20e-6, 10 * kBytesAGigabit}},
      {"pvs", {Contention::kSharedBus, 1e-6, kPvsImageBytes / (kPvsImageShare * kPvsFrameSeconds)}},
  };
  return presets;
}

Result<LinkModel> ParseLink(std::string_view option, std::string_view text) {
  const std::size_t colon = text.find(':');
  const std::string_view name = text.substr(0, colon);
  const LinkPreset* preset = FindNamed(LinkPresets(), name);
  if (preset == nullptr) {
    return Status::InvalidArgument(fmt::format("{}: '{}' is no link, but must be one of: {}{}", option, name, NamesOf(LinkPresets()),
                                               DidYouMean(name, LinkPresets())));
  }
  LinkModel link = preset->link;
  if (colon == std::string_view::npos) return link;

  const std::string_view numbers = text.substr(colon + 1);
  const std::size_t comma = numbers.find(',');
  const double latency = ToNumber(numbers.substr(0, comma));
  const double rate = comma == std::string_view::npos ? ToNumber("") : ToNumber(numbers.substr(comma + 1));
  const bool in_range = latency >= 0 && latency <= kMaxLatencyMicroseconds && rate > 0 && rate <= kMaxGigabits;
  if (!in_range) {
    return Status::InvalidArgument(
        fmt::format("{}: '{}' must be {}:LATENCY,RATE with a latency in [0, {}] microseconds and a rate in (0, {}] Gbit/s", option, text,
                    name, kMaxLatencyMicroseconds, kMaxGigabits));
  }
  link.latency_seconds = latency * 1e-6;
  link.bytes_per_second = rate * kBytesAGigabit;
  return link;
}

}  // namespace slabstream
