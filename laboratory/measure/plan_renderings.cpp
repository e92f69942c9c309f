#include "laboratory/measure/plan_renderings.h"

#include <algorithm>
#include <future>
#include <span>

#include "common/base/time.h"
#include "common/threads/task_thread.h"
#include "laboratory/measure/lab_worker.h"

namespace slabstream {
namespace {

struct Rendered {
  Time begin, end;
  std::vector<double> seconds;  // of each box
};

}  // namespace

// While both run, each does 1 / (1 + s) of its work per second: the shorter one is done after shorter (1 + s), and the rest of the longer
// one takes longer - shorter.
double SlowdownOf(double first, double second, double both) { return (both - std::max(first, second)) / std::min(first, second); }

class PlanRenderings::Worker {
 public:
  explicit Worker(const Volume& volume) : renderer_(volume) {}

  // `boxes` and `setup` must live until the result is there.
  std::future<Rendered> Render(std::span<const Box> boxes, const FrameSetup& setup) {
    auto done = std::make_shared<std::promise<Rendered>>();
    std::future<Rendered> rendered = done->get_future();
    orders_.Post([this, boxes, &setup, done] {
      renders_.Post([this, boxes, &setup, done] {
        Rendered result{.begin = MonotonicNow()};
        for (const Box& box : boxes) result.seconds.push_back(renderer_.Render(box, setup).seconds);
        result.end = MonotonicNow();
        done->set_value(std::move(result));
      });
    });
    return rendered;
  }

 private:
  LabWorker renderer_;
  TaskThread renders_, orders_;  // in this order: `orders_` ends first
};

PlanRenderings::PlanRenderings(const Volume& volume, int workers) {
  for (int i = 0; i < workers; ++i) workers_.push_back(std::make_unique<Worker>(volume));
}

PlanRenderings::~PlanRenderings() = default;

PlanSeconds PlanRenderings::Measure(const FramePlan& plan) {
  PlanSeconds seconds;
  seconds.boxes.resize(plan.layout->partition.boxes().size());
  std::vector<std::vector<Box>> boxes(workers_.size());
  std::vector<double> alone(workers_.size());
  const std::vector<Placement> placements = PlacementsOf(plan);
  for (const Placement& placement : placements) boxes[placement.worker - 1].push_back(placement.box);
  for (std::size_t worker = 0; worker < workers_.size(); ++worker) {
    const Rendered rendered = workers_[worker]->Render(boxes[worker], plan.setup).get();
    std::size_t next = 0;
    for (const Placement& placement : placements) {
      if (placement.worker != worker + 1) continue;
      alone[worker] += rendered.seconds[next];
      seconds.boxes[placement.id] = rendered.seconds[next++];
    }
  }
  if (workers_.size() != 2 || *std::ranges::min_element(alone) <= 0) return seconds;
  std::future<Rendered> first = workers_[0]->Render(boxes[0], plan.setup), second = workers_[1]->Render(boxes[1], plan.setup);
  const Rendered a = first.get(), b = second.get();
  const double both = double((std::max(a.end, b.end) - std::min(a.begin, b.begin)).count()) * 1e-9;
  seconds.slowdown = SlowdownOf(alone[0], alone[1], both);
  return seconds;
}

}  // namespace slabstream
