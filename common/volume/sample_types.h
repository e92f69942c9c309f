// SampleTypes: what is stored of a dataset's voxels, and so what a worker fetches of a box.
#pragma once

#include "common/volume/volume.h"

namespace slabstream {

struct SampleTypes {
  SampleTypes(ScalarType of_samples = ScalarType::kUint8, bool with_cells = false)  // NOLINT(google-explicit-constructor): voxels alone
      : samples(of_samples), cells(with_cells) {}

  ScalarType samples;
  bool cells;  // of an unstructured grid: a box of it has those that touch it, too

  friend bool operator==(const SampleTypes&, const SampleTypes&) = default;
  friend auto operator<=>(const SampleTypes&, const SampleTypes&) = default;
};

}  // namespace slabstream
