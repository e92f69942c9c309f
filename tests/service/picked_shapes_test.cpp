// The shapes that pixels show, as clients of a service hear of them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/embedded/embedded_service.h"
#include "data/catalogue/shape_data.h"
#include "tests/service/pictures.h"
#include "tests/worker/shapes/shape_pictures.h"

namespace slabstream {
namespace {

using std::chrono::seconds;
using ::testing::HasSubstr;
using testing::Plane;

constexpr int kSize = 48;  // voxels a side

class PickedShapes : public ::testing::Test {
 protected:
  PickedShapes() {
    auto volume = std::make_shared<Volume>();
    volume->description.geometry = {Uniform(kSize), {1, 1, 1}};
    volume->block = MakeVoxelBlock(volume->description.geometry.bounds(), ScalarType::kUint8);
    std::ranges::fill(volume->block.bytes, std::byte{100});
    Shape sheet = Plane({23.5, 10.2, 23.5}, {200, 0, 0}, {0, 0, 200}, 3);
    for (const auto& position : sheet.positions) sheet.values.push_back(position[0]);
    // Most of its bytes are 0, so as a volume most of its bricks hold one value.
    Shape zeros = Plane({23.5, -7, 23.5}, {200, 0, 0}, {0, 0, 200}, 1);
    zeros.plane = {.columns = 500, .rows = 500, .column = {1, 0, 0, 0}, .row = {0, 0, 1, 0}, .samples = std::vector<float>(500 * 500)};
    EmbeddedOptions options;
    options.coordinator.catalogue["block"] = [volume]() -> Result<std::shared_ptr<const Volume>> {
      return std::shared_ptr<const Volume>(volume);
    };
    options.coordinator.catalogue["sheet"] = DataSource([sheet](const TellRead&) { return DataOfShape(sheet); });
    options.coordinator.catalogue["zeros"] = DataSource([zeros](const TellRead&) { return DataOfShape(zeros); });
    service_ = EmbeddedService::Start(context_, std::move(options)).value();
    client_.emplace(service_->Connect().value());
  }

  // A view along +y of a block whose voxels take no light, in the middle.
  Result<PickReply> Pick(const std::vector<ShapeChoice>& shapes, const std::vector<PlaneChoice>& planes = {}) {
    FrameRequest frame = TestRequest(FindRenderer("raycast"), 0);
    frame.dataset = "block";
    frame.view.elevation_degrees = 0;
    frame.transfer.choice = TransferFunction{.colors = {{0, {0, 0, 1}}}, .opacities = {{0, 0}}};
    frame.shapes = shapes;
    frame.planes = planes;
    const RequestId asked =
        client_->Submit(Question(PickQuery{.frame = frame, .x = 0.5 * frame.size.width, .y = 0.5 * frame.size.height}), seconds(60));
    while (const auto event = client_->Next(seconds(60))) {
      if (event->request != asked) continue;
      if (const auto* reply = std::get_if<QuestionReply>(&event->what)) return std::get<PickReply>(*reply);
      return std::get<Status>(event->what);
    }
    return Status::Internal("no answer");
  }

  Context context_;
  std::unique_ptr<EmbeddedService> service_;
  std::optional<Client> client_;
};

TEST_F(PickedShapes, HaveTheirNumberPointAndValue) {
  const Result<PickReply> inside = Pick({{.shape = "zeros", .opacity = 0.3}, {.shape = "sheet"}});
  ASSERT_TRUE(inside.ok()) << inside.status().message();
  ASSERT_TRUE(inside->sample);
  EXPECT_EQ(inside->shape, 1U);
  EXPECT_NEAR(inside->value.value_or(1e9), 0, 1e-4);
  EXPECT_NEAR(inside->sample->at.y, 10.2, 1e-5);
  EXPECT_TRUE(inside->sample->inside);
  EXPECT_EQ(inside->sample->voxel.y, 10);
  EXPECT_EQ(inside->sample->value, 100);

  const Result<PickReply> outside = Pick({{.shape = "zeros"}, {.shape = "sheet"}});
  ASSERT_TRUE(outside.ok()) << outside.status().message();
  ASSERT_TRUE(outside->sample);
  EXPECT_EQ(outside->shape, 0U);
  EXPECT_EQ(outside->value, 0);
  EXPECT_NEAR(outside->sample->at.y, -7, 1e-5);
  EXPECT_FALSE(outside->sample->inside);
  EXPECT_NEAR(inside->depth - outside->depth, 17.2, 1e-4);
}

TEST_F(PickedShapes, PlanesFollowThem) {
  const PlaneChoice plane{.slab = {.normal = {0, 1, 0}, .through = Vec3{23.5, 8, 23.5}}};
  const Result<PickReply> picked = Pick({{.shape = "sheet"}}, {{.slab = plane.slab, .opacity = 0.2}, plane});
  ASSERT_TRUE(picked.ok()) << picked.status().message();
  EXPECT_EQ(picked->shape, 2U);
  EXPECT_EQ(picked->value, 100);
  ASSERT_TRUE(picked->sample);
  EXPECT_NEAR(picked->sample->at.y, 8, 1e-5);
}

TEST_F(PickedShapes, MustBeThereAndShapes) {
  EXPECT_FALSE(Pick({}).value().sample);
  EXPECT_THAT(Pick({{.shape = "block"}}).status().message(), HasSubstr("is a volume"));
  EXPECT_EQ(Pick({{.shape = "nobody"}}).status().code(), StatusCode::kNotFound);
}

}  // namespace
}  // namespace slabstream
