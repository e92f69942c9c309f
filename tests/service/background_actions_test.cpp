#include "coordinator/service/background_actions.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <chrono>
#include <future>
#include <memory>
#include <string>
#include <vector>

#include "common/transport/socket.h"
#include "common/volume/sphere.h"
#include "coordinator/service/voxel_server.h"
#include "tests/data/stores/scripted_server.h"

namespace slabstream {
namespace {

// A file that was replaced and asked for anew may be loaded twice at a time, and both loads end with voxels of the same id. The machine
// drops the first ones when it hears of them. The second ones must be there when it hears of those.
TEST(BackgroundActions, VoxelsAreServedWhenTheirEventIsHandledWhateverAnEarlierEventOfTheBatchDropped) {
  const auto sphere = std::make_shared<const Volume>(MakeSphere({.size = 8}).value());
  Context context;
  const auto voxels = VoxelServer::Start(context, {"inproc://background-actions-test"}, Epoch{7}).value();
  BackgroundActions background({}, {}, *voxels);
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

// A server that takes requests and does not answer: more datasets of it than are loaded at a time, all asked for before a file.
TEST(BackgroundActions, AServerThatDoesNotAnswerHoldsUpItsOwnDatasetsAlone) {
  std::promise<void> end;
  const std::shared_future<void> ended(end.get_future());
  const ScriptedServer silent([&](const ServerRequest&) {
    ended.wait();
    return AnswerText("403 Forbidden", "");
  });
  const auto sphere = std::make_shared<const Volume>(MakeSphere({.size = 8}).value());
  Context context;
  const auto voxels = VoxelServer::Start(context, {"inproc://background-actions-silent-test"}, Epoch{8}).value();
  BackgroundActions background({}, {}, *voxels);
  const std::size_t far = 2 * kLoadsAtOnce;
  for (std::size_t i = 0; i < far; ++i) {
    LoadDataset action{.name = fmt::format("far{}", i), .load = LoadId(i), .source = {fmt::format("{}/{}", silent.url(), i), ""}};
    ASSERT_FALSE(background.Perform(action).has_value());
  }
  LoadDataset action{.name = "ball", .load = LoadId(far), .source = VolumeLoader([sphere] { return sphere; }), .most_bytes = 1 << 20};
  ASSERT_FALSE(background.Perform(action).has_value());
  std::vector<std::string> order;
  const auto take = [&](std::size_t count) {
    while (order.size() < count) {
      Wait({}, &background.wakeup(), std::chrono::seconds(60));
      background.HandleEvents([&](const CoordinatorEvent& event) {
        if (const auto* loaded = std::get_if<DatasetLoaded>(&event)) order.push_back(loaded->name);
        if (const auto* failed = std::get_if<DatasetFailed>(&event)) order.push_back(failed->name);
      });
    }
  };
  take(1);
  EXPECT_EQ(order.front(), "ball");
  end.set_value();
  take(far + 1);
}

TEST(BackgroundActions, ALoadThatNobodyWaitsForEnds) {
  std::promise<void> end, asked;
  const std::shared_future<void> ended(end.get_future());
  std::once_flag first;
  const ScriptedServer silent([&](const ServerRequest&) {
    std::call_once(first, [&] { asked.set_value(); });
    ended.wait();
    return AnswerText("403 Forbidden", "");
  });
  Context context;
  const auto voxels = VoxelServer::Start(context, {"inproc://background-actions-stop-test"}, Epoch{8}).value();
  BackgroundActions background({}, {}, *voxels);
  std::stop_source stop;
  LoadDataset action{.name = "far", .load = 1, .source = {silent.url() + "/a.zarr", ""}, .stop = stop.get_token()};
  ASSERT_FALSE(background.Perform(action).has_value());
  asked.get_future().wait();
  stop.request_stop();
  std::optional<Status> status;
  while (!status) {
    Wait({}, &background.wakeup(), std::chrono::seconds(60));
    background.HandleEvents([&](const CoordinatorEvent& event) { status = std::get<DatasetFailed>(event).status; });
  }
  EXPECT_EQ(status->code(), StatusCode::kCancelled);
  end.set_value();
}

}  // namespace
}  // namespace slabstream
