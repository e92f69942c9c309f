#include <algorithm>

#include "laboratory/experiments/paper/printed.h"
#include "laboratory/experiments/paper/setup.h"
#include "laboratory/measure/thread_time.h"
#include "laboratory/measure/transform_loops.h"

namespace slabstream {
namespace {

// No step is a power of two, so sums are rounded.
constexpr TransformMatrix kMatrix = {{{0.7F, -0.4F, 0.2F, 80.0F}, {0.1F, 0.6F, -0.7F, 150.0F}, {0.5F, 0.4F, 0.8F, 10.0F}}};
// Passes of fewer operations are run again and again for one time, since the clock is coarse.
constexpr double kTimedOperations = 2e5;

// The slab of the worker with the most slices.
Index3 SlabOf(int size, int workers) { return {size, size, (size + workers - 1) / workers}; }

Json Key(int size, int workers, const TransformMethod& method) {
  return {{"what", "transform"}, {"N", size}, {"workers", workers}, {"method", method.name}};
}

double SecondsOfPass(const TransformPass& pass, const Index3& slab, TransformedPoints& points) {
  const Operations operations = pass.operations(slab);
  const int times = int(kTimedOperations / std::max(operations.additions + operations.products, 1.0)) + 1;
  return MedianSecondsOf(kRunsOfALoop,
                         [&] {
                           for (int i = 0; i < times; ++i) pass.run(kMatrix, slab, points);
                         }) /
         times;
}

Trial Measure(int size, int workers, const TransformMethod& method) {
  const auto run = [=, &method]() -> Json {
    const Index3 slab = SlabOf(size, workers);
    TransformedPoints points(slab);
    method.Run(kMatrix, slab, points);  // allocates the memory
    Json numbers = {{"seconds", MedianSecondsOf(kRunsOfALoop, [&] { method.Run(kMatrix, slab, points); })}};
    for (const TransformPass& pass : method.passes) numbers[std::string(pass.name)] = SecondsOfPass(pass, slab, points);
    return numbers;
  };
  return {Key(size, workers, method), run, 0.02 + double(size) * size * size / workers * 3e-8};
}

Json Columns(int size, int workers, std::string_view method) {
  return {{"part", "transform"}, {"n", size}, {"workers", workers}, {"variant", method}};
}

void AddPrinted(Results& results) {
  const auto add = [&](int size, int workers, std::string_view method, double seconds) {
    results.Add(Columns(size, workers, method), "run_time", seconds, Origin::kPaper);
  };
  for (std::size_t i = 0; i < printed::kWorkers.size(); ++i) {
    add(printed::kSize, printed::kWorkers[i], "product", printed::kTransformProduct[i]);
    add(printed::kSize, printed::kWorkers[i], "phases", printed::kTransformIncrements[i]);
  }
  for (std::size_t i = 0; i < printed::kCubicSizes.size(); ++i) add(printed::kCubicSizes[i], 15, "phases", printed::kCubicSeconds[i]);
}

}  // namespace

std::vector<Trial> TransformTrials(const PaperSetup& setup) {
  std::vector<Trial> trials;
  for (const int p : setup.workers()) {
    for (const int size : setup.sizes()) trials.push_back(Measure(size, p, FindTransformMethod("phases")));
    for (const TransformMethod& method : TransformMethods()) trials.push_back(Measure(setup.table_size(), p, method));
  }
  return trials;
}

void AddTransform(const PaperSetup& setup, Results& results) {
  const auto add = [&](int size, int p, const TransformMethod& method) {
    const auto of = [&](std::string_view number) { return ValuesOf(setup.context().log(), Key(size, p, method), std::string(number)); };
    Json columns = Columns(size, p, method.name);
    results.Add(columns, "run_time", of("seconds"), Origin::kMeasured);
    for (const TransformPass& pass : method.passes) {
      if (method.passes.size() == 1) break;
      columns["stage"] = pass.name;
      results.Add(columns, "run_time", of(pass.name), Origin::kMeasured);
      const Operations operations = pass.operations(SlabOf(size, p));
      results.Add(columns, "additions", operations.additions, Origin::kMeasured);
      results.Add(columns, "products", operations.products, Origin::kMeasured);
    }
  };
  for (const int p : setup.workers()) {
    for (const TransformMethod& method : TransformMethods()) add(setup.table_size(), p, method);
    for (const int size : setup.sizes()) {
      if (size != setup.table_size()) add(size, p, FindTransformMethod("phases"));
    }
  }
  for (const int size : setup.sizes()) {
    const Index3 volume = SlabOf(size, 1);
    TransformedPoints points(volume);
    for (const TransformMethod& method : TransformMethods()) {
      method.Run(kMatrix, volume, points);
      results.Add(Columns(size, 1, method.name), "offset", LargestOffset(kMatrix, volume, points), Origin::kMeasured);
    }
  }
  AddPrinted(results);
}

}  // namespace slabstream
