// The rights that requests need, and what a token gives and shows. Pure.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client/request/picture_fields.h"
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
// The same of a dataset, whether there is one of this name or not.
std::optional<std::string> WhyNotShown(std::string_view dataset, const Access& access);

// The datasets that the fields of a request for a picture name: the volume and the shapes.
std::vector<std::string> NamedDatasets(const PictureFields& fields);

// What the token gives, for its holder: {"rights": ["view", "steer"], "datasets": ["head"], "exp": 1764450000}; the last two are null if it
// is for all datasets, or does not expire. `takes_files`: whether the gateway does.
Json AccessJson(const Access& access, bool takes_files);

// A token for some datasets tells nothing of others, nor where data comes from.
StatusReply ShownStatus(StatusReply status, const Access& access);
// The service names others where a dataset is missing.
Status ShownStatus(Status status, const Access& access);

}  // namespace slabstream
