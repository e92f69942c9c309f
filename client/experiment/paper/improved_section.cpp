#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "client/experiment/machines.h"
#include "client/experiment/paper/printed.h"
#include "client/experiment/paper/setup.h"
#include "client/experiment/plots.h"
#include "client/experiment/policies.h"
#include "client/experiment/report/charts.h"
#include "client/experiment/report/text.h"

namespace slabstream {
namespace {

constexpr int kInFlight = 4, kFrames = 16;
constexpr std::array<const char*, 2> kLinks = {"pvs", "10gbit"};

std::vector<int> Sizes(const PaperSetup& setup) {
  const std::set<int> sizes = {setup.table_size(), setup.large_size()};
  return {sizes.begin(), sizes.end()};
}

std::vector<int> Workers(const PaperSetup& setup) {
  std::vector<int> workers = setup.workers();
  std::erase_if(workers, [](int p) { return p != 1 && p % 10 != 0; });
  return workers;
}

FrameCase With(FrameCase frame, const Policy& policy) {
  frame.policy = policy;
  return frame;
}

// The paper's machine and what it counts, or a cluster of today with everything.
Result<MachineModel> MachineOf(const PaperSetup& setup, RendererKind renderer, std::string_view link) {
  if (link == "pvs") return setup.Machine(renderer);
  return Cluster(setup.context(), Link(link));
}
Result<MeasuredFrame> CostsOf(const PaperSetup& setup, const FrameCase& frame, std::string_view link) {
  Result<MeasuredFrame> measured = Recall(setup.context(), frame);
  if (measured.ok() && link == "pvs") measured->finish_seconds = measured->receive_seconds = 0;
  return measured;
}

// Seconds from picture to picture, of frames asked for ahead.
Result<double> StreamingSeconds(const PaperSetup& setup, const FrameCase& frame, std::string_view link) {
  const Result<MeasuredFrame> measured = CostsOf(setup, frame, link);
  if (!measured.ok()) return measured.status();
  const Result<MachineModel> machine = MachineOf(setup, frame.volume.renderer, link);
  if (!machine.ok()) return machine.status();
  const Result<Timeline> timeline = Simulate(*measured, *machine, kFrames, kInFlight);
  if (!timeline.ok()) return timeline.status();
  return SteadySeconds(*timeline);
}

// Seconds of one frame of which nobody asks for the next before it is there.
Result<double> AloneSeconds(const PaperSetup& setup, const FrameCase& frame, std::string_view link) {
  const Result<MeasuredFrame> measured = CostsOf(setup, frame, link);
  if (!measured.ok()) return measured.status();
  const Result<MachineModel> machine = MachineOf(setup, frame.volume.renderer, link);
  if (!machine.ok()) return machine.status();
  const Result<Timeline> timeline = Simulate(*measured, *machine);
  if (!timeline.ok()) return timeline.status();
  return timeline->frames.front().latency();
}

struct Best {
  std::string policy;
  double seconds = 0;
};
// Of all ways to divide, and the schemes that suit a link.
Result<Best> FindBest(const PaperSetup& setup, const FrameCase& frame, std::string_view link) {
  Best best;
  for (const NamedPolicy& named : AllPartitions()) {
    for (const std::string& scheme : UsualSchemes()) {
      Policy policy = named.policy;
      policy.combine = scheme;
      const Result<double> seconds = StreamingSeconds(setup, With(frame, policy), link);
      if (!seconds.ok()) return seconds.status();
      if (best.policy.empty() || *seconds < best.seconds) best = {named.name + ", " + scheme, *seconds};
    }
  }
  return best;
}

}  // namespace

std::vector<Trial> ImprovedTrials(const PaperSetup& setup) {
  std::vector<Trial> trials;
  for (const RendererKind renderer : {RendererKind::kSplat, RendererKind::kZBuffer}) {
    for (const int size : Sizes(setup)) {
      for (const int p : Workers(setup)) {
        for (const NamedPolicy& named : AllPartitions()) {
          trials.push_back(BoxCostTrial(setup.context(), With(setup.Frame(renderer, size, p), named.policy)));
        }
      }
    }
  }
  return trials;
}

Result<Section> ImprovedSection(const PaperSetup& setup) {
  Table table{"streaming-and-balance",
              "Efficiency with streaming and balance",
              {{"pipeline", ""},
               {"N", ""},
               {"link", ""},
               {"p", ""},
               {"one frame at a time", "%"},
               {"streaming and balanced", "%"},
               {"best policy", ""},
               {"time a frame", "ms"}},
              {}};
  Section section;
  std::string sentence;
  for (const RendererKind renderer : {RendererKind::kSplat, RendererKind::kZBuffer}) {
    const bool splat = renderer == RendererKind::kSplat;
    LineChart chart{fmt::format("{}: efficiency with streaming and balance", splat ? "Splatting" : "Z-buffer"),
                    {"workers p", ""},
                    {"efficiency", "%", AxisScale::kLinear, true},
                    {}};
    for (const int size : Sizes(setup)) {
      for (const char* link : kLinks) {
        LineSeries series{fmt::format("N = {}, {}", size, link), Origin::kSimulated, {}};
        const FrameCase alone = setup.Frame(renderer, size, 1);
        const Result<Best> one = FindBest(setup, alone, link);
        if (!one.ok()) return one.status();
        for (const int p : Workers(setup)) {
          const FrameCase frame = setup.Frame(renderer, size, p);
          const Result<Best> best = FindBest(setup, frame, link);
          if (!best.ok()) return best.status();
          const Result<double> plain = AloneSeconds(setup, frame, link), plain_one = AloneSeconds(setup, alone, link);
          if (!plain.ok()) return plain.status();
          if (!plain_one.ok()) return plain_one.status();
          const double efficiency = 100 * one->seconds / best->seconds / p;
          series.points.push_back({double(p), efficiency});
          table.rows.push_back({std::string(NameOf(renderer)),
                                Cell::Parameter(size),
                                link,
                                Cell::Parameter(p),
                                {100 * *plain_one / *plain / p, Origin::kSimulated},
                                {efficiency, Origin::kSimulated},
                                best->policy,
                                {best->seconds * 1e3, Origin::kSimulated}});
          if (p == Workers(setup).back() && size == setup.large_size()) {
            sentence += fmt::format("{}{} {:.0f} % ({})", sentence.empty() ? "" : ", ", NameOf(renderer), efficiency, link);
          }
        }
        chart.series.push_back(std::move(series));
      }
    }
    LineSeries paper{fmt::format("N = {}, the paper", printed::kSize), Origin::kPaper, {}};
    const auto& times = splat ? printed::kSplattingSeconds : printed::kZBufferSeconds;
    for (std::size_t i = 0; i < times.size(); ++i) {
      paper.points.push_back({double(printed::kStageWorkers[i]), 100 * times[0] / times[i] / printed::kStageWorkers[i]});
    }
    chart.series.push_back(std::move(paper));
    section.blocks.emplace_back(Figure{fmt::format("improved-{}", splat ? "splatting" : "zbuffer"), DrawLines(chart),
                                       "Time from picture to picture of one worker, divided by p times that of p workers."});
  }
  section.blocks.emplace_back(std::move(table));

  // What it looks like, a few frames of it.
  const int p = Workers(setup)[std::min<std::size_t>(1, Workers(setup).size() - 1)];
  const FrameCase shown = setup.Frame(RendererKind::kSplat, setup.large_size(), p);
  const Result<MeasuredFrame> slabs = Recall(setup.context(), shown);
  if (!slabs.ok()) return slabs.status();
  const NamedPolicy balanced = BalancedTree();
  const Result<MeasuredFrame> even = Recall(setup.context(), With(shown, balanced.policy));
  if (!even.ok()) return even.status();
  for (const auto& [name, frame] : {std::pair{std::string("equal slabs"), &*slabs}, {balanced.name, &*even}}) {
    const Result<Timeline> timeline = Simulate(*frame, Cluster(setup.context(), Link("10gbit")), 6, kInFlight, true);
    if (!timeline.ok()) return timeline.status();
    section.blocks.emplace_back(
        TimelineFigure("timeline-" + Slug(name), fmt::format("Three frames on {} workers: {}", p, name), *timeline,
                       timeline->frames[1].received, timeline->frames[4].received,
                       "What each worker's two threads do, and when pixels arrive at it; 10 Gbit/s switched, frames asked for ahead."));
    section.blocks.emplace_back(BoxCostFigure("box-costs-" + Slug(name), fmt::format("Render time by box on {} workers: {}", p, name),
                                              *frame, "Every box rendered alone, on one thread."));
  }

  section.title = "Beyond the paper: streaming and balance";
  section.question = "The paper proposes data streaming, other primitives and load balancing. What do they give?";
  section.method = fmt::format(
      "The same spheres, now with {} frames asked for ahead, so that workers render the next frame while the last one is combined, and "
      "divided so that workers have equal "
      "work. Every partition and the usual combining schemes are tried; the best one is shown and named. Efficiency compares the time from "
      "picture to picture with that "
      "of one worker on the same machine. pvs is the paper's bus scaled to these processors, without what a service does around a frame; "
      "10gbit a switched network with "
      "all of it.",
      kInFlight);
  section.answer = fmt::format("At N = {} and p = {}, efficiency is: {} (the paper at N = 200: splatting 68 %, Z-buffer 20 %).",
                               setup.large_size(), Workers(setup).back(), sentence);
  return section;
}

}  // namespace slabstream
