// The cost model: the time of each stage of rendering a box, as in the paper's model (Yagel and Machiraju, Eq. 20 and 25), in the units
// that our renderers count. Experiments fit its constants and print them beside the paper's. Plans do not use it: they use AnalyticCost
// (common/renderers/renderer_kind.h).
//
//   paper                             here, a box                                  why
//   c_t N^3/p  transform              kOccupied, kSheetPixel                       empty voxels are not transformed
//   c_o N^3/p  occupancy test         kBrickTest                                     bricks are tested, not voxels
//   c_sh C N^3/p  shade (splatting)   kDrawn                                       only what reaches an open pixel is shaded
//   c_sp C k^2 N^3/p  splat           kDrawn, kSheetPixel                          the filter is separable: beams, then columns
//   c_cp N I^2/p  composite           kSheetPixel, kDrawn                          only segments that hold something
//   c_z C N^3/p  Z-buffer             kBrickTest, kDrawn, kPixel                   faces towards the eye
//   c_sh C I^2  shade (Z-buffer)      kPixel                                       deferred: pixels that show something
//   c_co I^2 log p  combine           CombiningCosts (simulator/model)           a matter of the schedule, which is simulated
// kBox is a cost that every box has. Constants are seconds of one thread; laboratory/measure/cost_fit.h fits them.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include "common/image/pixel_bounds.h"
#include "common/stats/report.h"
#include "common/view/camera.h"
#include "common/volume/box.h"

namespace slabstream {

enum class WorkUnit : std::uint8_t {
  kBox = 0,         // 1
  kBrickTest = 1,   // 16^3 voxels of the box
  kOccupied = 2,    // occupied voxel of the box (splatting)
  kDrawn = 3,       // voxel that went through splat or Z-buffer
  kSheetPixel = 4,  // slices along the traversal axis x pixels of the image's bounds
  kPixel = 5,       // pixel that is not empty
};
inline constexpr int kWorkUnitCount = 6;
std::string_view ToString(WorkUnit unit);  // "occupied voxel"

using WorkUnits = std::array<double, kWorkUnitCount>;  // the amount of each

// For one box under one view, from a renderer's report. `bounds`: of its image.
WorkUnits CountWork(const Box& box, const Camera& camera, double occupied, double drawn, const PixelBounds& bounds, double pixels);

struct StageModel {
  Stage stage = Stage::kRender;
  std::vector<WorkUnit> units;  // the units that its time is a sum of, each with a constant
};

// The stages of a rendering; empty: there is no model of this renderer.
const std::vector<StageModel>& CostModelOf(std::string_view renderer);

}  // namespace slabstream
