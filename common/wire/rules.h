// What holds between the fields of a message that has been read, where each field alone is right already. Faults go to the Checker. The
// limits of single fields stand in the schema.
#pragma once

#include "common/wire/any_message.h"
#include "common/wire/checker.h"

namespace slabstream {

// The messages that have no rules.
template <class Message>
void Rules(const Message&, Checker&) {}

// value_rules.cpp
void Rules(const Box&, Checker&);
void Rules(const PixelRange&, Checker&);
void Rules(const ValueRange&, Checker&);
void Rules(const Orientation&, Checker&);
void Rules(const VolumeDescription&, Checker&);
void Rules(const RunImageHeader&, Checker&);
void Rules(const EncodedRuns&, Checker&);
void Rules(const BlockName&, Checker&);
void Rules(const SharedImage&, Checker&);
void Rules(const PackedRuns&, Checker&);
void Rules(const PartialImage&, Checker&);
void Rules(const ShapeTiles&, Checker&);
void Rules(const ChunkRequest&, Checker&);
void Rules(const Chunk&, Checker&);
void Rules(const ChunkRefused&, Checker&);

// plan_rules.cpp
void Rules(const Camera&, Checker&);
void Rules(const SheetGrid&, Checker&);
void Rules(const StoredAt&, Checker&);
void Rules(const FrameSetup&, Checker&);
void Rules(const GroupAssignment&, Checker&);
void Rules(const FrameImage&, Checker&);

// client_rules.cpp
void Rules(const FrameRequest&, Checker&);
void Rules(const FrameProgress&, Checker&);
void Rules(const PictureGeometry&, Checker&);
void Rules(const PictureKey::Bar&, Checker&);
void Rules(const FrameReply&, Checker&);
void Rules(const SummaryQuery&, Checker&);
void Rules(const SummaryReply&, Checker&);
void Rules(const SampleQuery&, Checker&);
void Rules(const StatisticsReply&, Checker&);
void Rules(const JointHistogramReply&, Checker&);
void Rules(const PickQuery&, Checker&);
void Rules(const DatasetFields&, Checker&);
void Rules(const Ball&, Checker&);
void Rules(const PathCamera&, Checker&);
void Rules(const ViewQuery&, Checker&);
void Rules(const AddVolume&, Checker&);
void Rules(const SentFile&, Checker&);
void Rules(const VolumeCredit&, Checker&);
void Rules(const SteeredParameter&, Checker&);
void Rules(const RegisterOwner&, Checker&);
void Rules(const OwnerSteered&, Checker&);

// Each number is finite and above 0.
void CheckPositive(std::string_view field, const Vec3& v, Checker& check);
// Unit vectors at right angles, z = x cross y, but for rounding.
bool AreRightHanded(const Vec3& x, const Vec3& y, const Vec3& z);

}  // namespace slabstream
