// Whole schedules with images that travel in fewer bits a channel: the picture stays within the bound that the coding states.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "common/combining/travel.h"
#include "common/image/sample_codes.h"
#include "common/kernels/combine.h"
#include "tests/support/random_combining.h"
#include "tests/support/random_image.h"

namespace slabstream {
namespace {

constexpr PixelBounds kFrame = {0, 0, 16, 12};
constexpr PixelRange kWhole = {0, 16 * 12};

Travel Travels(const Schedule& schedule) { return TravelOf(std::make_shared<const IndexedSchedule>(schedule), kWhole); }

// What the root of the schedule ends with.
LocalImage RunSchedule(const Schedule& schedule, const std::vector<LocalImage>& images, ColorCoding coding) {
  struct Held {
    LocalImage image;
    std::vector<Rank> first;  // of each pixel's interval
  };
  std::vector<Held> held;
  for (Rank rank = 0; rank < schedule.ranks; ++rank) held.push_back({images[rank], std::vector<Rank>(kWhole.end, rank)});
  for (const Step& step : schedule.steps) {
    for (std::uint64_t pixel = step.pixels.begin; pixel < step.pixels.end; ++pixel) {  // intervals may differ from pixel to pixel
      const PixelRange one = {pixel, pixel + 1};
      const RunImage sent = EncodeRuns(ViewOf(held[step.from].image, one, kFrame.width()), coding);
      Held& to = held[step.to];
      const Rank first = held[step.from].first[pixel];
      const bool gone = to.first[pixel] == kMaxRanks;
      if (gone) Erase(to.image, one, kFrame.width());
      const Side side = !gone && first < to.first[pixel] ? Side::kFront : Side::kBack;
      EXPECT_EQ(CombineRuns(to.image, sent.header, sent.payload, kFrame, side, kFrame), Status::Ok());
      to.first[pixel] = gone ? first : std::min(first, to.first[pixel]);
      held[step.from].first[pixel] = kMaxRanks;
      Erase(held[step.from].image, one, kFrame.width());
    }
  }
  LocalImage result = std::move(held[schedule.roots.front()].image);
  FillRows(result);
  return result;
}

TEST(CodedCombining, StaysWithinItsBound) {
  Random random(74);
  SCOPED_TRACE(random.trace());
  for (int trial = 0; trial < 150; ++trial) {
    const auto ranks = random.Integer<Rank>(2, 20);
    std::vector<LocalImage> images;
    const double opacity = std::pow(10.0, random.Real(-3, 0));  // thin images pile up
    for (Rank rank = 0; rank < ranks; ++rank) {
      LocalImage image = RandomImage(random, PixelFormat::kRgba, kFrame);
      for (float& value : image.rgba) value *= float(opacity);
      images.push_back(std::move(image));
    }
    const std::string combining = RandomCombining(random);
    const Schedule schedule = MakeSchedule(combining, {ranks, random.Integer<Rank>(0, ranks - 1), kWhole});
    const Travel travel = Travels(schedule);
    const LocalImage exact = RunSchedule(schedule, images, ColorCoding::kFloat32);
    for (const ColorCoding coding : {ColorCoding::kHalf, ColorCoding::kFixed16}) {
      const LocalImage coded = RunSchedule(schedule, images, coding);
      ASSERT_EQ(coded.rgba.size(), exact.rgba.size());
      const double bound = CodingError(coding, travel.hops, travel.transfers);
      for (std::size_t i = 0; i < exact.rgba.size(); ++i) {
        ASSERT_LE(std::abs(coded.rgba[i] - exact.rgba[i]), bound + 2e-6) << combining << ", " << ranks << " ranks, coding " << int(coding);
      }
    }
  }
}

TEST(CodedCombining, TheNearestPixelHasTheSameCodesHoweverItTravels) {
  Random random(76);
  SCOPED_TRACE(random.trace());
  const auto codes_of = [](const LocalImage& image) {
    std::vector<std::uint8_t> codes(image.rgba.size());
    StraightCodes(image.rgba.data(), codes.size() / 4, codes.data());
    return codes;
  };
  for (int trial = 0; trial < 50; ++trial) {
    const auto ranks = random.Integer<Rank>(2, 20);
    std::vector<LocalImage> images;
    for (Rank rank = 0; rank < ranks; ++rank) images.push_back(RandomImage(random, PixelFormat::kDepth, kFrame));
    const std::string combining = RandomCombining(random);
    const Schedule schedule = MakeSchedule(combining, {ranks, random.Integer<Rank>(0, ranks - 1), kWhole});
    EXPECT_EQ(codes_of(RunSchedule(schedule, images, ColorCoding::kStraight8)),
              codes_of(RunSchedule(schedule, images, ColorCoding::kFloat32)))
        << combining << ", " << ranks << " ranks";
  }
}

TEST(Travel, CountsHopsAndTransfers) {
  EXPECT_EQ(Travels(MakeFanIn({1, 0, kWhole})), (Travel{0, 0}));
  EXPECT_EQ(Travels(MakeFanIn({8, 0, kWhole})), (Travel{3, 7}));
  EXPECT_EQ(Travels(MakeCentralized({8, 3, kWhole})), (Travel{1, 7}));
  EXPECT_EQ(Travels(MakeChain({8, 0, kWhole}, 3)), (Travel{7, 7}));
  EXPECT_EQ(Travels(MakeSwap({8, 0, kWhole}, std::vector<std::uint32_t>{8})), (Travel{2, 8}));
}

}  // namespace
}  // namespace slabstream
