// The targets' functions (fuzz_target.h), one file for each pair.
#pragma once

#include "tests/fuzz/fuzz_target.h"

namespace slabstream {

bool DecodeMessage(std::span<const std::byte> input);
std::vector<FuzzBytes> MessageSeeds();

bool DecodePayload(std::span<const std::byte> input);
std::vector<FuzzBytes> PayloadSeeds();

bool DecodeRunImage(std::span<const std::byte> input);
std::vector<FuzzBytes> RunImageSeeds();

bool DecodeSchedule(std::span<const std::byte> input);
std::vector<FuzzBytes> ScheduleSeeds();

bool DecodePolicy(std::span<const std::byte> input);
std::vector<FuzzBytes> PolicySeeds();

bool DecodeTransferFunction(std::span<const std::byte> input);
std::vector<FuzzBytes> TransferFunctionSeeds();

bool DecodeColorTable(std::span<const std::byte> input);
std::vector<FuzzBytes> ColorTableSeeds();

bool DecodeVolumeFile(std::span<const std::byte> input);
std::vector<FuzzBytes> VolumeFileSeeds();

bool DecodeChunkCodec(std::span<const std::byte> input);
std::vector<FuzzBytes> ChunkCodecSeeds();

bool DecodeZarr(std::span<const std::byte> input);
std::vector<FuzzBytes> ZarrSeeds();

bool DecodeDicomFile(std::span<const std::byte> input);
std::vector<FuzzBytes> DicomFileSeeds();

bool DecodeMeshFile(std::span<const std::byte> input);
std::vector<FuzzBytes> MeshFileSeeds();

bool DecodeShapeFile(std::span<const std::byte> input);
std::vector<FuzzBytes> ShapeFileSeeds();

bool DecodeBrickIndex(std::span<const std::byte> input);
std::vector<FuzzBytes> BrickIndexSeeds();

bool DecodeHdf5File(std::span<const std::byte> input);
std::vector<FuzzBytes> Hdf5FileSeeds();

bool DecodeXdmfFile(std::span<const std::byte> input);
std::vector<FuzzBytes> XdmfFileSeeds();

bool DecodeN5Container(std::span<const std::byte> input);
std::vector<FuzzBytes> N5ContainerSeeds();

bool DecodePrecomputed(std::span<const std::byte> input);
std::vector<FuzzBytes> PrecomputedSeeds();

bool DecodeServiceFile(std::span<const std::byte> input);
std::vector<FuzzBytes> ServiceFileSeeds();

bool DecodeOwners(std::span<const std::byte> input);
std::vector<FuzzBytes> OwnersSeeds();

bool DecodeSweep(std::span<const std::byte> input);
std::vector<FuzzBytes> SweepSeeds();

bool DecodePicture(std::span<const std::byte> input);
std::vector<FuzzBytes> PictureSeeds();

bool DecodePageMessage(std::span<const std::byte> input);
std::vector<FuzzBytes> PageMessageSeeds();

bool DecodeValue(std::span<const std::byte> input);
std::vector<FuzzBytes> ValueSeeds();

}  // namespace slabstream
