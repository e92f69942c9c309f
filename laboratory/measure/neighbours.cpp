#include "laboratory/measure/neighbours.h"

#include <algorithm>
#include <latch>
#include <thread>
#include <utility>
#include <vector>

#include "laboratory/measure/lab_worker.h"

namespace slabstream {
namespace {

constexpr int kTurns = 15;

}  // namespace

// While both run, each does 1 / (1 + s) of its work per second: the shorter one is done after shorter (1 + s), and the rest of the longer
// one takes longer - shorter.
double SlowdownOf(double first, double second, double both) { return (both - std::max(first, second)) / std::min(first, second); }

Estimate MeasureSlowdown(const Volume& volume, const FrameSetup& setup) {
  if (std::thread::hardware_concurrency() < 2) return {};
  const Box whole = volume.block.box;
  Box halves[2] = {whole, whole};
  halves[0].end.z = halves[1].begin.z = whole.begin.z + whole.size().z / 2;
  LabWorker workers[2] = {LabWorker(volume), LabWorker(volume)};
  const auto render = [&](std::size_t i) { return workers[i].Render(halves[i], setup).processor_seconds; };
  for (const std::size_t i : {0, 1}) render(i);  // normals and classification
  std::vector<double> slowdowns;
  for (int turn = 0; turn < kTurns; ++turn) {
    const double alone[2] = {render(0), render(1)};
    double beside[2] = {0, 0};
    std::latch both(2);
    std::thread other([&] {
      both.arrive_and_wait();
      beside[1] = render(1);
    });
    both.arrive_and_wait();
    beside[0] = render(0);
    other.join();
    // Only the shorter one had a neighbour all the time.
    const std::size_t shorter = alone[0] < alone[1] ? 0 : 1;
    slowdowns.push_back(beside[shorter] / alone[shorter] - 1);
  }
  return MedianOf(std::move(slowdowns));
}

}  // namespace slabstream
