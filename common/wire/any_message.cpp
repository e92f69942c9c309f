#include "common/wire/any_message.h"

#include <google/protobuf/stubs/logging.h>

#include <string>
#include <tuple>
#include <type_traits>
#include <utility>

#include "common/wire/codecs.h"
#include "slabstream/v1/envelope.pb.h"

namespace slabstream {
namespace {

using v1::Envelope;

// A member of the envelope's oneof, and the message that travels in it.
template <class Proto>
struct Member {
  using Message = decltype(FromProto(std::declval<const Proto&>(), std::declval<Checker&>()));
  std::string_view name;
  Envelope::MessageCase wire_case;
  const Proto& (Envelope::*get)() const;
  Proto* (Envelope::*mutable_get)();
};
template <class Proto>  // C++20 deduces this for an aggregate; clang 14, the parser of clang-tidy, does not yet
Member(const char*, Envelope::MessageCase, const Proto& (Envelope::*)() const, Proto* (Envelope::*)())->Member<Proto>;

// One line a message, in the order of AnyMessage.
constexpr auto kMembers =
    std::tuple{Member{"Register", Envelope::kRegisterWorker, &Envelope::register_worker, &Envelope::mutable_register_worker},
               Member{"Welcome", Envelope::kWelcome, &Envelope::welcome, &Envelope::mutable_welcome},
               Member{"Heartbeat", Envelope::kHeartbeat, &Envelope::heartbeat, &Envelope::mutable_heartbeat},
               Member{"Ping", Envelope::kPing, &Envelope::ping, &Envelope::mutable_ping},
               Member{"GroupAssignment", Envelope::kGroupAssignment, &Envelope::group_assignment, &Envelope::mutable_group_assignment},
               Member{"GroupDone", Envelope::kGroupDone, &Envelope::group_done, &Envelope::mutable_group_done},
               Member{"FrameImage", Envelope::kFrameImage, &Envelope::frame_image, &Envelope::mutable_frame_image},
               Member{"WorkerTrouble", Envelope::kWorkerTrouble, &Envelope::worker_trouble, &Envelope::mutable_worker_trouble},
               Member{"Leave", Envelope::kLeave, &Envelope::leave, &Envelope::mutable_leave},
               Member{"Retire", Envelope::kRetire, &Envelope::retire, &Envelope::mutable_retire},
               Member{"Stop", Envelope::kStop, &Envelope::stop, &Envelope::mutable_stop},
               Member{"ChunkRequest", Envelope::kChunkRequest, &Envelope::chunk_request, &Envelope::mutable_chunk_request},
               Member{"Chunk", Envelope::kChunk, &Envelope::chunk, &Envelope::mutable_chunk},
               Member{"ChunkRefused", Envelope::kChunkRefused, &Envelope::chunk_refused, &Envelope::mutable_chunk_refused},
               Member{"PartialImage", Envelope::kPartialImage, &Envelope::partial_image, &Envelope::mutable_partial_image},
               Member{"ImageRefused", Envelope::kImageRefused, &Envelope::image_refused, &Envelope::mutable_image_refused},
               Member{"ImageReceived", Envelope::kImageReceived, &Envelope::image_received, &Envelope::mutable_image_received},
               Member{"SubmitFrame", Envelope::kSubmitFrame, &Envelope::submit_frame, &Envelope::mutable_submit_frame},
               Member{"FrameProgress", Envelope::kFrameProgress, &Envelope::frame_progress, &Envelope::mutable_frame_progress},
               Member{"FrameReply", Envelope::kFrameReply, &Envelope::frame_reply, &Envelope::mutable_frame_reply},
               Member{"FrameFailed", Envelope::kFrameFailed, &Envelope::frame_failed, &Envelope::mutable_frame_failed},
               Member{"CancelFrame", Envelope::kCancelFrame, &Envelope::cancel_frame, &Envelope::mutable_cancel_frame},
               Member{"ClientPing", Envelope::kClientPing, &Envelope::client_ping, &Envelope::mutable_client_ping},
               Member{"ClientPong", Envelope::kClientPong, &Envelope::client_pong, &Envelope::mutable_client_pong},
               Member{"StatusQuery", Envelope::kStatusQuery, &Envelope::status_query, &Envelope::mutable_status_query},
               Member{"StatusReply", Envelope::kStatusReply, &Envelope::status_reply, &Envelope::mutable_status_reply},
               Member{"ShutDown", Envelope::kShutDown, &Envelope::shut_down, &Envelope::mutable_shut_down},
               Member{"ShutDownReply", Envelope::kShutDownReply, &Envelope::shut_down_reply, &Envelope::mutable_shut_down_reply}};

constexpr std::size_t kMemberCount = std::variant_size_v<AnyMessage>;
constexpr auto kMemberIndices = std::make_index_sequence<kMemberCount>();

template <std::size_t... I>
constexpr bool SameOrder(std::index_sequence<I...>) {
  return (std::is_same_v<typename std::tuple_element_t<I, decltype(kMembers)>::Message, std::variant_alternative_t<I, AnyMessage>> && ...);
}
static_assert(std::tuple_size_v<decltype(kMembers)> == kMemberCount && SameOrder(kMemberIndices), "kMembers lists AnyMessage");

// Calls `visit(member)` for the members until it returns true.
template <class Visit, std::size_t... I>
bool AnyMember(Visit&& visit, std::index_sequence<I...>) {
  return (visit(std::get<I>(kMembers)) || ...);
}

// Protobuf writes a line to stderr for each string that is not UTF-8; Decode reports it like every other fault.
void SilenceProtobuf() {
  static const bool silenced = [] {
    google::protobuf::SetLogHandler(nullptr);
    return true;
  }();
  (void)silenced;
}

// Reads the envelope, if its bytes can be read and its version is ours.
Status Parse(std::span<const std::byte> header, Envelope& envelope) {
  if (header.size() > kMaxHeaderBytes) {
    return Status::InvalidArgument("Envelope: " + std::to_string(header.size()) + " bytes, at most " + std::to_string(kMaxHeaderBytes));
  }
  SilenceProtobuf();
  if (!envelope.ParseFromArray(header.data(), static_cast<int>(header.size()))) {
    return Status::InvalidArgument("Envelope: " + std::to_string(header.size()) + " bytes that are not a Protobuf message of the schema");
  }
  if (envelope.version() != kWireVersion) {
    return Status::InvalidArgument("Envelope.version: " + std::to_string(envelope.version()) + " is not the one spoken here, " +
                                   std::to_string(kWireVersion));
  }
  return Status::Ok();
}

std::size_t PayloadBytesOf(const FrameImage& message) { return message.runs.encoded_bytes; }
std::size_t PayloadBytesOf(const FrameReply& message) { return message.runs.encoded_bytes; }
std::size_t PayloadBytesOf(const PartialImage& message) {
  if (message.shared) return sizeof(ColumnSpan) * message.shared->rows();
  return message.packed ? message.packed->bytes : PayloadBytes(message.image);
}
std::size_t PayloadBytesOf(const Chunk& message) { return message.encoded_bytes; }
template <class Message>
std::size_t PayloadBytesOf(const Message&) {
  return 0;
}

}  // namespace

std::vector<std::byte> Encode(const AnyMessage& message) {
  Envelope envelope;
  envelope.set_version(kWireVersion);
  AnyMember(
      [&](const auto& member) {
        const auto* held = std::get_if<typename std::decay_t<decltype(member)>::Message>(&message);
        if (held != nullptr) *(envelope.*member.mutable_get)() = ToProto(*held);
        return held != nullptr;
      },
      kMemberIndices);
  std::vector<std::byte> header(envelope.ByteSizeLong());
  CHECK(envelope.SerializeToArray(header.data(), static_cast<int>(header.size())));
  return header;
}

Result<AnyMessage> Decode(std::span<const std::byte> header) {
  Envelope envelope;
  if (Status status = Parse(header, envelope); !status.ok()) return status;
  Result<AnyMessage> result = Status::InvalidArgument("Envelope.message: none that this version knows");
  AnyMember(
      [&](const auto& member) {
        if (envelope.message_case() != member.wire_case) return false;
        Checker check(member.name);
        AnyMessage message = FromProto((envelope.*member.get)(), check);
        result = check.ok() ? Result<AnyMessage>(std::move(message)) : Result<AnyMessage>(check.status());
        return true;
      },
      kMemberIndices);
  return result;
}

std::optional<FrameFailed> RefusalOf(std::span<const std::byte> header, const Status& why) {
  Envelope envelope;
  if (!Parse(header, envelope).ok() || !envelope.has_submit_frame()) return std::nullopt;
  return FrameFailed{.request = envelope.submit_frame().request(), .status = why};
}

std::string_view NameOf(const AnyMessage& message) {
  std::string_view name;
  AnyMember(
      [&](const auto& member) {
        const bool held = std::holds_alternative<typename std::decay_t<decltype(member)>::Message>(message);
        if (held) name = member.name;
        return held;
      },
      kMemberIndices);
  return name;
}

std::size_t ExpectedPayloadBytes(const AnyMessage& message) {
  return std::visit([](const auto& held) { return PayloadBytesOf(held); }, message);
}

}  // namespace slabstream
