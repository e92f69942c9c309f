// Layers: what a dataset has at the voxels of its volume beside the volume's own samples. A layer is a volume on the same grid, so whoever
// cuts, stores or sends voxels treats it like one.
//
//   labels   which structure a voxel belongs to: a number of the dataset's LabelTable, 0: none. uint8 or uint16
//   overlay  a second scalar value, NaN: none. float32, data values. Only of what a client sends: it becomes a field of the dataset
//
// The cells of an unstructured grid (Volume::cells) are no layer of voxels: a box of it has those that touch it.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/volume/volume.h"

namespace slabstream {

// kVolume: none of the layers, but the volume itself.
enum class Layer : std::uint8_t { kVolume = 0, kLabels = 1, kOverlay = 2 };
inline constexpr std::array kLayers = {Layer::kVolume, Layer::kLabels, Layer::kOverlay};

// The types of stored samples. nullopt: there is no such layer.
struct LayerTypes {
  std::optional<ScalarType> labels = {}, overlay = {};
  bool cells = false;  // the volume has cells

  bool any() const { return labels || overlay; }
  friend bool operator==(const LayerTypes&, const LayerTypes&) = default;
  friend auto operator<=>(const LayerTypes&, const LayerTypes&) = default;
};

// All that is stored of a voxel.
struct SampleTypes {
  SampleTypes(ScalarType of_volume = ScalarType::kUint8, LayerTypes of_layers = {})  // NOLINT(google-explicit-constructor): no layers
      : volume(of_volume), layers(of_layers) {}

  ScalarType volume;
  LayerTypes layers;

  std::optional<ScalarType> Of(Layer layer) const {
    return layer == Layer::kVolume ? volume : layer == Layer::kLabels ? layers.labels : layers.overlay;
  }
  std::size_t bytes_per_voxel() const {
    std::size_t bytes = 0;
    for (const Layer layer : kLayers) {
      if (const auto type = Of(layer)) bytes += BytesPerSample(*type);
    }
    return bytes;
  }
  friend bool operator==(const SampleTypes&, const SampleTypes&) = default;
  friend auto operator<=>(const SampleTypes&, const SampleTypes&) = default;
};

// ---- labels

inline constexpr std::uint32_t kMaxLabelValue = 1U << 24;  // the largest label of a file: float32 holds all integers up to here
inline constexpr std::size_t kMaxLabels = 4096;            // labels that one label volume may hold, beside 0
inline constexpr std::size_t kMaxLabelNameBytes = 128;

struct Label {
  std::uint32_t value = 0;       // in files and for users, [1, kMaxLabelValue]
  std::array<float, 3> color{};  // straight red, green, blue, [0, 1]
  std::string name = {};         // "": none is known
  friend bool operator==(const Label&, const Label&) = default;
};

// The labels that a label volume holds; the label with number i is labels[i - 1]. Values ascend.
struct LabelTable {
  std::vector<Label> labels;
  friend bool operator==(const LabelTable&, const LabelTable&) = default;
};

// ---- voxels

// The layers of a volume, on its grid. Null: there is no such layer.
struct Layers {
  std::shared_ptr<const Volume> labels = nullptr;
  std::shared_ptr<const LabelTable> table = nullptr;  // if there are labels

  LayerTypes types() const {
    LayerTypes types;
    if (labels != nullptr) types.labels = labels->description.type;
    return types;
  }
};

struct LayeredVolume {
  std::shared_ptr<const Volume> volume = nullptr;
  Layers layers = {};
};

}  // namespace slabstream
