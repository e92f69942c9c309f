// The choice of `auto`, and how good it is, for volumes given on the command line, a view and a number of workers:
//
//   simulated   every box of every candidate's partition is rendered alone on one thread (laboratory/measure); frames are simulated from
//               these costs on the machine that the choice was made for. Prints the fixed policy, the choices of ChoosePolicy before
//               anything is known and once costs are learnt, the best of all candidates, and the time of choosing
//   --service   frames of a turning volume by the embedded service, the fixed policy and `auto` in turn: medians and predictions
#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <map>

#include "bench/program.h"
#include "client/report/frame_summary.h"
#include "common/combining/schemes.h"
#include "common/decomposition/decomposition.h"
#include "common/planning/assignment.h"
#include "common/planning/measured_cost.h"
#include "common/planning/placement.h"
#include "common/planning/policy_names.h"
#include "coordinator/tuning/choose_policy.h"
#include "coordinator/tuning/service_machine.h"
#include "laboratory/measure/frame_costs.h"
#include "laboratory/measure/lab_service.h"
#include "laboratory/measure/statistics.h"
#include "laboratory/measure/thread_time.h"

namespace slabstream {
namespace {

struct Options {
  SubjectOptions subject;
  std::vector<int> workers{16};
  LinkModel link = ParseLink("--link", kDefaultLink).value();
  bool one_host = false, service = false;
  int repeats = 2, frames = 24;
};

Policy Automatic() {
  Policy policy;
  policy.decomposition = policy.balance_by = policy.assignment = policy.combine = kAutomatic;
  return policy;
}

std::string Text(const Policy& policy) {
  return fmt::format("{} by {}, {} groups, {}, {}", policy.decomposition, BalanceByOf(policy), policy.groups, policy.assignment,
                     policy.combine);
}

// Frames in virtual time from measured boxes. Each partition's boxes are measured once.
class Truth {
 public:
  Truth(const Subject& subject, const MachineModel& machine, int workers, int repeats)
      : subject_(subject),
        machine_(machine),
        roster_(RosterOf(std::uint32_t(workers))),
        repeats_(repeats),
        picture_(MeasurePictureCost(*subject.volume, subject.setup, repeats)) {}

  SimulatedFrame Frame(const Policy& policy, const WorkField* cost = nullptr) {
    const FramePlan plan = Plan(policy, cost);
    const FrameInput input = Measure(plan).Input(plan);
    return SimulateFrames(std::span(&input, 1), machine_, {.keep_spans = false}).value().frames[0];
  }

  std::vector<BoxSeconds> Seconds(const Policy& policy) {
    const FramePlan plan = Plan(policy, nullptr);
    const FrameCosts& costs = Measure(plan);
    std::vector<BoxSeconds> seconds;
    for (const Placement& placement : PlacementsOf(plan)) seconds.push_back({placement.box, costs.boxes[placement.id].seconds});
    return seconds;
  }

 private:
  FramePlan Plan(const Policy& policy, const WorkField* cost) const {
    FrameRequest request = subject_.request;
    request.policy = policy;
    const ResolvedRequest resolved = ResolveRequest(request, 1, subject_.summary).value();
    const LayoutRequest layout{.summary = subject_.summary.get(),
                               .volume = &resolved.volume,
                               .policy = &*resolved.policy,
                               .slots = std::uint32_t(roster_.slots.size()),
                               .known = {.occupied = subject_.occupied.get(), .cost = cost}};
    return PlanFrame(subject_.setup, *resolved.policy, roster_, std::make_shared<const Layout>(MakeLayout(layout))).value();
  }
  const FrameCosts& Measure(const FramePlan& plan) {
    const std::span<const Box> boxes = plan.layout->partition.boxes();
    const auto [found, fresh] = measured_.try_emplace({boxes.begin(), boxes.end()});
    FrameCosts& costs = found->second;
    if (!fresh) return costs;
    costs.picture = picture_;
    costs.boxes.resize(boxes.size());
    const std::vector<Placement> placements = PlacementsOf(plan);
    std::vector<BoxCost> measured = MeasureBoxCosts(*subject_.volume, plan, repeats_);
    for (std::size_t i = 0; i < placements.size(); ++i) costs.boxes[placements[i].id] = std::move(measured[i]);
    return costs;
  }

