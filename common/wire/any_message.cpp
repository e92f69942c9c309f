#include "common/wire/any_message.h"

#include <google/protobuf/stubs/logging.h>

#include <array>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>

#include "common/wire/client_fields.h"
#include "common/wire/control_fields.h"
#include "common/wire/image_fields.h"
#include "common/wire/slab_fields.h"
#include "common/wire/volume_fields.h"
#include "slabstream/v1/envelope.pb.h"

namespace slabstream {
namespace {

using v1::Envelope;

// A member of the envelope's oneof.
template <class Proto>
struct Member {
  Envelope::MessageCase wire_case;
  const Proto& (Envelope::*get)() const;
  Proto* (Envelope::*edit)();
  static std::string_view name() { return Proto::descriptor()->name(); }
};
template <class Proto>  // C++20 deduces this for an aggregate; clang 14, the parser of clang-tidy, does not yet
Member(Envelope::MessageCase, const Proto& (Envelope::*)() const, Proto* (Envelope::*)())->Member<Proto>;

// One line a message, in the order of AnyMessage. Another order does not compile: Fields pairs structs and messages.
constexpr auto kMembers = std::tuple{Member{Envelope::kRegisterWorker, &Envelope::register_worker, &Envelope::mutable_register_worker},
                                     Member{Envelope::kWelcome, &Envelope::welcome, &Envelope::mutable_welcome},
                                     Member{Envelope::kHeartbeat, &Envelope::heartbeat, &Envelope::mutable_heartbeat},
                                     Member{Envelope::kPing, &Envelope::ping, &Envelope::mutable_ping},
                                     Member{Envelope::kGroupAssignment, &Envelope::group_assignment, &Envelope::mutable_group_assignment},
                                     Member{Envelope::kGroupDone, &Envelope::group_done, &Envelope::mutable_group_done},
                                     Member{Envelope::kFrameImage, &Envelope::frame_image, &Envelope::mutable_frame_image},
                                     Member{Envelope::kWorkerTrouble, &Envelope::worker_trouble, &Envelope::mutable_worker_trouble},
                                     Member{Envelope::kLeave, &Envelope::leave, &Envelope::mutable_leave},
                                     Member{Envelope::kRetire, &Envelope::retire, &Envelope::mutable_retire},
                                     Member{Envelope::kStop, &Envelope::stop, &Envelope::mutable_stop},
                                     Member{Envelope::kChunkRequest, &Envelope::chunk_request, &Envelope::mutable_chunk_request},
                                     Member{Envelope::kChunk, &Envelope::chunk, &Envelope::mutable_chunk},
                                     Member{Envelope::kChunkRefused, &Envelope::chunk_refused, &Envelope::mutable_chunk_refused},
                                     Member{Envelope::kPartialImage, &Envelope::partial_image, &Envelope::mutable_partial_image},
                                     Member{Envelope::kImageRefused, &Envelope::image_refused, &Envelope::mutable_image_refused},
                                     Member{Envelope::kImageReceived, &Envelope::image_received, &Envelope::mutable_image_received},
                                     Member{Envelope::kSubmitFrame, &Envelope::submit_frame, &Envelope::mutable_submit_frame},
                                     Member{Envelope::kFrameProgress, &Envelope::frame_progress, &Envelope::mutable_frame_progress},
                                     Member{Envelope::kFrameReply, &Envelope::frame_reply, &Envelope::mutable_frame_reply},
                                     Member{Envelope::kFrameFailed, &Envelope::frame_failed, &Envelope::mutable_frame_failed},
                                     Member{Envelope::kCancelFrame, &Envelope::cancel_frame, &Envelope::mutable_cancel_frame},
                                     Member{Envelope::kClientPing, &Envelope::client_ping, &Envelope::mutable_client_ping},
                                     Member{Envelope::kClientPong, &Envelope::client_pong, &Envelope::mutable_client_pong},
                                     Member{Envelope::kStatusQuery, &Envelope::status_query, &Envelope::mutable_status_query},
                                     Member{Envelope::kStatusReply, &Envelope::status_reply, &Envelope::mutable_status_reply},
                                     Member{Envelope::kShutDown, &Envelope::shut_down, &Envelope::mutable_shut_down},
                                     Member{Envelope::kShutDownReply, &Envelope::shut_down_reply, &Envelope::mutable_shut_down_reply},
                                     Member{Envelope::kKeysOrder, &Envelope::keys_order, &Envelope::mutable_keys_order},
                                     Member{Envelope::kKeysReply, &Envelope::keys_reply, &Envelope::mutable_keys_reply},
                                     Member{Envelope::kOrderRefused, &Envelope::order_refused, &Envelope::mutable_order_refused},
                                     Member{Envelope::kDataOrder, &Envelope::data_order, &Envelope::mutable_data_order},
                                     Member{Envelope::kDataReply, &Envelope::data_reply, &Envelope::mutable_data_reply},
                                     Member{Envelope::kSummaryQuery, &Envelope::summary_query, &Envelope::mutable_summary_query},
                                     Member{Envelope::kSummaryReply, &Envelope::summary_reply, &Envelope::mutable_summary_reply},
                                     Member{Envelope::kSampleQuery, &Envelope::sample_query, &Envelope::mutable_sample_query},
                                     Member{Envelope::kSampleReply, &Envelope::sample_reply, &Envelope::mutable_sample_reply},
                                     Member{Envelope::kPickQuery, &Envelope::pick_query, &Envelope::mutable_pick_query},
                                     Member{Envelope::kPickReply, &Envelope::pick_reply, &Envelope::mutable_pick_reply},
                                     Member{Envelope::kAddVolume, &Envelope::add_volume, &Envelope::mutable_add_volume},
                                     Member{Envelope::kVolumeCredit, &Envelope::volume_credit, &Envelope::mutable_volume_credit},
                                     Member{Envelope::kVolumePart, &Envelope::volume_part, &Envelope::mutable_volume_part},
                                     Member{Envelope::kDropVolume, &Envelope::drop_volume, &Envelope::mutable_drop_volume}};

constexpr std::size_t kMemberCount = std::variant_size_v<AnyMessage>;
static_assert(std::tuple_size_v<decltype(kMembers)> == kMemberCount, "kMembers lists AnyMessage");

// Calls `visit(member, index in AnyMessage)` for the members until it returns true.
template <class Visit, std::size_t... I>
bool AnyMember(Visit&& visit, std::index_sequence<I...>) {
  return (visit(std::get<I>(kMembers), std::in_place_index<I>) || ...);
}
constexpr auto kMemberIndices = std::make_index_sequence<kMemberCount>();

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
std::size_t PayloadBytesOf(const VolumePart& message) { return message.bytes; }
template <class Message>
std::size_t PayloadBytesOf(const Message&) {
  return 0;
}

// The place of a message in AnyMessage.
template <class Message, std::size_t I = 0>
constexpr std::size_t IndexOf() {
  if constexpr (std::is_same_v<std::variant_alternative_t<I, AnyMessage>, Message>) {
    return I;
  } else {
    return IndexOf<Message, I + 1>();
  }
}

}  // namespace

Plane PlaneOf(const AnyMessage& message) {
  const std::size_t index = message.index();
  if (index < IndexOf<ChunkRequest>()) return Plane::kControl;
  if (index < IndexOf<PartialImage>()) return Plane::kSlabs;
  return index < IndexOf<SubmitFrame>() ? Plane::kImages : Plane::kClient;
}

std::string_view NameOf(Plane plane) {
  constexpr std::array<std::string_view, 4> kNames = {"control", "slabs", "images", "client"};
  return kNames.at(std::size_t(plane));
}

std::vector<std::byte> Encode(const AnyMessage& message) {
  Envelope envelope;
  envelope.set_version(kWireVersion);
  AnyMember(
      [&]<std::size_t I>(const auto& member, std::in_place_index_t<I>) {
        const auto* held = std::get_if<I>(&message);
        if (held != nullptr) Write(*held, *(envelope.*member.edit)());
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
      [&]<std::size_t I>(const auto& member, std::in_place_index_t<I> index) {
        if (envelope.message_case() != member.wire_case) return false;
        Checker check(member.name());
        AnyMessage message(index);
        Read((envelope.*member.get)(), std::get<I>(message), check);
        result = check.ok() ? Result<AnyMessage>(std::move(message)) : Result<AnyMessage>(check.status());
        return true;
      },
      kMemberIndices);
  return result;
}

Result<AnyMessage> DecodeOn(Plane plane, std::span<const std::byte> header, std::size_t payload_bytes) {
  Result<AnyMessage> message = Decode(header);
  if (!message.ok()) return message;
  const std::string name(NameOf(*message));
  if (PlaneOf(*message) != plane)
    return Status::InvalidArgument(name + " belongs to the " + std::string(NameOf(PlaneOf(*message))) + " plane");
  if (payload_bytes != ExpectedPayloadBytes(*message)) {
    return Status::InvalidArgument(name + " with a payload of " + std::to_string(payload_bytes) + " bytes");
  }
  return message;
}

std::optional<AnyMessage> RefusalOf(std::span<const std::byte> header, const Status& why) {
  Envelope envelope;
  if (!Parse(header, envelope).ok()) return std::nullopt;
  switch (envelope.message_case()) {
    case Envelope::kSubmitFrame: return FrameFailed{.request = envelope.submit_frame().request(), .status = why};
    case Envelope::kSummaryQuery: return OrderRefused{.nonce = envelope.summary_query().nonce(), .status = why};
    case Envelope::kSampleQuery: return OrderRefused{.nonce = envelope.sample_query().nonce(), .status = why};
    case Envelope::kPickQuery: return OrderRefused{.nonce = envelope.pick_query().nonce(), .status = why};
    case Envelope::kAddVolume: return OrderRefused{.nonce = envelope.add_volume().nonce(), .status = why};
    case Envelope::kVolumePart: return OrderRefused{.nonce = envelope.volume_part().nonce(), .status = why};
    default: return std::nullopt;
  }
}

std::string_view NameOf(const AnyMessage& message) {
  std::string_view name;
  AnyMember(
      [&]<std::size_t I>(const auto& member, std::in_place_index_t<I>) {
        if (message.index() == I) name = member.name();
        return message.index() == I;
      },
      kMemberIndices);
  return name;
}

std::size_t ExpectedPayloadBytes(const AnyMessage& message) {
  return std::visit([](const auto& held) { return PayloadBytesOf(held); }, message);
}

}  // namespace slabstream
