// The choice of `auto`, and how good it is. For volumes given on the command line ("sphere1:300" is the paper's class-I sphere with N =
// 300; FILE@PRESET names a transfer function), a view and a number of workers:
//
//   simulated   every box of every candidate's partition is rendered alone on one thread (laboratory/measure); frames are simulated from
//               these costs on the machine that the choice was made for. Prints the fixed policy, the choices of ChoosePolicy before
//               anything is known and once costs are learnt, the best of all candidates, and the time of choosing
//   --service   frames of a turning volume by the embedded service, the fixed policy and `auto` in turn: medians and predictions
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "client/cli/frame_summary.h"
#include "client/client.h"
#include "client/embedded/embedded_service.h"
#include "common/classification/count_occupied.h"
#include "common/combining/schemes.h"
#include "common/decomposition/decomposition.h"
#include "common/planning/assignment.h"
#include "common/planning/measured_cost.h"
#include "common/planning/placement.h"
#include "common/planning/policy_names.h"
#include "common/renderers/registry.h"
#include "common/volume/sphere.h"
#include "common/volume_io/volume_reader.h"
#include "coordinator/tuning/choose_policy.h"
#include "coordinator/tuning/service_machine.h"
#include "laboratory/measure/frame_costs.h"
#include "laboratory/measure/statistics.h"
#include "laboratory/measure/thread_time.h"
#include "simulator/simulate_frames.h"

namespace slabstream {
namespace {

struct Options {
  std::vector<std::string> volumes;
  std::vector<int> workers{16};
  std::string renderer = "splat", link = kDefaultLink;
  bool one_host = false, service = false;
  int repeats = 2, size = 512, frames = 24;
  double azimuth = 30, elevation = 20;
};

struct Subject {
  std::string name;
  std::shared_ptr<const Volume> volume;
  VolumeSummary summary;
  FrameRequest request;
};

Subject Load(const Options& options, std::string text) {
  Subject subject;
  subject.request.transfer.choice = "auto";
  if (const std::size_t at = text.find('@'); at != std::string::npos) {
    subject.request.transfer.choice = text.substr(at + 1);
    text.resize(at);
  }
  subject.name = text.substr(text.rfind('/') + 1);
  if (text.rfind("sphere", 0) == 0) {
    const bool hollow = text[6] == '1';
    const SphereRequest sphere{hollow ? SphereClass::kHollow : SphereClass::kFilled, std::stoi(text.substr(8)), hollow ? 0.05 : 0.4};
    subject.volume = std::make_shared<const Volume>(MakeSphere(sphere).value());
  } else {
    subject.volume = ReadVolume(text).value().volume;
  }
  subject.summary = Summarize(*subject.volume);
  subject.request.dataset = "volume";
  subject.request.renderer = options.renderer;
  subject.request.size = {options.size, options.size};
  subject.request.view = {.azimuth_degrees = options.azimuth, .elevation_degrees = options.elevation};
  return subject;
}

Policy Automatic() {
  Policy policy;
  policy.decomposition = policy.load_metric = policy.assignment = policy.combine = kAutomatic;
  return policy;
}

std::string Text(const Policy& policy) {
  return fmt::format("{} by {}, {} groups, {}, {}", policy.decomposition, LoadMetricOf(policy), policy.groups, policy.assignment,
                     policy.combine);
}

// Frames in virtual time from measured boxes. Each partition's boxes are measured once.
class Truth {
 public:
  Truth(const Options& options, const Subject& subject, const FrameSetup& setup, const OccupancyGrid& grid, const MachineModel& machine,
        int workers)
      : options_(options), subject_(subject), setup_(setup), grid_(grid), machine_(machine), roster_(RosterOf(std::uint32_t(workers))) {
    picture_ = MeasurePictureCost(*subject.volume, setup, options.repeats);
  }

  SimulatedFrame Frame(const Policy& policy, const WorkField* cost = nullptr) {
    FrameRequest request = subject_.request;
    request.policy = policy;
    const auto layout = std::make_shared<const Layout>(LayoutBy(policy, cost));
    const FramePlan plan = PlanFrame(request, 1, subject_.summary, roster_, layout).value();
    const std::vector<BoxCost>& boxes = Measure(*plan.layout);
    FrameInput input{.plan = &plan, .finish_seconds = picture_.finish_seconds, .receive_seconds = picture_.receive_seconds};
    for (const BoxCost& box : boxes) input.boxes.push_back({box.seconds, box.coverage.share.empty() ? nullptr : &box.coverage, 0});
    return SimulateFrames(std::span(&input, 1), machine_, {.keep_spans = false}).value().frames[0];
  }

  std::vector<BoxSeconds> Seconds(const Policy& policy) {
    const Layout layout = LayoutBy(policy, nullptr);
    std::vector<BoxSeconds> seconds;
    const std::vector<BoxCost>& costs = Measure(layout);
    for (std::size_t box = 0; box < costs.size(); ++box) {
      if (layout.owners[box] != kNoSlot) seconds.push_back({costs[box].box, costs[box].seconds});
    }
    return seconds;
  }

