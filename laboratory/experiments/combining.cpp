#include <fmt/format.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <random>

#include "common/base/check.h"
#include "common/combining/schemes.h"
#include "common/decomposition/decomposition.h"
#include "common/kernels/combine.h"
#include "laboratory/experiments/experiment.h"
#include "laboratory/experiments/machines.h"
#include "laboratory/experiments/plots.h"
#include "laboratory/experiments/policies.h"
#include "laboratory/measure/thread_time.h"
#include "laboratory/report/charts.h"
#include "laboratory/report/text.h"

namespace slabstream {
namespace {

constexpr int kRepeats = 7, kQuickRepeats = 2;
constexpr int kTurns = 3;          // the fastest counts
constexpr int kMeasuredMost = 16;  // ranks whose images are kept in memory at a time

// One combining: p images of side x side pixels, each of which fills `share` of the frame: a rectangle of the frame's shape at a place that
// the seed decides, like the image of a box in a sparse volume.
struct Combining {
  std::string scheme = "fan-in";
  int ranks = 16;
  int side = 1024;
  double share = 1;
};

Json KeyOf(std::string_view what, const Combining& c) {
  return {{"what", what}, {"scheme", c.scheme}, {"workers", c.ranks}, {"side", c.side}, {"share", c.share}};
}

std::vector<PixelBounds> FilledParts(const Combining& c, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const int side = std::clamp(int(std::lround(std::sqrt(c.share) * c.side)), 1, c.side);
  std::vector<PixelBounds> parts;
  for (int i = 0; i < c.ranks; ++i) {
    const auto x = std::int32_t(random() % std::uint64_t(c.side - side + 1)), y = std::int32_t(random() % std::uint64_t(c.side - side + 1));
    parts.push_back({x, y, x + side, y + side});
  }
  return parts;
}

ScheduleName ScheduleOf(const Combining& c) { return {c.scheme, Rank(c.ranks), 0}; }

// Runs every step on real images, in sequence. The time of a round is that of the rank with the most work in it. Costs of links are left
// out.
struct Computing {
  double seconds = 0, bytes = 0;
};
Computing RunSchedule(const Schedule& schedule, std::vector<LocalImage>& images, int side) {
  Computing computing;
  for (std::size_t first = 0; first < schedule.steps.size();) {
    std::vector<double> busy(images.size());
    std::size_t next = first;
    for (; next < schedule.steps.size() && schedule.steps[next].round == schedule.steps[first].round; ++next) {
      const Step& step = schedule.steps[next];
      const double begin = ThreadSeconds();
      const RunImage message = EncodeRuns(images[step.from], step.pixels, side);
      const double encoded = ThreadSeconds();
      if (message.header.pixel_count > 0) {
        const PixelBounds frame = {0, 0, side, side};
        const Side lies = step.from > step.to ? Side::kBack : Side::kFront;
        CHECK(CombineRuns(images[step.to], message.header, message.payload, frame, lies, frame).ok());
      }
      busy[step.from] += encoded - begin;
      busy[step.to] += ThreadSeconds() - encoded;
      computing.bytes += double(message.payload.size());
    }
    computing.seconds += *std::ranges::max_element(busy);
    first = next;
  }
  return computing;
}

Trial MeasureOperators(const Combining& c, std::uint64_t seed) {
  const auto run = [=]() -> Json {
    const SharedSchedule schedule = DeriveSchedule(ScheduleOf(c), {0, std::uint64_t(c.side) * std::uint64_t(c.side)}).value();
    tbb::task_arena one_thread(1);
    Computing computing{.seconds = std::numeric_limits<double>::infinity()};
    // The first turn allocates memory, which workers keep from frame to frame.
    for (int turn = 0; turn < kTurns; ++turn) {
      std::vector<LocalImage> images;
      for (const PixelBounds& part : FilledParts(c, seed)) {
        images.push_back(MakeLocalImage(PixelFormat::kRgba, part));
        std::ranges::fill(images.back().rgba, 0.3F);
      }
      const Computing one = one_thread.execute([&] { return RunSchedule(schedule->schedule(), images, c.side); });
      if (one.seconds < computing.seconds) computing = one;
    }
    return Json{{"seconds", computing.seconds}, {"bytes", computing.bytes}};
  };
  return {KeyOf("operators", c), run, double(c.side) * c.side * c.share * c.ranks * 2e-6 + 0.05};
}

// Time until the picture is complete at the display worker, on a machine of this link, if boxes are rendered in no time.
double CombiningSeconds(const ExperimentContext& context, const Combining& c, const LinkModel& link) {
  FramePlan plan;
  const Index3 size = {8, 8, c.ranks};
  VolumeSummary summary;
  summary.description.geometry.size = size;
  plan.setup.description = summary.description;
  plan.setup.sheets.width = plan.setup.sheets.height = c.side;
  plan.slots = std::uint32_t(c.ranks);
  plan.display = 1;
  plan.combine = c.scheme;
  GroupPlan& group = plan.groups.emplace_back();
  for (int i = 0; i < c.ranks; ++i) group.placements.push_back({BoxId(i), {{0, 0, i}, {8, 8, i + 1}}, WorkerId(i + 1)});
  group.schedule = ScheduleOf(c);
  std::vector<CoverageMap> coverage;
  for (const PixelBounds& part : FilledParts(c, context.options().seed)) {
    coverage.push_back(UniformCoverage(part, double(part.pixel_count()), c.side, c.side));
  }
  FrameInput input{&plan, {}, 0, 0};
  for (const CoverageMap& map : coverage) input.boxes.push_back({0, &map, 0});
  MachineModel machine = Cluster(context, link);
  machine.plan_seconds = machine.message_seconds = machine.client_seconds = 0;
  return OrThrow(SimulateFrames(std::span(&input, 1), machine, {1, false})).frames.front().latency();
}

Trial SimulateCombining(const ExperimentContext& context, const Combining& c, const LinkPreset& link) {
  Json key = KeyOf("combining", c);
  key["link"] = link.name;
  const auto run = [&context, c, link = link.link] { return Json{{"seconds", CombiningSeconds(context, c, link)}}; };
  return {std::move(key), run, 0.02 + 1e-4 * c.ranks, false};
}

// One variable at a time.
struct Sweeps {
  std::vector<int> measured_ranks, ranks, sides;
  std::vector<double> shares;
  int ranks_at = 16, side_at = 1024;
  double sparse = 0.2;
  std::string_view link = "10gbit";
};
Sweeps SweepsOf(const ExperimentContext& context) {
  Sweeps sweeps;
  if (context.quick()) {
    sweeps.measured_ranks = {2, 8};
    sweeps.ranks = {2, 8, 32, 128};
    sweeps.sides = {256, 1024};
    sweeps.shares = {0.05, 0.2, 1};
  } else {
    sweeps.measured_ranks = {2, 4, 8, kMeasuredMost};
    sweeps.ranks = {2, 4, 8, 16, 32, 64, 128, 256, 512, 1024};
    sweeps.sides = {256, 512, 1024, 2048};
    sweeps.shares = {0.05, 0.1, 0.2, 0.5, 1};
  }
  sweeps.side_at = context.Scaled(sweeps.side_at);
  for (int& side : sweeps.sides) side = context.Scaled(side);
  return sweeps;
}

class CombiningReport {
 public:
  CombiningReport(ExperimentContext& context, const Sweeps& sweeps) : context_(context), sweeps_(sweeps) {}