  const Subject& subject_;
  const MachineModel& machine_;
  const Roster roster_;
  const int repeats_;
  const PictureCost picture_;
  std::map<std::vector<Box>, FrameCosts> measured_;
};

void Simulate(const Options& options, const Subject& subject, int workers) {
  const std::vector<HostedWorker> hosts(std::size_t(workers), {.memory_scope = options.one_host ? 1ULL : 0, .threads = 1});
  const MachineModel machine = ServiceMachine(hosts, {.link = options.link, .memory_scope = 1, .cores = std::int32_t(workers)});
  Truth truth(subject, machine, workers, options.repeats);

  const ResolvedRequest resolved = ResolveRequest(subject.request, 1, subject.summary).value();
  PolicyQuestion question{.resolved = &resolved,
                          .setup = &subject.setup,
                          .known = {.occupied = subject.occupied.get()},
                          .slots = std::uint32_t(workers),
                          .machine = &machine};
  const auto choose = [&](const Policy& policy) {
    question.open = &policy;
    return ChoosePolicy(question);
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
  fmt::print("{}, {}, p = {}: {} candidates in {:.1f} ms\n", subject.name, subject.request.renderer, workers, chosen.predicted,
             choosing * 1e3);
  print("fixed", fixed, truth.Frame(AskFor(fixed.policy)));
  print("auto", chosen, truth.Frame(AskFor(chosen.policy)));

  MeasuredCost learnt(*subject.occupied);
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
            const Policy policy{.decomposition = std::string(decomposition.name),
                                .balance_by = split,
                                .groups = groups,
                                .assignment = std::string(assignment.name),
                                .combine = std::string(scheme.name)};
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
  const std::unique_ptr<LabService> service = LabService::Start(workers, {{subject.request.dataset, subject.volume}}).value();
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
        const Picture picture = service->Render(request).value().picture;
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
        run.text = fmt::format("{} by {}, {} groups, {}, {}", statistics.decomposition, statistics.balance_by, statistics.groups,
                               statistics.assignment, statistics.combine);
      }
    }
  }
  fmt::print("{}, {}, p = {}, service\n", subject.name, subject.request.renderer, workers);
  for (std::size_t which = 0; which < 2; ++which) {
    const Run& run = runs[which];
    std::vector<double> errors;
    for (std::size_t i = 0; i < run.predicted.size(); ++i) errors.push_back(std::abs(run.predicted[i] / run.latency[i] - 1));
    fmt::print("  {:5} first {:7.2f}, then {:7.2f} ms (render {:7.2f}), predicted {:7.2f} (render {:7.2f}), off by {:4.1f} %  {}\n",
               which == 0 ? "fixed" : "auto", run.first * 1e3, Median(run.latency) * 1e3, Median(run.render) * 1e3,
               Median(run.predicted) * 1e3, Median(run.predicted_render) * 1e3, Median(errors) * 100, run.text);
  }
}

Status RunAll(const Options& options) {
  for (const std::string& text : options.subject.volumes) {
    const Result<Subject> subject = LoadSubject(options.subject, text);
    if (!subject.ok()) return subject.status();
    for (const int workers : options.workers) (options.service ? Serve : Simulate)(options, *subject, workers);
  }
  return Status::Ok();
}

}  // namespace
}  // namespace slabstream

int main(int argc, char** argv) {
  using namespace slabstream;  // NOLINT(google-build-using-namespace): the program's own
  Options options;
  const BenchProgram app("The choice of `auto`, beside the fixed policy and the best one", "auto_bench");
  AddSubjectOptions(app, options.subject);
  AddList(app, "--workers", options.workers, Integers(1, 4096), "Numbers of workers");
  AddParsed(app, "--link", options.link, ParseLink, "Between workers, each with a host of its own").TypeName("LINK").Default(kDefaultLink);
  app.AddFlag("--one-host", options.one_host, "Workers of one host with a core each instead");
  app.AddFlag("--service", options.service, "Measure the embedded service instead of simulating");
  AddInteger(app, "--repeats", options.repeats, 1, 1000, "Renderings of each box");
  AddInteger(app, "--frames", options.frames, 1, 1000, "Of a turn, with --service");
  return app.Run(argc, argv, [&options] { return RunAll(options); });
}
