// NextPicture: what a client hears, but for progress.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <optional>
#include <utility>

#include "client/client.h"

namespace slabstream {

struct AnsweredRequest {
  RequestId request = 0;
  Picture picture;
};

// The next picture that answers a request of this client, a preview or a final one. None, and the test fails: a request failed, or nothing
// was heard for a minute.
inline std::optional<AnsweredRequest> NextPicture(Client& client) {
  while (std::optional<ClientEvent> event = client.Next(std::chrono::seconds(60))) {
    if (auto* picture = std::get_if<Picture>(&event->what)) return AnsweredRequest{event->request, std::move(*picture)};
    if (const auto* failure = std::get_if<Status>(&event->what)) {
      ADD_FAILURE() << failure->message();
      return std::nullopt;
    }
  }
  ADD_FAILURE() << "nothing was heard for a minute";
  return std::nullopt;
}

}  // namespace slabstream