  Section Operators() {
    Table table = NewTable("operators", "What combining computes, without links");
    LineChart chart{fmt::format("Computing, {0} x {0} pixels", sweeps_.side_at), WorkersAxis(), {"time", "ms", AxisScale::kLog}, {}};
    double full = 0, sparse = 0;
    for (const std::string& scheme : AllSchemes()) {
      LineSeries series{scheme, Origin::kMeasured, {}};
      for (const double share : {1.0, sweeps_.sparse}) {
        for (const int ranks : sweeps_.measured_ranks) {
          const Combining c{scheme, ranks, sweeps_.side_at, share};
          const Estimate e = EstimateOf(context_.log(), KeyOf("operators", c), "seconds").Times(1e3);
          table.rows.push_back({scheme, Chosen(ranks), Chosen(c.side), Chosen(share * 100), "none", Measured(e)});
          if (share == 1) series.points.push_back({double(ranks), e.median, e.low, e.high});
          if (scheme == "fan-in" && ranks == sweeps_.measured_ranks.back()) (share == 1 ? full : sparse) = e.median;
        }
      }
      chart.series.push_back(std::move(series));
    }
    Section section;
    section.title = "What combining computes";
    section.question = "Images without a link between them: what do the operators alone take, along each schedule's critical path?";
    section.method =
        "Every step of a schedule on real images in this process, on one thread; the time of a round is that of its busiest worker. "
        "Encoding belongs to who sends, combining to who receives.";
    section.answer = fmt::format(
        "At p = {}, the tree computes {:.2f} ms on full images and {:.2f} ms where {:.0f} % of the pixels are active: {:.1f} times less.",
        sweeps_.measured_ranks.back(), full, sparse, sweeps_.sparse * 100, sparse > 0 ? full / sparse : 0);
    section.blocks = {Figure{"operators", DrawLines(chart), "Full images. Both axes logarithmic."}, std::move(table)};
    return section;
  }

