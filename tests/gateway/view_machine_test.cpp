// What a view does when: with events at stated times, and with a page and a service of any speed.
#include "gateway/view_machine.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <utility>

#include "tests/support/random.h"

namespace slabstream {
namespace {

using std::chrono::milliseconds;
using testing::ElementsAre;
using testing::IsEmpty;
using Kind = ViewActionKind;

MATCHER_P(Is, kind, "") { return arg.kind == kind; }

Time At(int ms) { return Time{} + milliseconds(100000 + ms); }

TEST(ViewMachineTest, AViewIsRenderedEncodedSentAndThenStill) {
  ViewMachine machine;
  EXPECT_THAT(machine.OnView(1, false, At(0)), ElementsAre(ViewAction{.kind = Kind::kRender, .seq = 1, .coarseness = kFirstCoarseness}));
  EXPECT_THAT(machine.OnRendered(true, false, At(30)), ElementsAre(ViewAction{.kind = Kind::kEncode, .quality = 92}));
  EXPECT_THAT(machine.OnEncoded(At(35)), ElementsAre(ViewAction{.kind = Kind::kSend, .frame = 1}));
  EXPECT_EQ(machine.wake_time(), At(150));
  EXPECT_THAT(machine.OnAck(1, {}, At(45)), IsEmpty());
  EXPECT_EQ(machine.link().round_trip(), milliseconds(10));
  EXPECT_THAT(machine.OnTime(At(150)),
              ElementsAre(ViewAction{.kind = Kind::kEncode, .coding = PictureCoding::kLossless}));  // the same picture: nothing is rendered
  EXPECT_THAT(machine.OnEncoded(At(200)), ElementsAre(ViewAction{.kind = Kind::kSend, .frame = 2}));
  EXPECT_THAT(machine.OnAck(2, {}, At(230)), IsEmpty());
  EXPECT_EQ(machine.wake_time(), std::nullopt);
}

TEST(ViewMachineTest, TheLatestViewWins) {
  ViewMachine machine;
  machine.OnView(1, false, At(0));
  for (int seq = 2; seq <= 9; ++seq) EXPECT_THAT(machine.OnView(std::uint64_t(seq), false, At(seq)), IsEmpty());
  EXPECT_THAT(machine.OnRendered(true, false, At(30)),
              ElementsAre(Is(Kind::kEncode), ViewAction{.kind = Kind::kRender, .seq = 9, .coarseness = kFirstCoarseness}));
  EXPECT_THAT(machine.OnView(9, false, At(31)), IsEmpty());  // not newer
}

TEST(ViewMachineTest, ALosslessPictureIsGivenUpForANewView) {
  ViewMachine machine;
  machine.OnView(1, false, At(0));
  machine.OnRendered(true, false, At(30));
  machine.OnEncoded(At(31));
  machine.OnAck(1, {}, At(40));
  EXPECT_THAT(machine.OnTime(At(150)), ElementsAre(ViewAction{.kind = Kind::kEncode, .coding = PictureCoding::kLossless}));
  EXPECT_THAT(machine.OnView(2, false, At(160)),
              ElementsAre(Is(Kind::kCancelEncode), ViewAction{.kind = Kind::kRender, .seq = 2, .coarseness = kFirstCoarseness}));
}

TEST(ViewMachineTest, NothingIsSentBeforeTheAcknowledgement) {
  ViewMachine machine;
  machine.OnView(1, false, At(0));
  machine.OnRendered(true, false, At(30));
  machine.OnEncoded(At(31));
  EXPECT_THAT(machine.OnView(2, false, At(40)), ElementsAre(Is(Kind::kRender)));  // no round trip is known yet
  EXPECT_THAT(machine.OnRendered(true, false, At(70)), ElementsAre(Is(Kind::kEncode)));
  EXPECT_THAT(machine.OnEncoded(At(75)), IsEmpty());
  EXPECT_THAT(machine.OnView(3, false, At(80)), IsEmpty());  // it would wait behind the second
  EXPECT_THAT(machine.OnAck(7, {}, At(85)), IsEmpty());      // of no frame that was sent
  EXPECT_THAT(machine.OnAck(1, {}, At(90)), ElementsAre(ViewAction{.kind = Kind::kSend, .frame = 2}));
}

TEST(ViewMachineTest, ItIsUsedByPicturesThatThePageHasDrawn) {
  ViewMachine machine(At(-5));
  machine.OnView(1, false, At(0));  // whoever sends views may show none of them
  machine.OnRendered(true, false, At(30));
  machine.OnAck(1, {}, At(31));  // a picture that was not sent
  EXPECT_EQ(machine.used(), At(-5));
  machine.OnEncoded(At(35));
  machine.OnAck(2, {}, At(36));
  machine.OnEcho(milliseconds(1), At(37));
  EXPECT_EQ(machine.used(), At(-5));
  machine.OnAck(1, {}, At(45));
  EXPECT_EQ(machine.used(), At(45));
  machine.OnAck(1, {}, At(60));  // again
  EXPECT_EQ(machine.used(), At(45));
}

TEST(ViewMachineTest, FarAwayPicturesAreSentBehindOneAnotherAndStayWhole) {
  ViewMachine machine;
  machine.OnEcho(milliseconds(200), At(-500));
  machine.OnView(1, false, At(-500));
  machine.OnRendered(true, false, At(-499));
  machine.OnEncoded(At(-498));
  machine.OnAck(1, {}, At(-288));  // 210 ms
  machine.OnView(2, false, At(-280));
  for (int seq = 2; seq <= 6; ++seq) {
    const int begin = 40 * seq - 320;
    machine.OnView(std::uint64_t(seq) + 1, false, At(begin));
    const auto actions = machine.OnRendered(true, false, At(begin + 1));
    EXPECT_EQ(actions.front(), (ViewAction{.kind = Kind::kEncode, .quality = 92}));
    EXPECT_EQ(actions.back(), (ViewAction{.kind = Kind::kRender, .seq = std::uint64_t(seq) + 1, .coarseness = actions.back().coarseness}));
    EXPECT_THAT(machine.OnEncoded(At(begin + 2)), ElementsAre(ViewAction{.kind = Kind::kSend, .frame = std::uint64_t(seq)}));
  }
  machine.OnAck(2, {}, At(-28));
  EXPECT_EQ(machine.Quality(), 92);
}

// A page that is 100 ms away, to which a picture takes 60 ms more.
class FarAndSlow : public testing::Test {
 protected:
  FarAndSlow() {
    machine.OnEcho(milliseconds(100), At(-1000));
    machine.OnView(1, true, At(-1000));
    machine.OnRendered(true, false, At(-990));
    machine.OnEncoded(At(-980));
    machine.OnAck(1, {}, At(-820));
  }
  ViewMachine machine;
};

TEST_F(FarAndSlow, PicturesThatMoveAreVideo) {
  machine.OnView(2, true, At(0));
  EXPECT_THAT(machine.OnRendered(true, false, At(10)),
              ElementsAre(ViewAction{.kind = Kind::kEncode, .coding = PictureCoding::kVideo, .quality = machine.Quality()}));
  EXPECT_THAT(machine.OnEncoded(At(11)), ElementsAre(Is(Kind::kSend)));
  machine.OnAck(2, {}, At(130));
  EXPECT_THAT(machine.OnTime(At(150)), ElementsAre(ViewAction{.kind = Kind::kEncode, .coding = PictureCoding::kLossless}));
}

TEST_F(FarAndSlow, APageWithoutVideoGetsJpeg) {
  machine.OnView(2, false, At(0));
  EXPECT_EQ(machine.OnRendered(true, false, At(10)).front().coding, PictureCoding::kJpeg);
}

TEST_F(FarAndSlow, AfterAWhileItIsTriedWithoutVideo) {
  machine.OnView(2, true, At(19500));
  EXPECT_EQ(machine.OnRendered(true, false, At(19510)).front().coding, PictureCoding::kJpeg);
}

TEST_F(FarAndSlow, AllVideoThatIsEncodedIsSent) {
  std::uint64_t encoded = 0, sent = 1;
  int now = 0;
  bool encodes = false;
  const auto apply = [&](const ViewMachine::Actions& actions) {
    for (const ViewAction& action : actions) {
      if (action.kind == Kind::kEncode) {
        ASSERT_EQ(action.coding, PictureCoding::kVideo);
        ASSERT_EQ(encoded + 1, sent) << "the one before is lost";
        ++encoded;
        encodes = true;
      }
      if (action.kind == Kind::kSend) sent = action.frame;
    }
  };
  for (std::uint64_t seq = 2; seq < 100; ++seq) {  // the page acknowledges nothing for long
    apply(machine.OnView(seq, true, At(now += 10)));
    apply(machine.OnRendered(true, false, At(now += 10)));
    if (std::exchange(encodes, false)) apply(machine.OnEncoded(At(++now)));
    if (seq % 10 == 0 && sent > 1) apply(machine.OnAck(sent, {}, At(++now)));
    if (machine.wake_time() && *machine.wake_time() <= At(now)) apply(machine.OnTime(At(now)));
  }
  EXPECT_GT(encoded, 10);
}

TEST(ViewMachineTest, NearByASlowPageGetsJpeg) {
  ViewMachine machine;
  machine.OnEcho(milliseconds(1), At(0));
  machine.OnView(1, true, At(0));
  machine.OnRendered(true, false, At(10));
  machine.OnEncoded(At(10));
  machine.OnAck(1, {}, At(110));
  machine.OnView(2, true, At(400));
  EXPECT_EQ(machine.OnRendered(true, false, At(410)).front().coding, PictureCoding::kJpeg);
}

TEST(ViewMachineTest, PicturesAreSmallOnSlowConnectionsUntilTheViewStandsStill) {
  ViewMachine machine;
  machine.OnView(1, false, At(0));
  machine.OnRendered(true, false, At(10));
  machine.OnEncoded(At(10));
  machine.OnAck(1, {}, At(410));  // the lossless picture is being encoded meanwhile
  EXPECT_EQ(machine.Quality(), 50);
  machine.OnTime(At(410));
  const auto actions = machine.OnView(2, false, At(500));
  ASSERT_FALSE(actions.empty());
  EXPECT_EQ(actions.back(), (ViewAction{.kind = Kind::kRender, .seq = 2, .scale = 0.5, .coarseness = kFirstCoarseness / 2}));
  EXPECT_THAT(machine.OnRendered(true, false, At(510)), ElementsAre(Is(Kind::kEncode)));
  EXPECT_THAT(machine.OnEncoded(At(511)), ElementsAre(Is(Kind::kSend)));
  EXPECT_THAT(machine.OnTime(At(650)), ElementsAre(ViewAction{.kind = Kind::kRender, .seq = 2, .scale = 1}));
  EXPECT_THAT(machine.OnRendered(true, false, At(660)), ElementsAre(ViewAction{.kind = Kind::kEncode, .coding = PictureCoding::kLossless}));
  EXPECT_THAT(machine.OnEncoded(At(670)), IsEmpty());
  EXPECT_THAT(machine.OnAck(2, {}, At(900)), ElementsAre(Is(Kind::kSend)));
}

TEST(ViewMachineTest, AFullFrameForTheStillPictureIsCancelled) {
  ViewMachine machine;
  machine.OnView(1, false, At(0));
  machine.OnRendered(true, false, At(10));
  machine.OnEncoded(At(10));
  machine.OnAck(1, {}, At(410));
  machine.OnView(2, false, At(500));
  machine.OnRendered(true, false, At(510));
  machine.OnEncoded(At(511));
  EXPECT_THAT(machine.OnTime(At(650)), ElementsAre(Is(Kind::kRender)));
  EXPECT_THAT(machine.OnView(3, false, At(660)), testing::Contains(Is(Kind::kCancelRender)));
}

TEST(ViewMachineTest, PicturesOfAViewThatStandsStillBecomeFinerUntilTheyAreAsAskedFor) {
  ViewMachine machine;
  const auto render = [](double coarseness) { return ViewAction{.kind = Kind::kRender, .seq = 1, .coarseness = coarseness}; };
  EXPECT_THAT(machine.OnView(1, false, At(0)), ElementsAre(render(4)));
  EXPECT_THAT(machine.OnRendered(false, false, At(100)), ElementsAre(ViewAction{.kind = Kind::kEncode, .quality = 92}));
  machine.OnEncoded(At(101));
  EXPECT_THAT(machine.OnAck(1, {}, At(110)), IsEmpty());
  EXPECT_EQ(machine.wake_time(), At(150));
  EXPECT_THAT(machine.OnTime(At(150)), ElementsAre(render(2)));  // it takes long: there is one between
  EXPECT_THAT(machine.OnRendered(false, false, At(400)), ElementsAre(Is(Kind::kEncode), render(1)));
  EXPECT_THAT(machine.OnEncoded(At(401)), ElementsAre(Is(Kind::kSend)));
  machine.OnAck(2, {}, At(410));
  EXPECT_THAT(machine.OnRendered(true, false, At(900)), ElementsAre(ViewAction{.kind = Kind::kEncode, .coding = PictureCoding::kLossless}));
  EXPECT_THAT(machine.OnEncoded(At(950)), ElementsAre(Is(Kind::kSend)));
  EXPECT_EQ(machine.wake_time(), std::nullopt);
}

TEST(ViewMachineTest, WhatIsRenderedQuicklyIsAsAskedForAtOnce) {
  ViewMachine machine;
  machine.OnView(1, false, At(0));
  machine.OnRendered(false, false, At(10));
  machine.OnEncoded(At(11));
  machine.OnAck(1, {}, At(20));
  EXPECT_THAT(machine.OnTime(At(150)), ElementsAre(ViewAction{.kind = Kind::kRender, .seq = 1}));
  machine.OnRendered(true, false, At(160));
  EXPECT_THAT(machine.OnView(2, false, At(170)), testing::Contains(ViewAction{.kind = Kind::kRender, .seq = 2, .coarseness = 2}));
}

TEST(ViewMachineTest, SlowPicturesBecomeCoarserWhileTheViewMoves) {
  ViewMachine machine;
  machine.OnView(1, false, At(0));
  machine.OnView(2, false, At(10));
  EXPECT_THAT(machine.OnRendered(false, false, At(300)), testing::Contains(ViewAction{.kind = Kind::kRender, .seq = 2, .coarseness = 8}));
  machine.OnEncoded(At(301));
  machine.OnAck(1, {}, At(310));
  EXPECT_THAT(machine.OnRendered(false, false, At(600)),
              ElementsAre(Is(Kind::kEncode), ViewAction{.kind = Kind::kRender, .seq = 2, .coarseness = 4}));
  machine.OnEncoded(At(601));
  machine.OnAck(2, {}, At(610));
  // The finer picture is given up for a new view.
  EXPECT_THAT(machine.OnView(3, false, At(620)), ElementsAre(ViewAction{.kind = Kind::kCancelRender},
                                                             ViewAction{.kind = Kind::kRender, .seq = 3, .coarseness = kMostCoarseness}));
}

class SmallPictures : public testing::Test {
 protected:
  // Of the next view's picture, which takes so long.
  double ScaleOf(int begin, int ms, bool finest = true) {
    const auto actions = machine.OnView(std::uint64_t(begin), false, At(begin));
    const ViewAction render = actions.back();
    EXPECT_EQ(render.kind, Kind::kRender);
    machine.OnRendered(finest, false, At(begin + ms));
    machine.OnEncoded(At(begin + ms + 1));
    machine.OnAck(++frames_, {}, At(begin + ms + 2));
    return render.scale;
  }
  ViewMachine machine;

