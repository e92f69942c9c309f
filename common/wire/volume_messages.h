// Messages of the client plane by which a client sends a dataset that is no file of the coordinator's host.
//
//   client                                  coordinator
//   AddVolume   -------------------------->            admits it, or OrderRefused, which ends it at any time
//               <--------------------------  VolumeCredit           as it takes more
//   VolumePart + payload ----------------->            in order, within the credit
//               <--------------------------  DataReply              it is in the catalogue
//   DropVolume  -------------------------->            answered by OrderRefused (cancelled)
// A client sends one at a time: a new AddVolume ends the one before. If the client falls silent meanwhile, nothing stays. The dataset of a
// file (SentFile) lasts as long as its client: until a DropVolume of the same nonce, or until the client falls silent.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/volume/layers.h"
#include "common/volume/volume.h"

namespace slabstream {

inline constexpr std::uint32_t kMaxVolumePartBytes = std::uint32_t{1} << 19;
inline constexpr std::uint64_t kMaxSentFileBytes = std::uint64_t{1} << 40;

struct NewLabel {
  std::uint32_t value = 1;                         // [1, kMaxLabelValue]
  std::string name = {};                           // at most kMaxLabelNameBytes
  std::optional<std::array<float, 3>> color = {};  // straight, [0, 1]; none: StandardColor
  friend bool operator==(const NewLabel&, const NewLabel&) = default;
};

// A file that holds the whole dataset, which the coordinator reads.
struct SentFile {
  std::string name;         // as CheckDatasetName allows, and no dot begins it; its ending says the format
  std::uint64_t bytes = 1;  // [1, kMaxSentFileBytes]
  friend bool operator==(const SentFile&, const SentFile&) = default;
};

struct AddVolume {
  std::uint64_t nonce = 0;
  std::string name;  // 1 ... kMaxNameBytes
  VolumeDescription description;
  LayerTypes layers;
  std::vector<NewLabel> labels;       // values rise; at most kMaxLabels, and as many as numbers of the layer's type
  std::optional<SentFile> file = {};  // instead of description, layers and labels
  friend bool operator==(const AddVolume&, const AddVolume&) = default;

  // Bytes of the file, or of the samples of the volume and of its layers.
  std::uint64_t bytes() const {
    if (file) return file->bytes;
    return std::uint64_t(description.geometry.bounds().voxel_count()) * SampleTypes(description.type, layers).bytes_per_voxel();
  }
};

struct VolumeCredit {
  std::uint64_t nonce = 0;                  // AddVolume::nonce
  std::uint64_t received = 0, allowed = 0;  // bytes from the beginning; received <= allowed
  friend bool operator==(const VolumeCredit&, const VolumeCredit&) = default;
};

struct VolumePart {  // payload: the bytes
  std::uint64_t nonce = 0;
  std::uint64_t begin = 0;
  std::uint32_t bytes = 1;  // [1, kMaxVolumePartBytes]
  friend bool operator==(const VolumePart&, const VolumePart&) = default;
};

struct DropVolume {
  std::uint64_t nonce = 0;
  friend bool operator==(const DropVolume&, const DropVolume&) = default;
};

}  // namespace slabstream
