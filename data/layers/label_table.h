// What is known of the labels of a source: colours and names.
//
// Colours are those of the table that is named; else, of a NIfTI file X.nii or X.nii.gz, those of X.nii.lut beside it, with the names of
// X.nii.txt (a number and a name in each line), as MRIcron has them; else those that the source itself states (OME-Zarr's image-label);
// else StandardColor. A label that the table does not have has its StandardColor.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/volume/labels.h"
#include "common/volume/volume.h"
#include "data/layers/color_table.h"
#include "data/volume_io/stated_label.h"

namespace slabstream {

// The files of a table, and what is in them.
struct FoundColors {
  std::vector<std::string> files = {};  // that were read
  ColorTable table = {};
};
// `labels`: the path of the source; `named`: of a table; "": none is named. Errors of ReadColorTable.
Result<FoundColors> ReadLabelColors(const std::string& labels, const std::string& named);

// The labels of a volume, rising, without 0. nullopt: more than kMaxLabels.
std::optional<std::vector<std::uint64_t>> ValuesOfLabels(const Volume& labels);

// `values`: all labels of the source; nullopt: not known. `stated`: what the source says of them, if `colors` says nothing.
LabelTable MakeLabelTable(const std::optional<std::vector<std::uint64_t>>& values, const ColorTable& colors,
                          const std::vector<StatedLabel>& stated);

}  // namespace slabstream
