// Messages to bytes and back. The header of each plane lists its messages, a variant for each direction. Whoever receives one of these
// visits it without a default branch, so that the compiler asks for a handler of each new message. The codec tests run over every message.
//
// On the wire a message is one ZeroMQ frame with a Protobuf Envelope {version, one of the messages below} and, where the message has a
// payload, one more frame of raw bytes. docs/wire.md describes it byte by byte.
#pragma once

#include <concepts>
#include <cstddef>
#include <optional>
#include <span>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "common/base/merged.h"
#include "common/base/status.h"
#include "common/wire/client_messages.h"
#include "common/wire/control_messages.h"
#include "common/wire/image_messages.h"
#include "common/wire/owner_messages.h"
#include "common/wire/picture_messages.h"
#include "common/wire/voxel_messages.h"

namespace slabstream {

inline constexpr std::uint32_t kWireVersion = 3;
inline constexpr std::size_t kMaxHeaderBytes = std::size_t{64} << 20;

using AnyMessage = Merged<WorkerToCoordinator, CoordinatorToWorker, OwnerMessage, WorkerToVoxels, VoxelsToWorker, WorkerToWorker,
                          WorkerToClient, ClientToCoordinator, CoordinatorToClient>;

// A message where it is: itself, or in a variant of messages.
class MessageView {
  template <class... Messages>
  static std::variant<const Messages*...> PointersTo(std::variant<Messages...>);

 public:
  using Held = decltype(PointersTo(std::declval<AnyMessage>()));

  template <class Message>
  requires std::constructible_from<Held, std::in_place_type_t<const Message*>> MessageView(const Message& message)
      : held(std::in_place_type<const Message*>, &message) {}
  template <class... Messages>
  MessageView(const std::variant<Messages...>& messages)
      : held(std::visit([](const auto& message) { return MessageView(message).held; }, messages)) {}

  const Held held;
};

// The sockets that messages travel on: between coordinator and workers, between workers, between clients and coordinator, and from workers
// to clients.
enum class Plane { kControl, kVoxels, kImages, kClient, kPictures };
std::string_view NameOf(Plane plane);  // "control": for logs

std::vector<std::byte> Encode(MessageView message);

// Decodes one of `Messages`: AnyMessage, or one of the variants in it. InvalidArgument naming the message, the field,
// the value and the limit: another message, wrong version, unknown enum value, NaN, a size out of bounds, undecodable
// bytes. The result keeps everything that the structs' comments promise; nobody checks again.
template <class Messages = AnyMessage>
Result<Messages> Decode(std::span<const std::byte> header);

// InvalidArgument also for a payload frame that is not as long as the header says.
template <class Messages>
Result<Messages> Decode(std::span<const std::byte> header, std::size_t payload_bytes);

// The answer to a SubmitFrame, a question (Question), an order (ShutDown, KeysOrder, DataOrder, SteerDataset) or part of a volume
// (AddVolume, VolumePart) that Decode has refused, so that its client hears why: FrameFailed or OrderRefused. nullopt for every other
// header.
std::optional<CoordinatorToClient> RefusalOf(std::span<const std::byte> header, const Status& why);

// "GroupAssignment": for logs and messages.
std::string_view NameOf(MessageView message);

// Length that the payload frame of this message must have; 0: the message has none.
std::size_t ExpectedPayloadBytes(MessageView message);

}  // namespace slabstream
