// Valid messages of each type, with edge values.
#pragma once

#include <variant>
#include <vector>

#include "common/wire/any_message.h"

namespace slabstream {

// A sample of every member, in the order of AnyMessage. Each encodes to less than 8 KiB.
std::vector<AnyMessage> AllSamples();

template <class Message>
std::vector<Message> Samples() {
  std::vector<Message> samples;
  for (AnyMessage& message : AllSamples()) {
    if (auto* sample = std::get_if<Message>(&message)) samples.push_back(std::move(*sample));
  }
  return samples;
}

}  // namespace slabstream