 private:
  Layout LayoutBy(const Policy& policy, const WorkField* cost) const {
    FrameRequest request = subject_.request;
    request.policy = policy;
    const ResolvedPolicy resolved = ResolvePolicy(request, subject_.summary.description.geometry).value();
    return MakeLayout({.summary = &subject_.summary,
                       .transfer = &setup_.transfer,
                       .policy = &resolved,
                       .renderer = setup_.renderer,
                       .slots = std::uint32_t(roster_.slots.size()),
                       .known = {.occupied = &grid_, .cost = cost}});
  }
  const std::vector<BoxCost>& Measure(const Layout& layout) {
    const std::vector<Box> key(layout.partition.boxes().begin(), layout.partition.boxes().end());
    const auto [found, fresh] = measured_.try_emplace(key);
    if (!fresh) return found->second;
    std::vector<Box> boxes;
    for (std::size_t box = 0; box < key.size(); ++box) {
      if (layout.owners[box] != kNoSlot) boxes.push_back(key[box]);
    }
    std::vector<BoxCost> costs = MeasureBoxCosts(*subject_.volume, setup_, boxes, options_.repeats);
    found->second.resize(key.size());
    std::size_t next = 0;
    for (std::size_t box = 0; box < key.size(); ++box) {
      if (layout.owners[box] != kNoSlot) found->second[box] = std::move(costs[next++]);
    }
    return found->second;
  }

