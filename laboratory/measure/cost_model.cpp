#include "laboratory/measure/cost_model.h"

#include "common/volume/summary.h"

namespace slabstream {
namespace {

using enum WorkUnit;

StageCost MakeStage(Stage stage, std::string_view symbol, std::vector<std::pair<WorkUnit, double>> terms) {
  StageCost cost{stage, symbol, {}, {}};
  for (const auto& [unit, seconds] : terms) {
    cost.units.push_back(unit);
    cost.seconds[std::size_t(unit)] = seconds;
  }
  return cost;
}

}  // namespace

std::string_view ToString(WorkUnit unit) {
  constexpr std::string_view kNames[kWorkUnitCount] = {"box", "brick", "occupied voxel", "drawn voxel", "sheet pixel", "pixel"};
  return kNames[std::size_t(unit)];
}

WorkUnits CountWork(const Box& box, const Camera& camera, double occupied, double drawn, const PixelBounds& bounds, double pixels) {
  WorkUnits work{};
  work[std::size_t(kBox)] = 1;
  work[std::size_t(kBrickTest)] = double(box.voxel_count()) / (kBrick * kBrick * kBrick);
  work[std::size_t(kOccupied)] = occupied;
  work[std::size_t(kDrawn)] = drawn;
  work[std::size_t(kSheetPixel)] = double(box.size()[camera.traversal_axis]) * double(bounds.pixel_count());
  work[std::size_t(kPixel)] = pixels;
  return work;
}

double StageCost::Predict(const WorkUnits& work) const {
  double sum = 0;
  for (const WorkUnit unit : units) sum += seconds[std::size_t(unit)] * work[std::size_t(unit)];
  return sum;
}

CostModel::CostModel()
    : renderers{
          {"splat",
           {MakeStage(Stage::kTransform, "c_t, c_o", {{kBox, 5.3e-5}, {kBrickTest, 4.3e-8}, {kOccupied, 3.2e-10}, {kSheetPixel, 1.2e-11}}),
            MakeStage(Stage::kShade, "c_sh", {{kBox, 4.6e-6}, {kDrawn, 7.7e-10}}),
            MakeStage(Stage::kSplat, "c_sp", {{kBox, 0}, {kDrawn, 1.15e-9}, {kSheetPixel, 7.2e-12}}),
            MakeStage(Stage::kComposite, "c_cp", {{kBox, 0}, {kDrawn, 7.1e-10}, {kSheetPixel, 8.6e-12}})}},
          {"zbuffer",
           {MakeStage(Stage::kZBuffer, "c_t, c_o, c_z", {{kBox, 5e-7}, {kBrickTest, 0}, {kDrawn, 9.3e-9}, {kPixel, 1e-10}}),
            MakeStage(Stage::kShade, "c_sh", {{kBox, 1.9e-6}, {kPixel, 6.4e-9}})}}} {}

const std::vector<StageCost>& CostModel::stages(std::string_view renderer) const {
  static const std::vector<StageCost> none;
  const auto found = renderers.find(renderer);
  return found == renderers.end() ? none : found->second;
}

}  // namespace slabstream
