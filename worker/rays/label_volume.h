// LabelVolume: the labels of a padded box as kernels read them: small numbers in place of labels of up to 64 bits, and which label each
// number is. It stays with the padded box between frames. What labels look like is found for each number of a box, not for each voxel: of
// a thousand selected labels among a million, no voxel is read again.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "common/base/status.h"
#include "common/frame/label_look.h"
#include "worker/rays/ray_volume.h"

namespace slabstream {

struct NumberedLabels {
  RayPiece numbers;                   // uint8, uint16 or uint32
  std::vector<std::uint64_t> values;  // by number, rising; the first is 0: no label
};

class LabelVolume : public BoxCache {
 public:
  // Of the padded box of a field of labels. Made by the first call. ResourceExhausted: more voxels than kernels address (kMostRayBytes).
  // Parallel.
  Result<const NumberedLabels*> Of(const BoxData& data);

  // How each number is drawn. Valid until the next call with another look. Parallel.
  const std::vector<LabelStyle>& StylesOf(const LabelLook& look);

  std::size_t bytes() const override;

 private:
  std::unique_ptr<const NumberedLabels> labels_;
  std::unique_ptr<const LabelLook> look_;  // that of styles_
  std::vector<LabelStyle> styles_;
};

// Which numbers are material under any transfer function.
class MatterNumbers {
 public:
  MatterNumbers(LabelMode mode, const std::vector<LabelStyle>& styles);

  // Numbers from low to high; greater ones than there are count as the last. False if low > high.
  bool AnyBetween(float low, float high) const;
  friend bool operator==(const MatterNumbers&, const MatterNumbers&) = default;

 private:
  std::vector<std::uint32_t> matter_before_;  // numbers below this one
};

}  // namespace slabstream
