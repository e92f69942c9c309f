#include "worker/renderers/raycast/ray_layers.h"

#include <cmath>

namespace slabstream {

LabelTables MakeLabelTables(const LabelLook& look, double steps_per_voxel, double opacity_distance) {
  LabelTables tables;
  tables.surface = look.mode == LabelMode::kSurface;
  tables.tint = tables.surface ? 0 : float(look.tint);
  tables.last = float(look.entries.size());
  tables.steps_a_length = float(steps_per_voxel * opacity_distance);
  tables.entries = {0, 0, 0, -1};
  for (const auto& [color, opacity, shown] : look.entries) {
    const double of_step = -std::expm1(std::log1p(-double(opacity)) / steps_per_voxel);
    tables.entries.insert(tables.entries.end(), {color.r, color.g, color.b, !shown ? -1 : tables.surface ? float(of_step) : opacity});
  }
  return tables;
}

}  // namespace slabstream
