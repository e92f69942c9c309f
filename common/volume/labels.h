// Labels: names of structures in place of values. A field of labels has one at each voxel: a whole number, 0 where there is no structure.
// Its samples are the numbers of the file themselves, in the narrowest of uint8, uint16, uint32 and uint64 that holds those of the file.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace slabstream {

inline constexpr std::size_t kMaxLabels = 4096;  // of which a dataset tells colours and names
inline constexpr std::size_t kMaxLabelNameBytes = 128;

using LabelColor = std::array<float, 3>;  // straight red, green, blue, [0, 1]

struct Label {
  std::uint64_t value = 0;  // in files and for users, at least 1
  LabelColor color{};
  std::string name = {};  // "": none is known
  friend bool operator==(const Label&, const Label&) = default;
};

// What is known of the labels of a field.
struct LabelTable {
  std::vector<Label> labels;  // values rise; at most kMaxLabels
  bool complete = false;      // the field has no others
  friend bool operator==(const LabelTable&, const LabelTable&) = default;
};

// The colour of a label for which nobody has chosen one: the same for the same value everywhere, and unlike those of values near it.
LabelColor StandardColor(std::uint64_t value);

}  // namespace slabstream
