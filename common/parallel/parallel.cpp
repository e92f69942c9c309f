#include "common/parallel/parallel.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_pipeline.h>
#include <tbb/parallel_sort.h>
#include <tbb/task_arena.h>

namespace slabstream {

namespace parallel_internal {

void ForRanges(std::int64_t begin, std::int64_t end, std::int64_t grain, OfRange of_range) {
  if (end <= begin) return;
  using Range = tbb::blocked_range<std::int64_t>;
  tbb::parallel_for(Range(begin, end, std::size_t(grain)), [of_range](const Range& range) { of_range(range.begin(), range.end()); });
}

void InOrder(std::int64_t count, std::int64_t most, OfNumber make, OfNumber use) {
  std::int64_t next = 0;
  const auto take = [&](tbb::flow_control& flow) -> std::int64_t {
    if (next >= count) {
      flow.stop();
      return 0;
    }
    return next++;
  };
  const auto made = [make](std::int64_t number) {
    make(number);
    return number;
  };
  tbb::parallel_pipeline(std::size_t(most), tbb::make_filter<void, std::int64_t>(tbb::filter_mode::serial_in_order, take) &
                                                tbb::make_filter<std::int64_t, std::int64_t>(tbb::filter_mode::parallel, made) &
                                                tbb::make_filter<std::int64_t, void>(tbb::filter_mode::serial_in_order, use));
}

}  // namespace parallel_internal

void OnEveryThread(FunctionRef<void()> function) {
  tbb::parallel_for(
      0, ThreadsHere(), [function](int /*thread*/) { function(); }, tbb::simple_partitioner());
}

void ParallelSort(std::span<std::uint64_t> numbers) { tbb::parallel_sort(numbers.begin(), numbers.end()); }

int ThreadsHere() { return tbb::this_task_arena::max_concurrency(); }

}  // namespace slabstream