 private:
  std::uint64_t frames_ = 0;
};

TEST_F(SmallPictures, MoveWhereThereIsNoCoarserLevel) {
  EXPECT_EQ(ScaleOf(1000, 500, false), 1);
  EXPECT_EQ(ScaleOf(2000, 500), 1) << "a coarser level helped";
  EXPECT_EQ(ScaleOf(3000, 130), 0.5);
  EXPECT_EQ(ScaleOf(4000, 60), 0.25);
  EXPECT_EQ(ScaleOf(5000, 20), 0.25);
  EXPECT_EQ(ScaleOf(6000, 60), 0.5) << "larger ones may take four times as long";
  // The view stands still: the whole picture, however long it takes.
  const auto still = machine.OnTime(At(6150));
  ASSERT_THAT(still, ElementsAre(Is(Kind::kRender)));
  EXPECT_EQ(still[0].scale, 1);
}

TEST_F(SmallPictures, DoNotMoveWhereTheyTakeAsLong) {
  EXPECT_EQ(ScaleOf(500, 500), 1);
  EXPECT_EQ(ScaleOf(1200, 500), 1) << "one is no rule";
  EXPECT_EQ(ScaleOf(2000, 450), 0.5);
  EXPECT_EQ(ScaleOf(3000, 500), 1) << "the voxels take the time";
  EXPECT_EQ(ScaleOf(4000, 500), 1);
  EXPECT_EQ(ScaleOf(23000, 500), 1);
  EXPECT_EQ(ScaleOf(24000, 450), 0.5) << "now and then it is tried again";
  EXPECT_EQ(ScaleOf(25000, 500), 1);
}

TEST_F(SmallPictures, DoNotFollowFromReading) {
  machine.OnView(1, false, At(0));
  machine.OnLoading(At(4950));
  machine.OnRendered(true, false, At(5000));
  machine.OnEncoded(At(5001));
  machine.OnAck(1, {}, At(5002));
  EXPECT_EQ(machine.OnView(2, false, At(6000)).back().scale, 1);
}

TEST(ViewMachineTest, SlowShadowsGoWhileTheViewMovesAndComeBack) {
  ViewMachine machine;
  std::uint64_t frames = 0;
  const auto rendered = [&](int begin, int ms) {  // the next view; returns what it rendered
    const auto actions = machine.OnView(std::uint64_t(begin), false, At(begin));
    EXPECT_FALSE(actions.empty());
    const ViewAction render = actions.back();
    EXPECT_EQ(render.kind, Kind::kRender);
    machine.OnRendered(true, true, At(begin + ms));
    machine.OnEncoded(At(begin + ms + 1));
    machine.OnAck(++frames, {}, At(begin + ms + 2));
    return render;
  };
  EXPECT_FALSE(rendered(100, 40).plain);
  EXPECT_FALSE(rendered(200, 60).plain);
  EXPECT_TRUE(rendered(300, 30).plain);
  EXPECT_TRUE(rendered(400, 20).plain) << "with shadows it might take longer than 50 ms";
  EXPECT_FALSE(rendered(500, 60).plain);
  EXPECT_TRUE(rendered(600, 30).plain);
  // The view stands still: the same picture with its shadows, however long it takes.
  EXPECT_THAT(machine.OnTime(At(750)), ElementsAre(ViewAction{.kind = Kind::kRender, .seq = 600}));
  machine.OnRendered(true, true, At(900));
  EXPECT_TRUE(machine.wake_time() == std::nullopt || *machine.wake_time() >= At(900));
}

TEST(ViewMachineTest, PicturesWithoutShadowsAreNotDrawnTwice) {
  ViewMachine machine;
  machine.OnView(1, false, At(0));
  machine.OnRendered(true, false, At(80));
  machine.OnEncoded(At(81));
  machine.OnAck(1, {}, At(90));
  EXPECT_THAT(machine.OnTime(At(150)), ElementsAre(ViewAction{.kind = Kind::kEncode, .coding = PictureCoding::kLossless}));
}

TEST(ViewMachineTest, ARefusedViewIsDoneWith) {
  ViewMachine machine;
  machine.OnView(1, false, At(0));
  EXPECT_THAT(machine.OnRefused(At(1)), IsEmpty());
  EXPECT_EQ(machine.wake_time(), std::nullopt);
  EXPECT_THAT(machine.OnView(2, false, At(2)), ElementsAre(Is(Kind::kRender)));
}

TEST(ViewMachineTest, WhenTheServiceIsBackTheViewIsRendered) {
  ViewMachine machine;
  machine.OnView(1, false, At(0));
  EXPECT_THAT(machine.OnUnavailable(At(10)), IsEmpty());
  EXPECT_THAT(machine.OnView(2, false, At(20)), IsEmpty());
  EXPECT_THAT(machine.OnServiceBack(At(30)), ElementsAre(ViewAction{.kind = Kind::kRender, .seq = 2, .coarseness = kFirstCoarseness}));
  EXPECT_THAT(machine.OnServiceBack(At(31)), IsEmpty());
}

// A page, a service and encoders that take any time: the rules hold, and the last view ends lossless on the screen.
TEST(ViewMachineTest, AnySpeedsEndWithTheLastViewLossless) {
  Random random(71);
  SCOPED_TRACE(random.trace());
  for (int run = 0; run < 300; ++run) {
    ViewMachine machine;
    const int render = random.Integer(1, 300), encode = random.Integer(1, 60), trip = random.Integer(1, 400), views = random.Integer(1, 60);
    const int delay = random.Integer(0, trip);  // of the round trip; the rest is the picture's own time
    if (delay > 0) machine.OnEcho(milliseconds(delay), At(0));
    const int pace = random.Integer(1, 40);
    const double finest_from = double(1 << random.Integer(0, 5));  // coarseness up to which level 0 is drawn
    struct Event {
      enum { kView, kRendered, kEncoded, kAck } kind;
      std::uint64_t number = 0;
    };
    std::multimap<Time, Event> events;
    for (int i = 1; i <= views; ++i) events.emplace(At(i * pace), Event{Event::kView, std::uint64_t(i)});
    std::uint64_t order = 0, encoding = 0, rendering_seq = 0, rendered_seq = 0, encoding_seq = 0, last_sent_seq = 0;
    bool renders = false, encodes = false, encoding_final = false, last_final = false;
    int under_way = 0;
    Time way_free = At(0);
    double coarseness = 0, rendered_coarseness = 0;
    int sent = 0;
    Time now = At(0);
    const auto apply = [&](const ViewMachine::Actions& actions) {
      for (const ViewAction& action : actions) {
        switch (action.kind) {
          case Kind::kRender:
            ASSERT_FALSE(renders);
            ASSERT_GE(action.seq, rendering_seq);
            renders = true;
            rendering_seq = action.seq;
            coarseness = action.coarseness;
            ASSERT_TRUE(coarseness >= 1 && coarseness <= kMostCoarseness);
            events.emplace(now + milliseconds(render), Event{Event::kRendered, ++order});
            break;
          case Kind::kCancelRender:
            ASSERT_TRUE(renders);
            renders = false;
            ++order;
            break;
          case Kind::kEncode:
            ASSERT_FALSE(encodes);
            encodes = true;
            encoding_seq = rendered_seq;
            encoding_final = action.coding == PictureCoding::kLossless;
            if (encoding_final) {
              ASSERT_EQ(rendered_coarseness, 1);
            }
            events.emplace(now + milliseconds(encode), Event{Event::kEncoded, ++encoding});
            break;
          case Kind::kCancelEncode:
            ASSERT_TRUE(encodes && encoding_final);
            encodes = false;
            ++encoding;
            break;
          case Kind::kSend:
            ASSERT_LE(++under_way, 2 + delay / 25);
            ASSERT_GE(encoding_seq, last_sent_seq);
            ++sent;
            last_sent_seq = encoding_seq;
            last_final = encoding_final;
            way_free = std::max(way_free, now) + milliseconds(trip - delay);
            events.emplace(way_free + milliseconds(delay), Event{Event::kAck, action.frame});
            break;
        }
      }
    };
    while (true) {
      const bool timer = machine.wake_time() && (events.empty() || *machine.wake_time() < events.begin()->first);
      if (timer) {
        now = std::max(now, *machine.wake_time());
        apply(machine.OnTime(now));
        continue;
      }
      if (events.empty()) break;
      const auto [time, event] = *events.begin();
      events.erase(events.begin());
      now = time;
      switch (event.kind) {
        case Event::kView: apply(machine.OnView(event.number, false, now)); break;
        case Event::kRendered:
          if (event.number != order || !renders) break;
          renders = false;
          rendered_seq = rendering_seq;
          rendered_coarseness = coarseness <= finest_from ? 1 : coarseness;
          apply(machine.OnRendered(rendered_coarseness == 1, false, now));
          break;
        case Event::kEncoded:
          if (event.number != encoding || !encodes) break;
          encodes = false;
          apply(machine.OnEncoded(now));
          break;
        case Event::kAck:
          --under_way;
          apply(machine.OnAck(event.number, {}, now));
          break;
      }
      ASSERT_FALSE(HasFatalFailure());
    }
    EXPECT_EQ(last_sent_seq, std::uint64_t(views));
    EXPECT_TRUE(last_final);
    EXPECT_LE(sent, views * pace / std::max(1, trip - delay) + 8 + views * pace / std::max(1, render)) << "frames for nothing";
  }
}

}  // namespace
}  // namespace slabstream