  const Options& options_;
  const Subject& subject_;
  const FrameSetup& setup_;
  const OccupancyGrid& grid_;
  const MachineModel& machine_;
  Roster roster_;
  PictureCost picture_;
  std::map<std::vector<Box>, std::vector<BoxCost>> measured_;
};

std::vector<HostedWorker> Hosts(const Options& options, int workers) {
  std::vector<HostedWorker> hosts(std::size_t(workers), HostedWorker{.memory_scope = options.one_host ? 1ULL : 0, .threads = 1});
  return hosts;
}

void Simulate(const Options& options, const Subject& subject, int workers) {
  const FrameSetup setup = MakeFrameSetup(subject.request, 1, subject.summary).value();
  const OccupancyGrid grid = CountOccupied(subject.volume->block, setup.renderer->DrawnTable(setup.transfer, subject.summary));
  const MachineModel machine = ServiceMachine(
      Hosts(options, workers), {.link = ParseLink("--link", options.link).value(), .memory_scope = 1, .cores = std::int32_t(workers)});
  Truth truth(options, subject, setup, grid, machine, workers);

  FrameRequest request = subject.request;
  PolicyQuestion question{
      .frame = &request, .summary = &subject.summary, .known = {.occupied = &grid}, .slots = std::uint32_t(workers), .machine = &machine};
  const auto choose = [&](const Policy& policy) {
    request.policy = policy;
    return ChoosePolicy(question).value();
  };
  const auto print = [workers](const char* what, const PolicyChoice& choice, const SimulatedFrame& frame) {
    const double render = frame.imbalance * frame.stage_seconds[std::size_t(Stage::kRender)] / workers;
    fmt::print("  {:22} {:7.2f} ms (render {:6.2f}, imbalance {:5.2f}), predicted {:7.2f} ({:6.2f}, {:5.2f})  {}\n", what,
               frame.latency() * 1e3, render * 1e3, frame.imbalance, choice.prediction->latency_seconds * 1e3,
               choice.prediction->render_seconds * 1e3, choice.prediction->imbalance, Text(AskFor(choice.policy)));
  };
  const PolicyChoice fixed = choose(FixedPolicy(Automatic()));
  const double begin = ThreadSeconds();
  const PolicyChoice chosen = choose(Automatic());
  const double choosing = ThreadSeconds() - begin;
  fmt::print("{}, {}, p = {}: {} candidates in {:.1f} ms\n", subject.name, options.renderer, workers, chosen.predicted, choosing * 1e3);
  print("fixed", fixed, truth.Frame(AskFor(fixed.policy)));
  print("auto", chosen, truth.Frame(AskFor(chosen.policy)));

  MeasuredCost learnt(grid);
  learnt.Learn(truth.Seconds(AskFor(chosen.policy)), 1);
  const WorkField field = learnt.Field();
  question.known.cost = &field;
  question.now = &chosen.policy;
  question.least_gain = 0.1;
  const PolicyChoice revisited = choose(Automatic());
  print("auto, costs known", revisited, truth.Frame(AskFor(revisited.policy), &field));

  std::pair<double, Policy> best{std::numeric_limits<double>::infinity(), {}};
  for (const DecompositionEntry& decomposition : Decompositions()) {
    for (const char* split : {"voxels", "occupied"}) {
      for (const int groups : {1, 2, 4}) {
        for (const AssignmentEntry& assignment : Assignments()) {
          for (const CombiningEntry& scheme : CombiningSchemes()) {
            Policy policy;
            policy.decomposition = decomposition.name;
            policy.load_metric = split;
            policy.groups = groups;
            policy.assignment = assignment.name;
            policy.combine = scheme.name;
            const double seconds = truth.Frame(policy).latency();
            if (seconds < best.first) best = {seconds, policy};
          }
        }
      }
    }
  }
  fmt::print("  {:22} {:7.2f} ms  {}\n", "best of all", best.first * 1e3, Text(best.second));
}

double Median(std::vector<double> values) { return MedianOf(std::move(values)).median; }

void Serve(const Options& options, const Subject& subject, int workers) {
  Context context;
  EmbeddedOptions embedded;
  embedded.workers = workers;
  embedded.worker.threads = 1;
  embedded.coordinator.catalogue["volume"] = [&]() -> Result<std::shared_ptr<const Volume>> { return subject.volume; };
  const auto service = EmbeddedService::Start(context, std::move(embedded));
  Client client = Client::Connect(context, (*service)->endpoint()).value();
  struct Run {
    std::vector<double> latency, predicted, render, predicted_render;
    std::string text;
    double first = 0;
  } runs[2];
  // In turns, so that disturbances of the machine affect both.
  for (int turn = 0; turn < 3; ++turn) {
    for (std::size_t which = 0; which < 2; ++which) {
      FrameRequest request = subject.request;
      request.policy = which == 0 ? FixedPolicy(Automatic()) : Automatic();
      for (int frame = 0; frame < options.frames; ++frame) {
        request.view.azimuth_degrees = 360.0 * frame / options.frames;
        const Picture picture = client.Render(request).value();
        const double seconds = double(picture.latency.count()) * 1e-9;
        Run& run = runs[which];
        if (run.first == 0) run.first = seconds;
        if (turn == 0) continue;
        const FrameStatistics& statistics = picture.statistics;
        run.latency.push_back(seconds);
        run.render.push_back(double(Summarize(statistics).render_ns) * 1e-9);
        if (statistics.predicted) {
          run.predicted.push_back(statistics.predicted->latency_seconds);
          run.predicted_render.push_back(statistics.predicted->render_seconds);
        }
        run.text = fmt::format("{} by {}, {} groups, {}, {}", statistics.decomposition, statistics.load_metric, statistics.groups,
                               statistics.assignment, statistics.combine);
      }
    }
  }
  fmt::print("{}, {}, p = {}, service\n", subject.name, options.renderer, workers);
  for (std::size_t which = 0; which < 2; ++which) {
    const Run& run = runs[which];
    std::vector<double> errors;
    for (std::size_t i = 0; i < run.predicted.size(); ++i) errors.push_back(std::abs(run.predicted[i] / run.latency[i] - 1));
    fmt::print("  {:5} first {:7.2f}, then {:7.2f} ms (render {:7.2f}), predicted {:7.2f} (render {:7.2f}), off by {:4.1f} %  {}\n",
               which == 0 ? "fixed" : "auto", run.first * 1e3, Median(run.latency) * 1e3, Median(run.render) * 1e3,
               Median(run.predicted) * 1e3, Median(run.predicted_render) * 1e3, Median(errors) * 100, run.text);
  }
}

}  // namespace
}  // namespace slabstream

int main(int argc, char** argv) {
  slabstream::Options options;
  CLI::App app("What auto chooses");
  app.add_option("VOLUME", options.volumes, "Files, FILE@PRESET, or sphere1:N and sphere2:N")->required();
  app.add_option("--workers", options.workers)->check(CLI::Range(1, 4096))->delimiter(',');
  app.add_option("--renderer", options.renderer)->check(CLI::IsMember({"splat", "zbuffer"}));
  app.add_option("--link", options.link, "Between workers, each with a host of its own");
  app.add_flag("--one-host", options.one_host, "Workers of one host with a core each instead");
  app.add_flag("--service", options.service, "Measure the embedded service instead of simulating");
  app.add_option("--repeats", options.repeats)->check(CLI::Range(1, 1000));
  app.add_option("--frames", options.frames, "Of a turn, with --service")->check(CLI::Range(1, 1000));
  app.add_option("--size", options.size)->check(CLI::Range(1, 8192));
  app.add_option("--azimuth", options.azimuth);
  app.add_option("--elevation", options.elevation);
  CLI11_PARSE(app, argc, argv);
  for (const std::string& text : options.volumes) {
    const slabstream::Subject subject = slabstream::Load(options, text);
    for (const int workers : options.workers) {
      if (options.service) {
        slabstream::Serve(options, subject, workers);
      } else {
        slabstream::Simulate(options, subject, workers);
      }
    }
  }
  return 0;
}
