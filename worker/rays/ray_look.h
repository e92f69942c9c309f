// RayLook: tables and constants by which the ray caster turns an interpolated sample into colour and opacity. Made once a frame.
#pragma once

#include <vector>

#include "common/classification/region_table.h"
#include "common/memory/aligned_buffer.h"
#include "common/view/camera.h"
#include "common/view/shading.h"
#include "worker/rays/view_rays.h"

namespace slabstream {

struct RayLook {
  // Entry of a stored sample s: floor(clamp((s - origin) * scale + rounding, 0, last)). Four floats each: straight colour, and the opacity
  // of one step along a ray. Rounding is 0.5, or a little less if bins hold several values: then single precision never moves a value that
  // ClassificationTable::BinOf puts into an empty bin into a visible bin above.
  float origin = 0, scale = 1, rounding = 0.5F, last = 0;
  AlignedVector<float> entries;

  // Isosurfaces that show. Four floats each in `surface_looks`: straight colour and opacity.
  std::vector<float> isovalues;  // stored samples
  AlignedVector<float> surface_looks;

  // Opacity by gradient: a factor for each magnitude m, entry min(m * gradient_scale + 0.5, gradient_last). Empty: there is none. With
  // factors, the opacity a in `entries` is that of the transfer function's distance, and a step's is 1 - (1 - a * factor)^step_exponent.
  AlignedVector<float> gradient_factors;
  float gradient_scale = 0, gradient_last = 0, step_exponent = 1;

  // Two-dimensional: where `entries` have an opacity above 0, this table replaces them. Its opacities are those of one step. Null: there is
  // none.
  const RegionTable* regions = nullptr;

  bool by_gradient() const { return !gradient_factors.empty() || regions != nullptr; }

  bool volume_shows = false;  // an entry's opacity is above 0

  // Phong's model for the gradient g of samples in data space. With n = g / spacing: N.L = Dot(g, light) / |g * inverse_spacing|. Gradients
  // are counted in a unit near to what the table's samples differ by, so that neither 1e-30 nor 1e30 has a square that no float holds.
  struct Light {
    Float3 direction;  // towards the light, by component divided by spacing and unit
    float to_viewer;   // L.V
  };
  bool phong = true;
  float gradient_unit = 1;             // stored samples; a power of two
  Float3 inverse_spacing{}, viewer{};  // 1, and towards the viewer, divided like the lights
  std::vector<Light> lights;
  float ambient = 0, diffuse = 1, specular = 0, shininess = 1;
  int whole_shininess = 0;  // shininess if it is a whole number up to 128, otherwise 0
};

// `steps_per_voxel`: samples in a voxel length along a ray; infinite: nothing but isosurfaces shows.
//
// If each stored integer has a bin of its own, colour and opacity between two bins are interpolated linearly, at as many places as fit into
// kMaxBins entries. A table with several values in a bin is used as it is. Either way a value between two samples is visible only if a bin
// between theirs is visible, so a brick that is empty by the ClassificationTable is empty here.
// `table`: of `transfer`. `spacing`: of the voxels that are sampled. Regions of the transfer function are left out: see `regions`.
RayLook MakeRayLook(const ClassificationTable& table, const TransferFunction& transfer, const VolumeDescription& description,
                    const Camera& camera, const Shading& shading, double steps_per_voxel, const Vec3& spacing);
inline RayLook MakeRayLook(const ClassificationTable& table, const TransferFunction& transfer, const VolumeDescription& description,
                           const Camera& camera, const Shading& shading, double steps_per_voxel) {
  return MakeRayLook(table, transfer, description, camera, shading, steps_per_voxel, camera.spacing);
}

// Whether samples between two stored ones, low <= high, may show.
class VisibleSamples {
 public:
  explicit VisibleSamples(const RayLook& look);
  bool AnyMatterBetween(float low, float high) const;                 // a sample may have an opacity above 0; false if low > high
  bool AnySurfaceBetween(float low, float high) const;                // one may lie on an isosurface; false if low > high
  const std::vector<float>& isovalues() const { return isovalues_; }  // stored samples
  bool AnyBetween(float low, float high) const { return AnyMatterBetween(low, high) || AnySurfaceBetween(low, high); }
  friend bool operator==(const VisibleSamples&, const VisibleSamples&) = default;

 private:
  float origin_, scale_, rounding_, last_;
  std::vector<std::int32_t> visible_before_;  // entries before this one
  std::vector<float> isovalues_;
};

}  // namespace slabstream
