// Samples<T>(): valid messages of each type, with edge values. One specialisation a member of AnyMessage: without it AllSamples does not
// compile.
#pragma once

#include <cstddef>
#include <utility>
#include <variant>
#include <vector>

#include "common/wire/any_message.h"

namespace slabstream {

template <class Message>
std::vector<Message> Samples() = delete;

template <>
std::vector<Register> Samples();
template <>
std::vector<Welcome> Samples();
template <>
std::vector<Heartbeat> Samples();
template <>
std::vector<Ping> Samples();
template <>
std::vector<GroupAssignment> Samples();
template <>
std::vector<GroupDone> Samples();
template <>
std::vector<FrameImage> Samples();
template <>
std::vector<WorkerTrouble> Samples();
template <>
std::vector<Leave> Samples();
template <>
std::vector<Retire> Samples();
template <>
std::vector<Stop> Samples();
template <>
std::vector<ChunkRequest> Samples();
template <>
std::vector<Chunk> Samples();
template <>
std::vector<ChunkRefused> Samples();
template <>
std::vector<PartialImage> Samples();
template <>
std::vector<ImageRefused> Samples();
template <>
std::vector<ImageReceived> Samples();
template <>
std::vector<SubmitFrame> Samples();
template <>
std::vector<FrameProgress> Samples();
template <>
std::vector<FrameReply> Samples();
template <>
std::vector<FrameFailed> Samples();
template <>
std::vector<CancelFrame> Samples();
template <>
std::vector<ClientPing> Samples();
template <>
std::vector<ClientPong> Samples();
template <>
std::vector<StatusQuery> Samples();
template <>
std::vector<StatusReply> Samples();
template <>
std::vector<ShutDown> Samples();
template <>
std::vector<ShutDownReply> Samples();

template <std::size_t... I>
std::vector<AnyMessage> AllSamplesOf(std::index_sequence<I...>) {
  std::vector<AnyMessage> all;
  const auto add = [&all](auto samples) { all.insert(all.end(), samples.begin(), samples.end()); };
  (add(Samples<std::variant_alternative_t<I, AnyMessage>>()), ...);
  return all;
}

// Of every member, in the order of AnyMessage. Each encodes to less than 8 KiB.
inline std::vector<AnyMessage> AllSamples() { return AllSamplesOf(std::make_index_sequence<std::variant_size_v<AnyMessage>>()); }

}  // namespace slabstream
