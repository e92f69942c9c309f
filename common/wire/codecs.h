// Private to common/wire: structs to Protobuf messages and back. The files of this folder are the only ones that see generated code.
//
// FromProto checks everything that the comments of the struct promise and records faults in the Checker, whose scope names the current
// message. If the Checker is ok at the end, the structs are valid. ToProto trusts its argument, but makes texts fit to travel
// (wire_text.h).
#pragma once

#include <google/protobuf/repeated_ptr_field.h>

#include <cstddef>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "common/wire/any_message.h"
#include "common/wire/checker.h"
#include "slabstream/v1/client.pb.h"
#include "slabstream/v1/control.pb.h"
#include "slabstream/v1/frame.pb.h"
#include "slabstream/v1/images.pb.h"
#include "slabstream/v1/slabs.pb.h"
#include "slabstream/v1/types.pb.h"

namespace slabstream {

// The wire number of an enum value: see Checker::OneOf.
template <class Proto, class Enum>
Proto WireEnum(Enum value, Enum first) {
  return static_cast<Proto>(static_cast<int>(value) - static_cast<int>(first) + 1);
}

// ---- value_codecs.cpp: values that several messages are made of
v1::Index3 ToProto(const Index3& in);
v1::Vec3 ToProto(const Vec3& in);
v1::Box ToProto(const Box& in);
v1::PixelBounds ToProto(const PixelBounds& in);
v1::PixelRange ToProto(const PixelRange& in);
v1::ValueRange ToProto(const ValueRange& in);
v1::VolumeDescription ToProto(const VolumeDescription& in);
v1::Status ToProto(const Status& in);
v1::GroupKey ToProto(const GroupKey& in);
v1::RunImageHeader ToProto(const RunImageHeader& in);
v1::EncodedRuns ToProto(const EncodedRuns& in);
v1::OcclusionMask ToProto(const OcclusionMask& in);
v1::Span ToProto(const Span& in);
v1::RankReport ToProto(const RankReport& in);

Vec3 FromProto(const v1::Vec3& in, Checker& check);
Box FromProto(const v1::Box& in, Checker& check);
PixelBounds FromProto(const v1::PixelBounds& in, Checker& check);
PixelRange FromProto(const v1::PixelRange& in, Checker& check);
ValueRange FromProto(const v1::ValueRange& in, Checker& check);
VolumeDescription FromProto(const v1::VolumeDescription& in, Checker& check);
Status FromProto(const v1::Status& in, Checker& check);
GroupKey FromProto(const v1::GroupKey& in, Checker& check);
RunImageHeader FromProto(const v1::RunImageHeader& in, Checker& check);
EncodedRuns FromProto(const v1::EncodedRuns& in, Checker& check);
OcclusionMask FromProto(const v1::OcclusionMask& in, Checker& check);
Span FromProto(const v1::Span& in, Checker& check);
RankReport FromProto(const v1::RankReport& in, Checker& check);

Vec3 PositiveFromProto(std::string_view field, const v1::Vec3& in, Checker& check);  // each component above 0
Codec CodecFromProto(v1::Codec in, Checker& check);                                  // field "codec"

// ---- request_codecs.cpp: what a client asks for
v1::ImageSize ToProto(const ImageSize& in);
v1::ViewParameters ToProto(const ViewParameters& in);
v1::ColorPoint ToProto(const ColorPoint& in);
v1::OpacityPoint ToProto(const OpacityPoint& in);
v1::TransferFunction ToProto(const TransferFunction& in);
v1::TransferChoice ToProto(const TransferChoice& in);
v1::Shading ToProto(const Shading& in);
v1::Policy ToProto(const Policy& in);
v1::FrameRequest ToProto(const FrameRequest& in);

ImageSize FromProto(const v1::ImageSize& in, Checker& check);
ViewParameters FromProto(const v1::ViewParameters& in, Checker& check);
ColorPoint FromProto(const v1::ColorPoint& in, Checker& check);
OpacityPoint FromProto(const v1::OpacityPoint& in, Checker& check);
TransferFunction FromProto(const v1::TransferFunction& in, Checker& check);
TransferChoice FromProto(const v1::TransferChoice& in, Checker& check);
Shading FromProto(const v1::Shading& in, Checker& check);
Policy FromProto(const v1::Policy& in, Checker& check);
FrameRequest FromProto(const v1::FrameRequest& in, Checker& check);

// ---- plan_codecs.cpp: what workers are told to do
v1::Camera ToProto(const Camera& in);
v1::FrameSetup ToProto(const FrameSetup& in);
v1::Placement ToProto(const Placement& in);
v1::ScheduleName ToProto(const ScheduleName& in);
v1::GroupPlan ToProto(const GroupPlan& in);

Camera FromProto(const v1::Camera& in, Checker& check);
FrameSetup FromProto(const v1::FrameSetup& in, Checker& check);
Placement FromProto(const v1::Placement& in, Checker& check);
ScheduleName FromProto(const v1::ScheduleName& in, Checker& check);
GroupPlan FromProto(const v1::GroupPlan& in, Checker& check);

// Checks that the plan fits the setup: boxes inside the volume, as many ranks as placements, a schedule that exists. Both must be valid by
// themselves.
void CheckFits(const GroupPlan& group, const FrameSetup& setup, Checker& check);

// ---- control_codecs.cpp
v1::Register ToProto(const Register& in);
v1::Welcome ToProto(const Welcome& in);
v1::Heartbeat ToProto(const Heartbeat& in);
v1::Ping ToProto(const Ping& in);
v1::Peer ToProto(const Peer& in);
v1::GroupAssignment ToProto(const GroupAssignment& in);
v1::GroupDone ToProto(const GroupDone& in);
v1::FrameImage ToProto(const FrameImage& in);
v1::WorkerTrouble ToProto(const WorkerTrouble& in);
v1::Leave ToProto(const Leave& in);
v1::Retire ToProto(const Retire& in);
v1::Stop ToProto(const Stop& in);

Register FromProto(const v1::Register& in, Checker& check);
Welcome FromProto(const v1::Welcome& in, Checker& check);
Heartbeat FromProto(const v1::Heartbeat& in, Checker& check);
Ping FromProto(const v1::Ping& in, Checker& check);
Peer FromProto(const v1::Peer& in, Checker& check);
GroupAssignment FromProto(const v1::GroupAssignment& in, Checker& check);
GroupDone FromProto(const v1::GroupDone& in, Checker& check);
FrameImage FromProto(const v1::FrameImage& in, Checker& check);
WorkerTrouble FromProto(const v1::WorkerTrouble& in, Checker& check);
Leave FromProto(const v1::Leave& in, Checker& check);
Retire FromProto(const v1::Retire& in, Checker& check);
Stop FromProto(const v1::Stop& in, Checker& check);

// ---- slab_codecs.cpp
v1::ChunkRequest ToProto(const ChunkRequest& in);
v1::Chunk ToProto(const Chunk& in);
v1::ChunkRefused ToProto(const ChunkRefused& in);

ChunkRequest FromProto(const v1::ChunkRequest& in, Checker& check);
Chunk FromProto(const v1::Chunk& in, Checker& check);
ChunkRefused FromProto(const v1::ChunkRefused& in, Checker& check);

// ---- image_codecs.cpp
v1::PartialImage ToProto(const PartialImage& in);
PartialImage FromProto(const v1::PartialImage& in, Checker& check);
v1::SharedImage ToProto(const SharedImage& in);
SharedImage FromProto(const v1::SharedImage& in, Checker& check);
v1::SharedBlock ToProto(const BlockName& in);
BlockName FromProto(const v1::SharedBlock& in, Checker& check);
v1::PackedRuns ToProto(const PackedRuns& in);
PackedRuns FromProto(const v1::PackedRuns& in, Checker& check);
v1::ImageReceived ToProto(const ImageReceived& in);
ImageReceived FromProto(const v1::ImageReceived& in, Checker& check);
v1::ImageRefused ToProto(const ImageRefused& in);
ImageRefused FromProto(const v1::ImageRefused& in, Checker& check);

// ---- client_codecs.cpp
v1::SubmitFrame ToProto(const SubmitFrame& in);
v1::FrameProgress ToProto(const FrameProgress& in);
v1::FrameStatistics ToProto(const FrameStatistics& in);
v1::FrameReply ToProto(const FrameReply& in);
v1::FrameFailed ToProto(const FrameFailed& in);
v1::CancelFrame ToProto(const CancelFrame& in);
v1::ClientPing ToProto(const ClientPing& in);
v1::ClientPong ToProto(const ClientPong& in);
v1::StatusQuery ToProto(const StatusQuery& in);
v1::WorkerStatus ToProto(const WorkerStatus& in);
v1::DatasetStatus ToProto(const DatasetStatus& in);
v1::StatusReply ToProto(const StatusReply& in);
v1::ShutDown ToProto(const ShutDown& in);
v1::ShutDownReply ToProto(const ShutDownReply& in);

SubmitFrame FromProto(const v1::SubmitFrame& in, Checker& check);
FrameProgress FromProto(const v1::FrameProgress& in, Checker& check);
FrameStatistics FromProto(const v1::FrameStatistics& in, Checker& check);
FrameReply FromProto(const v1::FrameReply& in, Checker& check);
FrameFailed FromProto(const v1::FrameFailed& in, Checker& check);
CancelFrame FromProto(const v1::CancelFrame& in, Checker& check);
ClientPing FromProto(const v1::ClientPing& in, Checker& check);
ClientPong FromProto(const v1::ClientPong& in, Checker& check);
StatusQuery FromProto(const v1::StatusQuery& in, Checker& check);
WorkerStatus FromProto(const v1::WorkerStatus& in, Checker& check);
DatasetStatus FromProto(const v1::DatasetStatus& in, Checker& check);
StatusReply FromProto(const v1::StatusReply& in, Checker& check);
ShutDown FromProto(const v1::ShutDown& in, Checker& check);
ShutDownReply FromProto(const v1::ShutDownReply& in, Checker& check);

// ---- messages in fields

template <class Proto>
auto Read(std::string_view field, const Proto& in, Checker& check) {
  const auto scope = check.In(field);
  return FromProto(in, check);
}

// At most `max` items.
template <class Proto>
auto ReadAll(std::string_view field, const google::protobuf::RepeatedPtrField<Proto>& in, std::size_t max, Checker& check) {
  std::vector<decltype(FromProto(in[0], check))> out;
  const int count = check.Count(field, in.size(), max);
  out.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    const auto scope = check.In(field, static_cast<std::size_t>(i));
    out.push_back(FromProto(in[i], check));
  }
  return out;
}

template <class Struct, class Proto>
void WriteAll(const std::vector<Struct>& in, google::protobuf::RepeatedPtrField<Proto>* out) {
  out->Reserve(static_cast<int>(in.size()));
  for (const Struct& item : in) *out->Add() = ToProto(item);
}

}  // namespace slabstream