  Section OverWorkers() {
    Table table = NewTable("over-workers", "Combining over workers");
    Section section;
    for (const double share : {1.0, sweeps_.sparse}) {
      LineChart chart{fmt::format("{0} x {0} pixels, {1:.0f} % active, {2}", sweeps_.side_at, share * 100, sweeps_.link),
                      WorkersAxis(),
                      {"time", "ms", AxisScale::kLog},
                      {}};
      for (const std::string& scheme : AllSchemes()) {
        LineSeries series{scheme, Origin::kSimulated, {}};
        for (const int ranks : sweeps_.ranks)
          series.points.push_back({double(ranks), Add(table, {scheme, ranks, sweeps_.side_at, share}, sweeps_.link)});
        chart.series.push_back(std::move(series));
      }
      section.blocks.emplace_back(Figure{fmt::format("over-workers-{}", share == 1 ? "full" : "sparse"), DrawLines(chart),
                                         "Until the image is complete at one worker."});
    }
    section.title = "Over workers";
    section.question = "Which scheme suits how many workers?";
    section.method = Method();
    const auto best = [&](int ranks, double share) {
      std::pair<double, std::string> least{std::numeric_limits<double>::infinity(), ""};
      for (const std::string& scheme : AllSchemes())
        least = std::min(least, {Milliseconds({scheme, ranks, sweeps_.side_at, share}, sweeps_.link), scheme});
      return least;
    };
    const auto few = best(sweeps_.ranks.front(), 1), many = best(sweeps_.ranks.back(), 1),
               many_sparse = best(sweeps_.ranks.back(), sweeps_.sparse);
    section.answer = fmt::format(
        "On full images {} is fastest at p = {} ({:.1f} ms) and {} at p = {} ({:.1f} ms); where {:.0f} % are active, {} at p = {} ({:.1f} "
        "ms).",
        few.second, sweeps_.ranks.front(), few.first, many.second, sweeps_.ranks.back(), many.first, sweeps_.sparse * 100,
        many_sparse.second, sweeps_.ranks.back(), many_sparse.first);
    section.blocks.emplace_back(std::move(table));
    return section;
  }

  Section OverPictures() {
    Table table = NewTable("over-pictures", "Combining over picture sizes and active pixels");
    LineChart by_side{fmt::format("Over picture sizes, p = {}, {}", sweeps_.ranks_at, sweeps_.link),
                      {"side of the picture", "pixels", AxisScale::kLog},
                      {"time", "ms", AxisScale::kLog},
                      {}};
    LineChart by_share{fmt::format("Over active pixels, p = {}, {}", sweeps_.ranks_at, sweeps_.link),
                       {"active pixels of each image", "%"},
                       {"time", "ms", AxisScale::kLinear, true},
                       {}};
    for (const std::string& scheme : AllSchemes()) {
      LineSeries sides{scheme, Origin::kSimulated, {}};
      LineSeries shares = sides;
      for (const int side : sweeps_.sides)
        sides.points.push_back({double(side), Add(table, {scheme, sweeps_.ranks_at, side, 1}, sweeps_.link)});
      for (const double share : sweeps_.shares)
        shares.points.push_back({share * 100, Add(table, {scheme, sweeps_.ranks_at, sweeps_.side_at, share}, sweeps_.link)});
      by_side.series.push_back(std::move(sides));
      by_share.series.push_back(std::move(shares));
    }
    Section section;
    section.title = "Over pictures";
    section.question = "How does combining grow with the picture and with what images fill of it?";
    section.method = Method();
    const double full = Milliseconds({"fan-in", sweeps_.ranks_at, sweeps_.side_at, 1}, sweeps_.link),
                 sparse = Milliseconds({"fan-in", sweeps_.ranks_at, sweeps_.side_at, sweeps_.sparse}, sweeps_.link);
    section.answer = fmt::format("With {:.0f} % active pixels the tree takes {:.1f} ms instead of {:.1f} ms: {:.1f} times less.",
                                 sweeps_.sparse * 100, sparse, full, full / sparse);
    section.blocks = {Figure{"over-sides", DrawLines(by_side), "Full images."},
                      Figure{"over-active-pixels", DrawLines(by_share), "Each image fills a square somewhere in the frame."},
                      std::move(table)};
    return section;
  }

