// Loops whose calls several threads share: those of the calling thread's TaskArena (task_arena.h), outside of one those of the process. The
// calling thread takes part. A loop returns when all its calls have returned. Calls may run loops of their own; a thread that waits for
// such a loop may take other calls meanwhile, even of the outer loop.
//
// If a call throws, calls that have not begun are left out, and the loop throws the exception when the others have returned.
//
// The library that shares out the work is included by the sources of this folder alone, since its headers take long to compile.
#pragma once

#include <algorithm>
#include <concepts>
#include <cstdint>
#include <optional>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "common/base/function_ref.h"

namespace slabstream {

namespace parallel_internal {

// `index` counts from 0; those of a range are passed together, so a loop over them costs no call each.
using OfRange = FunctionRef<void(std::int64_t begin, std::int64_t end)>;
void ForRanges(std::int64_t begin, std::int64_t end, std::int64_t grain, OfRange of_range);

using OfNumber = FunctionRef<void(std::int64_t number)>;
void InOrder(std::int64_t count, std::int64_t most, OfNumber make, OfNumber use);

}  // namespace parallel_internal

// function(range_begin, range_end) for ranges that together are the indexes [begin, end), each once. A range of at most `grain` >= 1
// indexes is not cut further. Nothing is called if end <= begin.
template <std::integral Begin, std::integral End, class Function>
void ParallelForRanges(Begin begin, End end, std::int64_t grain, Function&& function) {
  using Index = std::common_type_t<Begin, End>;
  parallel_internal::ForRanges(std::int64_t(begin), std::int64_t(end), grain,
                               [&](std::int64_t range_begin, std::int64_t range_end) { function(Index(range_begin), Index(range_end)); });
}

// function(index) for each index of [begin, end). Neighbours often run one after the other on one thread.
template <std::integral Begin, std::integral End, class Function>
void ParallelFor(Begin begin, End end, Function&& function) {
  using Index = std::common_type_t<Begin, End>;
  ParallelForRanges(begin, end, 1, [&](Index range_begin, Index range_end) {
    for (Index index = range_begin; index < range_end; ++index) function(index);
  });
}

// function() once for each thread of the arena: at a time if all are free, otherwise one after the other.
void OnEveryThread(FunctionRef<void()> function);

// use(number, make(number)) for each number of [0, count). make runs in parallel. use runs in the order of the numbers, one call at a time.
// At most `most` >= 1 results of make exist at a time.
template <class Make, class Use>
void ParallelInOrder(std::int64_t count, std::int64_t most, Make&& make, Use&& use) {
  std::vector<std::optional<std::invoke_result_t<Make&, std::int64_t>>> made(std::size_t(std::min(count, most)));
  const auto place = [&](std::int64_t number) -> auto& { return made[std::size_t(number % most)]; };
  parallel_internal::InOrder(
      count, most, [&](std::int64_t number) { place(number).emplace(make(number)); },
      [&](std::int64_t number) {
        use(number, *std::move(place(number)));
        place(number).reset();
      });
}

void ParallelSort(std::span<std::uint64_t> numbers);  // ascending

// The threads that loops of the calling thread may use at most; itself is one of them.
int ThreadsHere();

}  // namespace slabstream
