// Whatever the policy, the picture is that of one renderer that holds the whole volume: every partition, assignment, way to combine and
// renderer, for any number of workers, in both projections, with boxes that change from frame to frame.
#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "client/embedded/embedded_service.h"
#include "common/combining/schemes.h"
#include "common/decomposition/decomposition.h"
#include "common/planning/assignment.h"
#include "common/planning/policy_names.h"
#include "tests/common/mesh/mesh_samples.h"
#include "tests/service/pictures.h"
#include "tests/support/random_volume.h"
#include "tests/support/renderers.h"

namespace slabstream {
namespace {

// Two small balls, far from each other, in a grid that is empty else.
std::shared_ptr<const Volume> SparseVolume() {
  const auto value = [](const Index3& v) {
    const auto distance = [&](const Vec3& center) { return Length(ToVec3(v) - center); };
    return std::max({0.0, 250 - 12 * distance({18, 16, 20}), 250 - 15 * distance({58, 40, 66})});
  };
  return std::make_shared<const Volume>(AsGrid(MakeTestVolume({76, 60, 88}, ScalarType::kUint8, value), 4));
}

// A service of GetParam() workers.
class PoliciesTest : public testing::TestWithParam<int> {
 protected:
  void SetUp() override {
    EmbeddedOptions options;
    options.workers = GetParam();
    options.worker.threads = 1;
    options.coordinator.catalogue["ball"] = [volume = volume_]() -> Result<std::shared_ptr<const Volume>> { return volume; };
    auto service = EmbeddedService::Start(context_, options);
    ASSERT_TRUE(service.ok()) << service.status().message();
    service_ = *std::move(service);
    client_.emplace(service_->Connect().value());
  }

  const std::shared_ptr<const Volume> volume_ = SparseVolume();
  Context context_;
  std::unique_ptr<EmbeddedService> service_;
  std::optional<Client> client_;
};

TEST_P(PoliciesTest, NeverChangeThePicture) {
  std::size_t frame = 0;
  for (const RendererKind* renderer : Renderers()) {
    for (const Projection projection : renderer->projections()) {
      FrameRequest request = TestRequest(renderer, 120, 1);
      request.view.projection = projection;
      const LocalImage expected = RenderDirectly(request, *volume_);
      ASSERT_GT(HighestAlpha(expected), ExpectedAlpha(request));
      for (const DecompositionEntry& decomposition : Decompositions()) {
        for (const AssignmentEntry& assignment : Assignments()) {
          if (assignment.by_owner) continue;  // nobody owns this volume's voxels: owners_test.cpp
          // The other lists in turn, so that all pairs come up over all of it.
          ++frame;
          request.policy.decomposition = decomposition.name;
          request.policy.assignment = assignment.name;
          request.policy.balance_by = BalanceByChoices()[frame % BalanceByChoices().size()].name;
          request.policy.balance = Balances()[frame / 3 % Balances().size()].name;
          const std::size_t scheme = frame % (CombiningSchemes().size() + 1);
          request.policy.combine = scheme == 0 ? "" : CombiningSchemes()[scheme - 1].name;
          request.policy.groups = 1 + int(frame % 3);
          SCOPED_TRACE(testing::Message() << GetParam() << " workers, renderer " << renderer->name() << ", projection " << int(projection)
                                          << ", " << request.policy.groups << " groups, " << request.policy.decomposition << ", "
                                          << request.policy.balance_by << ", " << request.policy.assignment << ", "
                                          << request.policy.balance << ", " << request.policy.combine);
          Result<Picture> picture = client_->Render(request, std::chrono::seconds(60));
          ASSERT_TRUE(picture.ok()) << picture.status().message();
          EXPECT_LE(LargestDifference(picture->image, expected, request.size), AllowedDifference(request));
          const FrameStatistics& done = picture->statistics;
          EXPECT_EQ(done.decomposition, request.policy.decomposition);
          EXPECT_EQ(done.assignment, request.policy.assignment);
          EXPECT_EQ(done.combine, request.policy.combine.empty() ? "fan-in" : request.policy.combine);
          EXPECT_EQ(picture->statistics.balance, request.policy.balance);
          EXPECT_NE(picture->statistics.balance_by, "auto");
        }
      }
    }
  }
}

// Boxes with a surface are rendered, whatever says where boxes are.
TEST_P(PoliciesTest, NeverChangeIsosurfaces) {
  for (const RendererKind* renderer : Renderers()) {
    if (!renderer->Can(Ability::kIsosurfaces)) continue;
    FrameRequest request = TestRequest(renderer, 120, 1);
    request.transfer.choice = std::string(kNoTransfer);
    request.transfer.isosurfaces = {{100, {1, 0.5F, 0.2F}, 0.5}};
    const LocalImage expected = RenderDirectly(request, *volume_);
    ASSERT_GT(HighestAlpha(expected), 0.4F);
    for (const DecompositionEntry& decomposition : Decompositions()) {
      for (const auto& metric : BalanceByChoices()) {
        request.policy.decomposition = decomposition.name;
        request.policy.balance_by = metric.name;
        SCOPED_TRACE(testing::Message() << GetParam() << " workers, renderer " << renderer->name() << ", " << decomposition.name << ", "
                                        << metric.name);
        const Result<Picture> picture = client_->Render(request, std::chrono::seconds(60));
        ASSERT_TRUE(picture.ok()) << picture.status().message();
        EXPECT_LE(LargestDifference(picture->image, expected, request.size), AllowedDifference(request));
      }
    }
  }
}

// Over a scheme that sends a rank's pixels at once and one that sends them in parts: the same pixels, in more runs.
TEST(PoliciesStatistics, CountTheBytesOfEveryMessage) {
  const std::shared_ptr<const Volume> volume = SparseVolume();
  EmbeddedOptions options;
  options.workers = 4;
  options.worker.threads = 1;
  options.coordinator.catalogue["ball"] = [volume]() -> Result<std::shared_ptr<const Volume>> { return volume; };
  Context context;
  const auto service = EmbeddedService::Start(context, options);
  ASSERT_TRUE(service.ok()) << service.status().message();
  Client client = (*service)->Connect().value();
  FrameRequest request = TestRequest(Splatting(), 120, 1);
  const auto image_bytes = [&](const char* scheme) {
    request.policy.combine = scheme;
    const Result<Picture> picture = client.Render(request, std::chrono::seconds(60));
    std::uint64_t bytes = 0;
    for (const RankReport& report : picture.value().statistics.reports) bytes += report.image_bytes;
    return double(bytes);
  };
  const double whole = image_bytes("fan-in"), strips = image_bytes("tree:2,strips=4");
  EXPECT_GT(whole, 0);
  EXPECT_GE(strips, whole);
  EXPECT_LE(strips, 1.5 * whole);
}

INSTANTIATE_TEST_SUITE_P(Workers, PoliciesTest, testing::Values(1, 2, 3, 5, 8, 13));

}  // namespace
}  // namespace slabstream