  Section OverLinks() {
    Table table = NewTable("over-links", "Combining over links");
    BarChart chart{fmt::format("Over links, p = {0}, {1} x {1} pixels, all active", sweeps_.ranks_at, sweeps_.side_at),
                   "link",
                   {"time / that of the link's fastest scheme", ""},
                   {},
                   {}};
    std::string sentence;
    for (const LinkPreset& link : LinkPresets()) {
      BarGroup group{std::string(link.name), {}};
      std::pair<double, std::string> least{std::numeric_limits<double>::infinity(), ""};
      for (const std::string& scheme : AllSchemes()) {
        const double ms = Add(table, {scheme, sweeps_.ranks_at, sweeps_.side_at, 1}, link.name);
        group.bars.push_back({scheme, Origin::kSimulated, {ms}});
        least = std::min(least, {ms, scheme});
      }
      for (Bar& bar : group.bars) bar.parts[0] /= least.first;
      sentence += fmt::format("{}{}: {} ({:.1f} ms)", sentence.empty() ? "" : ", ", link.name, least.second, least.first);
      chart.groups.push_back(std::move(group));
    }
    Section section;
    section.title = "Over links";
    section.question = "Which scheme suits which link?";
    section.method = Method();
    section.answer = "Fastest on " + sentence + ".";
    section.blocks = {
        Figure{"over-links", DrawBars(chart), "Full images. 1: the fastest scheme of a link; times in ms stand in the table."},
        std::move(table)};
    return section;
  }

 private:
  static Table NewTable(const std::string& name, const std::string& title) {
    return {name, title, {"scheme", "p", "side (pixels)", "active (%)", "link", "time (ms)"}, {}};
  }
  static std::string Method() {
    return "Schedules in virtual time on machines of this one's speed (its operators are measured in this run), all images ready at once, "
           "until the combined one "
           "lies at one worker. Empty pixels do not travel; pixels are 16 bytes.";
  }

  double Milliseconds(const Combining& c, std::string_view link) const {
    Json key = KeyOf("combining", c);
    key["link"] = link;
    return EstimateOf(context_.log(), key, "seconds").median * 1e3;
  }
  double Add(Table& table, const Combining& c, std::string_view link) const {
    const double ms = Milliseconds(c, link);
    table.rows.push_back({c.scheme, Chosen(c.ranks), Chosen(c.side), Chosen(c.share * 100), std::string(link), Simulated(ms)});
    return ms;
  }

  ExperimentContext& context_;
  const Sweeps& sweeps_;
};

}  // namespace

Report RunCombining(ExperimentContext& context) {
  const Sweeps sweeps = SweepsOf(context);
  std::vector<Trial> measured = {HostTrial()}, simulated;
  for (const std::string& scheme : AllSchemes()) {
    for (const int ranks : sweeps.measured_ranks) {
      for (const double share : {1.0, sweeps.sparse})
        measured.push_back(MeasureOperators({scheme, ranks, sweeps.side_at, share}, context.options().seed));
    }
    for (const LinkPreset& link : LinkPresets()) {
      const auto add = [&](int ranks, int side, double share) {
        simulated.push_back(SimulateCombining(context, {scheme, ranks, side, share}, link));
      };
      add(sweeps.ranks_at, sweeps.side_at, 1);
      if (link.name != sweeps.link) continue;
      for (const double share : {1.0, sweeps.sparse}) {
        for (const int ranks : sweeps.ranks) add(ranks, sweeps.side_at, share);
      }
      for (const int side : sweeps.sides) add(sweeps.ranks_at, side, 1);
      for (const double share : sweeps.shares) add(sweeps.ranks_at, sweeps.side_at, share);
      add(sweeps.ranks_at, sweeps.side_at, sweeps.sparse);
    }
  }
  // Simulations need the measurements.
  context.Run(std::move(measured), kRepeats, kQuickRepeats);
  context.Run(std::move(simulated), kRepeats, kQuickRepeats);

  CombiningReport sections(context, sweeps);
  Report report;
  report.title = "Combining schemes compared";
  report.summary =
      "Each worker has rendered its part; how do these images become one? Every scheme of Slabstream over workers, picture sizes, active "
      "pixels and links.";
  report.sections = {sections.Operators(), sections.OverWorkers(), sections.OverPictures(), sections.OverLinks()};
  return report;
}

}  // namespace slabstream
