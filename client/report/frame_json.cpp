#include "client/report/frame_json.h"

#include <nlohmann/json.hpp>

namespace slabstream {

nlohmann::ordered_json LevelsJson(const FrameStatistics& statistics) {
  nlohmann::ordered_json levels = nlohmann::ordered_json::array();
  for (const auto& [level, boxes, voxels] : statistics.levels) levels.push_back({{"level", level}, {"boxes", boxes}, {"voxels", voxels}});
  return levels;
}

nlohmann::ordered_json BytesJson(const FrameSummary& summary) {
  return {{"voxels", summary.voxel_bytes}, {"stored", summary.stored_bytes}, {"images", summary.image_bytes}};
}

}  // namespace slabstream
