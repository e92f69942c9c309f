#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <random>

#include "common/base/check.h"
#include "common/cli/add_option.h"
#include "common/combining/schemes.h"
#include "common/kernels/combine.h"
#include "common/parallel/task_arena.h"
#include "common/renderers/registry.h"
#include "laboratory/experiments/experiment.h"
#include "laboratory/experiments/machines.h"
#include "laboratory/experiments/policies.h"
#include "laboratory/measure/thread_time.h"

namespace slabstream {
namespace {

constexpr int kTurns = 3;          // of a trial, after one to warm up
constexpr int kMeasuredMost = 16;  // ranks whose images are kept in memory at a time
constexpr double kSparse = 0.2;
// More than one switch of the fat tree has ports, so that its uplinks matter.
constexpr std::array<int, 2> kRanksOverLinks = {64, 128};

// One combining: p images of side x side pixels, each of which fills `share` of the frame: a rectangle of the frame's shape at a place that
// the seed decides, like the image of a box in a sparse volume.
struct Combining {
  std::string scheme = "fan-in";
  int ranks = 16;
  int side = 1024;
  double share = 1;
  std::string_view link = kLink;  // of simulated ones
};

Json ColumnsOf(const Combining& c) { return {{"workers", c.ranks}, {"pixels", c.side}, {"combine", c.scheme}, {"active", c.share}}; }

Json OperatorsKey(const Combining& c) {
  Json key = {{"what", "operators"}};
  key.update(ColumnsOf(c));
  return key;
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

ScheduleName ScheduleOf(const Combining& c) { return {c.scheme, Rank(c.ranks), {0}}; }

// Fills `part` of an image that has room for the whole frame, and empties the rest.
void Fill(LocalImage& image, const PixelBounds& part) {
  image.rows.assign(std::size_t(image.bounds.height()), {});
  for (std::int32_t y = part.y_begin; y < part.y_end; ++y) {
    image.rows[std::size_t(y)] = {std::uint32_t(part.x_begin), std::uint32_t(part.x_end)};
    const auto first = image.rgba.begin() + 4 * (std::ptrdiff_t(y) * image.bounds.width() + part.x_begin);
    std::fill_n(first, 4 * part.width(), 0.3F);
  }
}

// Runs every step on real images, in sequence, without links. The time of a round is that of the rank with the most work in it.
double RunSchedule(const Schedule& schedule, std::vector<LocalImage>& images, int side) {
  double seconds = 0;
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
    }
    seconds += *std::ranges::max_element(busy);
    first = next;
  }
  return seconds;
}

// Page faults of this thread for which nothing was read.
double MinorFaults() {
  rusage usage{};
  CHECK_EQ(getrusage(RUSAGE_THREAD, &usage), 0);
  return double(usage.ru_minflt);
}

Trial OperatorsTrial(const Combining& c, std::uint64_t seed) {
  const auto run = [=]() -> Json {
    const SharedSchedule schedule = DeriveSchedule(ScheduleOf(c), {0, std::uint64_t(c.side) * std::uint64_t(c.side)}).value();
    const std::vector<PixelBounds> parts = FilledParts(c, seed);
    // Workers keep their memory from frame to frame. So images have room for the frame from the start, the same ones serve all turns, and
    // the first turn, which also allocates messages, is not timed.
    std::vector<LocalImage> images(parts.size(), MakeLocalImage(PixelFormat::kRgba, {0, 0, c.side, c.side}));
    std::vector<double> seconds, faults;
    for (int turn = 0; turn <= kTurns; ++turn) {
      for (std::size_t i = 0; i < parts.size(); ++i) Fill(images[i], parts[i]);
      const double before = MinorFaults();
      seconds.push_back(RunSchedule(schedule->schedule(), images, c.side));
      faults.push_back(MinorFaults() - before);
    }
    return Json{{"seconds", MedianOf({seconds.begin() + 1, seconds.end()}).median},
                {"page_faults", std::accumulate(faults.begin() + 1, faults.end(), 0.0)}};
  };
  const auto on_one_thread = [run] { return TaskArena(1).Run(run); };
  return {OperatorsKey(c), on_one_thread, double(c.side) * c.side * c.share * c.ranks * 2e-6 + 0.05};
}

// Time until the picture is complete at the display worker, if boxes are rendered in no time.
double CombiningSeconds(const Combining& c, std::uint64_t seed, const MachineModel& machine) {
  FramePlan plan;
  VolumeSummary summary;
  summary.description.geometry.size = {8, 8, c.ranks};
  plan.setup.description = summary.description;
  SetRenderer(DefaultRenderer(), plan.setup);
  plan.setup.sheets.width = plan.setup.sheets.height = c.side;
  plan.slots = std::uint32_t(c.ranks);
  plan.display = 1;
  plan.combine = c.scheme;
  GroupPlan& group = plan.groups.emplace_back();
  for (int i = 0; i < c.ranks; ++i) group.placements.push_back({BoxId(i), {{0, 0, i}, {8, 8, i + 1}}, WorkerId(i + 1)});
  group.schedule = ScheduleOf(c);
  std::vector<CoverageMap> coverage;
  for (const PixelBounds& part : FilledParts(c, seed)) {
    coverage.push_back(UniformCoverage(part, double(part.pixel_count()), c.side, c.side));
  }
  FrameInput input{&plan, {}, 0, 0};
  for (const CoverageMap& map : coverage) input.boxes.push_back({0, &map, 0});
  return OrThrow(SimulateFrames(std::span(&input, 1), machine, {1, false})).frames.front().latency();
}

// A part of the page varies one thing, for each scheme.
struct Case {
  std::string_view part;
  Combining combining;
};
struct Cases {
  std::vector<Combining> measured;
  std::vector<Case> simulated;
};
Cases CasesOf(const ExperimentContext& context) {
  const bool quick = context.quick();
  const std::vector<int> measured_ranks = quick ? std::vector{2, 8} : std::vector{2, 4, 8, kMeasuredMost};
  const std::vector<int> ranks = quick ? std::vector{2, 16, 128} : std::vector{2, 4, 8, 16, 32, 64, 128, 256, 512, 1024};
  const std::vector<int> sides = quick ? std::vector{256, 1024} : std::vector{256, 512, 1024, 2048};
  const std::vector<double> shares = quick ? std::vector{0.05, kSparse, 1.0} : std::vector{0.05, 0.1, kSparse, 0.5, 1.0};
  Cases cases;
  const auto simulate = [&](std::string_view part, Combining c) {
    c.side = context.Scaled(c.side);
    cases.simulated.push_back({part, std::move(c)});
  };
  const std::vector<std::string>& chosen = context.options().own.methods;
  for (const std::string& scheme : chosen.empty() ? AllSchemes() : chosen) {
    for (const double share : {1.0, kSparse}) {
      for (const int p : measured_ranks) cases.measured.push_back({scheme, p, context.Scaled(1024), share});
      for (const int p : ranks) simulate("over workers", {.scheme = scheme, .ranks = p, .share = share});
    }
    for (const int side : sides) simulate("over sizes", {.scheme = scheme, .side = side});
    for (const double share : shares) simulate("over active pixels", {.scheme = scheme, .share = share});
    for (const LinkPreset& link : LinkPresets()) {
      for (const int p : kRanksOverLinks) simulate("over links", {.scheme = scheme, .ranks = p, .link = link.name});
    }
  }
  return cases;
}

}  // namespace

