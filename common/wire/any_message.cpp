#include "common/wire/any_message.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/stubs/logging.h>

#include <array>
#include <numeric>
#include <string>

#include "common/base/check.h"
#include "common/image/local_image.h"
#include "common/wire/codecs.h"
#include "slabstream/v1/envelope.pb.h"

namespace slabstream {
namespace {

using google::protobuf::FieldDescriptor;
using v1::Envelope;

// The Protobuf message of a message.
template <class Message>
using Proto = decltype(ProtoOf(std::declval<const Message&>()));

const FieldDescriptor* FieldFor(const google::protobuf::Descriptor* message) {
  const auto* const fields = Envelope::descriptor()->oneof_decl(0);
  int i = 0;
  while (fields->field(i)->message_type() != message) CHECK_LT(++i, fields->field_count());
  return fields->field(i);
}
// The field of the envelope that a message travels in.
template <class Message>
const FieldDescriptor* FieldOf() {
  static const FieldDescriptor* const field = FieldFor(Proto<Message>::descriptor());
  return field;
}

// Null: none that this version knows.
const FieldDescriptor* MessageIn(const Envelope& envelope) {
  return Envelope::GetReflection()->GetOneofFieldDescriptor(envelope, Envelope::descriptor()->oneof_decl(0));
}

template <class Messages>
bool IsOneOf(const FieldDescriptor* field) {
  return [&]<class... Message>(std::type_identity<std::variant<Message...>>) {
    return ((field == FieldOf<Message>()) || ...);
  }(std::type_identity<Messages>());
}

// What is answered by OrderRefused, beside questions.
using Order = std::variant<StatusQuery, ShutDown, KeysOrder, DataOrder, SteerDataset, AddVolume, VolumePart>;

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

std::size_t PayloadBytesOf(const PictureShare& share) { return share.direct ? 0 : share.runs.encoded_bytes; }
std::size_t PayloadBytesOf(const FrameImage& message) { return PayloadBytesOf(message.picture); }
std::size_t PayloadBytesOf(const FrameReply& message) {
  std::size_t bytes = 0;
  for (const PictureShare& share : message.shares) bytes += PayloadBytesOf(share);
  return bytes;
}
std::size_t PayloadBytesOf(const SentPicture& message) { return message.bytes; }
std::size_t PayloadBytesOf(const PartialImage& message) {
  if (message.shared) return sizeof(ColumnSpan) * std::size_t(message.shared->bounds.height());
  return message.packed ? message.packed->bytes : PayloadBytes(message.image);
}
std::size_t PayloadBytesOf(const ShapeTiles& message) {
  return std::accumulate(message.bytes.begin(), message.bytes.end(), std::size_t{0});
}
std::size_t PayloadBytesOf(const Chunk& message) { return message.encoded_bytes; }
std::size_t PayloadBytesOf(const VolumePart& message) { return message.bytes; }
template <class Message>
std::size_t PayloadBytesOf(const Message&) {
  return 0;
}

// False: another message travels in the envelope.
template <class Message>
bool ReadIf(const Envelope& envelope, const FieldDescriptor* field, auto& message, Checker& check) {
  if (field != FieldOf<Message>()) return false;
  Read(static_cast<const Proto<Message>&>(Envelope::GetReflection()->GetMessage(envelope, field)), message.template emplace<Message>(),
       check);
  return true;
}

}  // namespace

std::string_view NameOf(Plane plane) {
  constexpr std::array<std::string_view, 5> kNames = {"control", "voxels", "images", "client", "pictures"};
  return kNames.at(std::size_t(plane));
}

std::vector<std::byte> Encode(MessageView message) {
  Envelope envelope;
  envelope.set_version(kWireVersion);
  std::visit(
      [&]<class Message>(const Message* held) {
        Write(*held, static_cast<Proto<Message>&>(*Envelope::GetReflection()->MutableMessage(&envelope, FieldOf<Message>())));
      },
      message.held);
  std::vector<std::byte> header(envelope.ByteSizeLong());
  CHECK(envelope.SerializeToArray(header.data(), static_cast<int>(header.size())));
  return header;
}

template <class Messages>
Result<Messages> Decode(std::span<const std::byte> header) {
  Envelope envelope;
  if (Status status = Parse(header, envelope); !status.ok()) return status;
  const FieldDescriptor* const field = MessageIn(envelope);
  if (field == nullptr) return Status::InvalidArgument("Envelope.message: none that this version knows");
  Messages message;
  Checker check(field->message_type()->name());
  const bool belongs_here = [&]<class... Message>(std::type_identity<std::variant<Message...>>) {
    return (ReadIf<Message>(envelope, field, message, check) || ...);
  }(std::type_identity<Messages>());
  if (!belongs_here) return Status::InvalidArgument(field->message_type()->name() + " does not belong here");
  if (!check.ok()) return check.status();
  return message;
}

template <class Messages>
Result<Messages> Decode(std::span<const std::byte> header, std::size_t payload_bytes) {
  Result<Messages> message = Decode<Messages>(header);
  if (message.ok() && payload_bytes != ExpectedPayloadBytes(*message)) {
    return Status::InvalidArgument(std::string(NameOf(*message)) + " with a payload of " + std::to_string(payload_bytes) + " bytes");
  }
  return message;
}

template Result<AnyMessage> Decode(std::span<const std::byte>);
template Result<WorkerToCoordinator> Decode(std::span<const std::byte>, std::size_t);
template Result<CoordinatorToWorker> Decode(std::span<const std::byte>, std::size_t);
template Result<ToControl> Decode(std::span<const std::byte>, std::size_t);
template Result<CoordinatorToOwner> Decode(std::span<const std::byte>, std::size_t);
template Result<WorkerToVoxels> Decode(std::span<const std::byte>, std::size_t);
template Result<VoxelsToWorker> Decode(std::span<const std::byte>, std::size_t);
template Result<WorkerToWorker> Decode(std::span<const std::byte>, std::size_t);
template Result<WorkerToClient> Decode(std::span<const std::byte>, std::size_t);
template Result<ClientToCoordinator> Decode(std::span<const std::byte>, std::size_t);
template Result<CoordinatorToClient> Decode(std::span<const std::byte>, std::size_t);

std::optional<CoordinatorToClient> RefusalOf(std::span<const std::byte> header, const Status& why) {
  Envelope envelope;
  if (!Parse(header, envelope).ok()) return std::nullopt;
  const FieldDescriptor* const field = MessageIn(envelope);
  if (field == nullptr) return std::nullopt;
  if (field == FieldOf<SubmitFrame>()) return FrameFailed{.request = envelope.submit_frame().request(), .status = why};
  if (!IsOneOf<Question>(field) && !IsOneOf<Order>(field)) return std::nullopt;
  const auto& message = Envelope::GetReflection()->GetMessage(envelope, field);
  const FieldDescriptor* const nonce = field->message_type()->FindFieldByName("nonce");
  return OrderRefused{.nonce = message.GetReflection()->GetUInt64(message, nonce), .status = why};
}

std::string_view NameOf(MessageView message) {
  return std::visit([]<class Message>(const Message*) -> std::string_view { return Proto<Message>::descriptor()->name(); }, message.held);
}

std::size_t ExpectedPayloadBytes(MessageView message) {
  return std::visit([](const auto* held) { return PayloadBytesOf(*held); }, message.held);
}

}  // namespace slabstream
