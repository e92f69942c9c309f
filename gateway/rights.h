// The rights that requests need, and what a token gives and shows. Pure.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/time.h"
#include "common/http/access_token.h"
#include "common/json/json.h"
#include "common/wire/client_messages.h"

namespace slabstream {

enum class Right : std::uint8_t {
  kNone,   // no token is needed
  kView,   // any token; of the datasets those that it shows
  kWatch,  // a token for all datasets
  kSteer,  // a token that is not view-only; of the datasets those that it shows
  kSend,   // a token for all datasets that is not view-only
};

// What the holder of a token reads that does not give this right. nullopt: it does.
std::optional<std::string> WhyNot(Right right, const Access& access);

// Whoever asks the service.
struct Asker {
  Access access = {};  // what their token gives
  std::string token = {};
  std::function<void(const std::string& dataset)> reading = {};  // hears of what they may read and ask for; any thread; may be empty

  // NotFound: the token does not show all of these, whether there are any or not.
  Status MayRead(const std::vector<std::string>& datasets) const;
};

// The datasets that a picture shows: the volume, and the shapes beside it. Nothing else in a request names data.
std::vector<std::string> DatasetsOf(const FrameRequest& request);

inline constexpr Duration kIdleAfter = std::chrono::minutes(1);

struct SessionPlace {
  std::string_view holder;  // the token that it was opened with
  Time used{};              // when its page last said that a new picture is drawn; before the first one, when it was opened
};

// The number of the session whose place `holder` gets: one that is idle, which was not used for kIdleAfter, or else one of a holder that
// has at least two more than `holder`. If there are several, one of the holder with most, and of these the one that was not used for
// longest.
std::optional<std::size_t> WhoMakesRoom(std::span<const SessionPlace> places, std::string_view holder, Time now);

// What the token gives, for its holder: {"rights": ["view", "steer"], "datasets": ["head"], "exp": 1764450000}; the last two are null if it
// is for all datasets, or does not expire. `takes_files`: whether the gateway does.
Json AccessJson(const Access& access, bool takes_files);

// A token for some datasets tells nothing of others, nor where data comes from.
StatusReply ShownStatus(StatusReply status, const Access& access);
// The service names others where a dataset is missing. Here that is one line, whatever the reason.
Status ShownStatus(Status status, const Access& access);

}  // namespace slabstream
