// Whoever holds which voxels, the picture is that of one renderer that holds the whole volume: for arrangements in any order, any number of
// owners and workers, both projections, an eye as near as can be, and voxels that the coordinator holds or that are read in parts.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "client/embedded/embedded_service.h"
#include "common/volume/summary.h"
#include "data/sources/volume_source.h"
#include "laboratory/experiments/owner_arrangements.h"
#include "tests/data/sources/memory_source.h"
#include "tests/service/pictures.h"
#include "tests/support/random_volume.h"
#include "tests/support/renderers.h"

namespace slabstream {
namespace {

constexpr Index3 kSize = {44, 36, 52};
constexpr double kNear = 35;  // the whole volume must be in front of the eye

std::shared_ptr<const Volume> TwoBalls() {
  const auto value = [](const Index3& v) {
    const auto distance = [&](const Vec3& center) { return Length(ToVec3(v) - center); };
    return std::max({0.0, 250 - 12 * distance({12, 10, 14}), 250 - 10 * distance({30, 22, 36})});
  };
  return std::make_shared<const Volume>(MakeTestVolume(kSize, ScalarType::kUint8, value));
}

// The volume, with owners.
class OwnedSource : public DescribedSource {
 public:
  OwnedSource(std::shared_ptr<VolumeSource> source, OwnedBoxes owned) : DescribedSource(source, Owned(source->info(), std::move(owned))) {}

 private:
  static SourceInfo Owned(SourceInfo info, OwnedBoxes owned) {
    info.levels.front().owned = std::make_shared<const OwnedBoxes>(std::move(owned));
    info.levels.front().block = {16, 16, 16};
    return info;
  }
};

class OwnersTest : public testing::TestWithParam<int> {
 protected:
  void Start(const OwnerArrangement& arrangement, std::uint32_t owners, bool in_parts) {
    auto source = std::make_shared<OwnedSource>(MakeMemorySource(volume_, {}), Arrange(arrangement, kSize, owners));
    DataSource data;
    data.at_level = std::make_shared<const SourceAtLevel>(
        SourceAtLevel{.source = source,
                      .surveyed = std::make_shared<const VolumeSummary>(Summarize(*volume_)),
                      .surveyed_level = in_parts ? std::optional<int>() : 0,
                      .stored = {"/where/nobody/looks", 0, 1, {{0, 0, 0}, source->info().levels.front().block}},
                      .stamp = nullptr});
    EmbeddedOptions options;
    options.workers = GetParam();
    options.worker.threads = 1;
    options.coordinator.catalogue["ball"] = data;
    if (in_parts) options.coordinator.machine.memory_bytes = std::uint64_t{64} << 10;
    client_.reset();
    service_.reset();
    auto service = EmbeddedService::Start(context_, options);
    ASSERT_TRUE(service.ok()) << service.status().message();
    service_ = *std::move(service);
    client_.emplace(service_->Connect().value());
  }

  const std::shared_ptr<const Volume> volume_ = TwoBalls();
  Context context_;
  std::unique_ptr<EmbeddedService> service_;
  std::optional<Client> client_;
};

TEST_P(OwnersTest, NeverChangeThePicture) {
  std::uint32_t number = 0;
  for (const OwnerArrangement& arrangement : OwnerArrangements()) {
    for (const bool in_parts : {false, true}) {
      const std::uint32_t owners = std::array{1U, 3U, 8U, 16U, 5U}[number++ % 5];
      ASSERT_NO_FATAL_FAILURE(Start(arrangement, owners, in_parts));
      for (FrameRequest request : RequestsOfRenderers(kNear)) {
        request.policy.assignment = "owner";
        SCOPED_TRACE(testing::Message() << arrangement.name << ", " << owners << " owners, " << GetParam() << " workers, "
                                        << request.renderer << ", projection " << int(request.view.projection) << ", distance "
                                        << request.view.distance << (in_parts ? ", in parts" : ""));
        const Result<Picture> picture = client_->Render(request, std::chrono::seconds(60));
        ASSERT_TRUE(picture.ok()) << picture.status().message();
        request.policy = {};  // nobody owns what is rendered directly
        EXPECT_LE(LargestDifference(picture->image, RenderDirectly(request, *volume_), request.size), AllowedRounding(request));
        EXPECT_EQ(picture->statistics.assignment, "owner");
      }
    }
  }
}

TEST_P(OwnersTest, KeepTheirBoxesFromAllSides) {
  ASSERT_NO_FATAL_FAILURE(Start(OwnerArrangements().front(), std::uint32_t(GetParam()), false));
  std::map<std::uint32_t, WorkerId> worker_of;  // by box
  for (double azimuth = 5; azimuth < 360; azimuth += 60) {
    FrameRequest request = TestRequest(FindRenderer("raycast"), azimuth, 0);
    request.policy.assignment = "owner";
    const Result<Picture> picture = client_->Render(request, std::chrono::seconds(60));
    ASSERT_TRUE(picture.ok()) << picture.status().message();
    for (const RankReport& report : picture->statistics.reports) {
      if (report.image_bounds.empty()) continue;  // it made the picture
      EXPECT_EQ(worker_of.emplace(report.box, report.worker).first->second, report.worker);
    }
  }
  EXPECT_FALSE(worker_of.empty());
}

TEST_P(OwnersTest, AreNeededAndHaveFixedBoxes) {
  ASSERT_NO_FATAL_FAILURE(Start(OwnerArrangements().front(), 4, false));
  FrameRequest request = TestRequest(FindRenderer("raycast"), 5, 0);
  request.policy.assignment = "owner";
  request.policy.balance = "dynamic";
  EXPECT_THAT(client_->Render(request, std::chrono::seconds(60)).status().message(),
              testing::HasSubstr("policy.assignment is 'owner', whose boxes stay where they are, but policy.balance is 'dynamic'"));
}

INSTANTIATE_TEST_SUITE_P(Workers, OwnersTest, testing::Values(1, 3, 8));

}  // namespace
}  // namespace slabstream
