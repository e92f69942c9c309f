#include "coordinator/background_actions.h"

#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <vector>

#include "common/transport/socket.h"
#include "common/volume/sphere.h"
#include "coordinator/voxel_server.h"

namespace slabstream {
namespace {

// A file that was replaced and asked for anew may be loaded twice at a time, and both loads end with voxels of the same id. The machine
// drops the first ones when it hears of them. The second ones must be there when it hears of those.
TEST(BackgroundActions, VoxelsAreServedWhenTheirEventIsHandledWhateverAnEarlierEventOfTheBatchDropped) {
  const auto sphere = std::make_shared<const Volume>(MakeSphere({.size = 8}).value());
  Context context;
  const auto voxels = VoxelServer::Start(context, {"inproc://background-actions-test"}, Epoch{7}).value();
  BackgroundActions background({}, {}, {}, *voxels);
  for (LoadId load = 1; load <= 2; ++load) {
    LoadDataset action{.name = "ball", .load = load, .source = VolumeLoader([sphere] { return sphere; }), .most_bytes = 1 << 20};
    ASSERT_FALSE(background.Perform(action).has_value());
    Wait({}, &background.wakeup(), std::chrono::seconds(60));  // it is over, and its event waits
  }
  std::vector<LoadId> loaded;
  background.HandleEvents([&](const CoordinatorEvent& event) {
    const auto& ended = std::get<DatasetLoaded>(event);
    EXPECT_TRUE(voxels->Find(ended.dataset).any()) << "load " << ended.load;
    loaded.push_back(ended.load);
    UnloadDataset drop{ended.dataset};
    if (loaded.size() == 1) background.Perform(drop);
  });
  EXPECT_EQ(loaded, std::vector<LoadId>({1, 2}));
}

}  // namespace
}  // namespace slabstream
