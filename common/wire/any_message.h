// The only list of messages. Services visit the variant without a default branch, so that the compiler asks for a handler of each new one.
// The codec tests run over every member.
//
// On the wire a message is one ZeroMQ frame with a Protobuf Envelope {version, one of the messages below} and, where the message has a
// payload, one more frame of raw bytes. docs/wire.md describes it byte by byte.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string_view>
#include <variant>
#include <vector>

#include "common/base/status.h"
#include "common/wire/client_messages.h"
#include "common/wire/control_messages.h"
#include "common/wire/image_messages.h"
#include "common/wire/slab_messages.h"
#include "common/wire/volume_messages.h"

namespace slabstream {

inline constexpr std::uint32_t kWireVersion = 1;
inline constexpr std::size_t kMaxHeaderBytes = std::size_t{64} << 20;

// In the order of planes: control, slabs, images, client.
using AnyMessage =
    std::variant<Register, Welcome, Heartbeat, Ping, GroupAssignment, GroupDone, FrameImage, WorkerTrouble, Leave, Retire, Stop,
                 ChunkRequest, Chunk, ChunkRefused, PartialImage, ImageRefused, ImageReceived, SubmitFrame, FrameProgress, FrameReply,
                 FrameFailed, CancelFrame, ClientPing, ClientPong, StatusQuery, StatusReply, ShutDown, ShutDownReply, KeysOrder, KeysReply,
                 OrderRefused, DataOrder, DataReply, SummaryQuery, SummaryReply, SampleQuery, SampleReply, PickQuery, PickReply, AddVolume,
                 VolumeCredit, VolumePart, DropVolume>;

// The sockets that messages travel on: between coordinator and workers, between workers, and between clients and coordinator. Each message
// belongs to one: to that of the header that declares it.
enum class Plane { kControl, kSlabs, kImages, kClient };
Plane PlaneOf(const AnyMessage& message);
std::string_view NameOf(Plane plane);  // "control": for logs

std::vector<std::byte> Encode(const AnyMessage& message);

// InvalidArgument naming the message, the field, the value and the limit: wrong version, unknown enum value, NaN, a size out of bounds,
// undecodable bytes. The result keeps everything that the structs' comments promise; nobody checks again.
Result<AnyMessage> Decode(std::span<const std::byte> header);

// Decode for a socket that carries one plane. InvalidArgument also for a message of another plane, and for a payload frame that is not as
// long as the header says.
Result<AnyMessage> DecodeOn(Plane plane, std::span<const std::byte> header, std::size_t payload_bytes);

// The answer to a SubmitFrame or a question (SummaryQuery, SampleQuery, PickQuery) or part of a volume (AddVolume,
// VolumePart) that Decode has refused, so that its client hears why:
// FrameFailed or OrderRefused. nullopt for every other header.
std::optional<AnyMessage> RefusalOf(std::span<const std::byte> header, const Status& why);

// "GroupAssignment": for logs and messages.
std::string_view NameOf(const AnyMessage& message);

// Length that the payload frame of this message must have; 0: the message has none.
std::size_t ExpectedPayloadBytes(const AnyMessage& message);

}  // namespace slabstream