void DeclareCombining(const Command& app, OwnOptions& options) {
  static const std::vector<std::string> schemes = AllSchemes();
  AddParsedList(app, "--schemes", options.methods, OneOf({schemes.begin(), schemes.end()}),
                fmt::format("Schemes to compare, as --combine takes them: {} (default: all)", fmt::join(schemes, ", ")));
}

void RunCombining(ExperimentContext& context, Results& results) {
  const Cases cases = CasesOf(context);
  const std::uint64_t seed = context.options().seed;
  std::vector<Trial> trials = {HostTrial()};
  for (const Combining& c : cases.measured) trials.push_back(OperatorsTrial(c, seed));
  context.Run(std::move(trials));

  for (const Combining& c : cases.measured) {
    Json of = ColumnsOf(c);
    of["part"] = of["variant"] = "operators";
    results.Add(of, "run_time", ValuesOf(context.log(), OperatorsKey(c), "seconds"), Origin::kMeasured);
    of["variant"] = "page faults";
    const std::vector<double> faults = ValuesOf(context.log(), OperatorsKey(c), "page_faults");
    results.Add(of, "count", std::accumulate(faults.begin(), faults.end(), 0.0), Origin::kMeasured);
  }
  std::map<std::string, std::vector<double>> simulated;  // parts share cases
  for (const auto& [part, c] : cases.simulated) {
    Json of = ColumnsOf(c);
    of["link"] = c.link;
    const auto [found, fresh] = simulated.try_emplace(of.dump());
    if (fresh) {
      for (MachineModel& machine : Clusters(context, Link(c.link))) {
        machine.plan_seconds = machine.message_seconds = machine.client_seconds = 0;
        found->second.push_back(CombiningSeconds(c, seed, machine));
      }
    }
    of["part"] = part;
    results.Add(of, "combine_time", found->second, Origin::kSimulated);
  }
}

}  // namespace slabstream
