#include "tests/fuzz/fuzz_target.h"

#include <unistd.h>

#include <algorithm>

#include "tests/fuzz/decoders.h"

namespace slabstream {

const std::vector<FuzzTarget>& FuzzTargets() {
  static const std::vector<FuzzTarget> targets = {
      {"messages", "messages of every plane", DecodeMessage, MessageSeeds},
      {"payloads", "packed chunks of voxels and packed runs", DecodePayload, PayloadSeeds},
      {"run-images", "run images", DecodeRunImage, RunImageSeeds},
      {"schedules", "combining schemes and their schedules", DecodeSchedule, ScheduleSeeds},
      {"policies", "policies and parameters of renderers", DecodePolicy, PolicySeeds},
      {"transfer-functions", "ParaView's colour maps", DecodeTransferFunction, TransferFunctionSeeds},
      {"brick-indices", "indices of the bricks of a source", DecodeBrickIndex, BrickIndexSeeds},
      {"color-tables", "tables of label colours", DecodeColorTable, ColorTableSeeds},
      {"volume-files", "volume files of every format", DecodeVolumeFile, VolumeFileSeeds},
      {"chunk-codecs", "codecs of chunks", DecodeChunkCodec, ChunkCodecSeeds},
      {"zarr", "metadata, shards and chunks of Zarr", DecodeZarr, ZarrSeeds},
      {"dicom-files", "DICOM files, but for their pixels", DecodeDicomFile, DicomFileSeeds},
      {"mesh-files", "files of unstructured grids", DecodeMeshFile, MeshFileSeeds},
      {"shape-files", "files of meshes, lines and points", DecodeShapeFile, ShapeFileSeeds},
      {"hdf5-files", "HDF5 files and their chunks", DecodeHdf5File, Hdf5FileSeeds},
      {"xdmf-files", "XDMF files", DecodeXdmfFile, XdmfFileSeeds},
      {"n5-containers", "attributes and blocks of N5", DecodeN5Container, N5ContainerSeeds},
      {"precomputed", "info files and chunks of precomputed volumes", DecodePrecomputed, PrecomputedSeeds},
      {"service-files", "service files, folders of keys and records of services", DecodeServiceFile, ServiceFileSeeds},
      {"owners", "where owners are, and their memory", DecodeOwners, OwnersSeeds},
      {"sweeps", "files of experiment sweep", DecodeSweep, SweepSeeds},
      {"pictures", "headers of PNG and EXR, and how their pictures were made", DecodePicture, PictureSeeds},
      {"page-messages", "what pages and scripts send to the gateway", DecodePageMessage, PageMessageSeeds},
      {"values", "values of the command line", DecodeValue, ValueSeeds},
  };
  return targets;
}

const FuzzTarget* FindFuzzTarget(std::string_view name) {
  const auto found = std::ranges::find(FuzzTargets(), name, &FuzzTarget::name);
  return found == FuzzTargets().end() ? nullptr : &*found;
}

FuzzSeed& FuzzSeed::Put(std::span<const std::byte> bytes) {
  bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  return *this;
}

std::filesystem::path PlaceOfFuzzFiles() {
  const std::filesystem::path memory = "/dev/shm";
  return ::access(memory.c_str(), W_OK) == 0 ? memory : std::filesystem::temp_directory_path();
}

void CheckRefusal(const Status& status) {
  constexpr std::size_t kMaxBytes = 4096;
  CHECK(!status.ok());
  CHECK(!status.message().empty());
  CHECK(status.message().find_first_of("\n\r") == std::string::npos) << status.message();
  CHECK_LE(status.message().size(), kMaxBytes) << status.message();
}

}  // namespace slabstream
