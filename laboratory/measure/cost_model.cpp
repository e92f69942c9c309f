#include "laboratory/measure/cost_model.h"

#include <map>

namespace slabstream {
using enum WorkUnit;

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

const std::vector<StageModel>& CostModelOf(std::string_view renderer) {
  static const std::map<std::string_view, std::vector<StageModel>> models = {
      {"splat",
       {{Stage::kTransform, {kBox, kBrickTest, kOccupied, kSheetPixel}},
        {Stage::kShade, {kBox, kDrawn}},
        {Stage::kSplat, {kBox, kDrawn, kSheetPixel}},
        {Stage::kComposite, {kBox, kDrawn, kSheetPixel}}}},
      {"zbuffer", {{Stage::kZBuffer, {kBox, kBrickTest, kDrawn, kPixel}}, {Stage::kShade, {kBox, kPixel}}}},
      {"", {}}};
  const auto found = models.find(renderer);
  return (found == models.end() ? models.find("") : found)->second;
}

}  // namespace slabstream
