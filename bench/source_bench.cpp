// What it costs to make boxes of voxels of chunks: a volume of 512^3 samples in chunks of 64^3, which are in memory already, so nothing is
// read or decoded. Beside it: memcpy of as many bytes, by as many threads.
#include <benchmark/benchmark.h>

#include <cstring>
#include <future>
#include <memory>
#include <thread>
#include <vector>

#include "data/sources/chunked_source.h"

namespace slabstream {
namespace {

constexpr std::uint64_t kSide = 512, kChunk = 64;

// All its chunks have the same bytes, but each in memory of its own.
class ReadyChunks : public ChunkedArray {
 public:
  ReadyChunks(SampleType type, SourceContext context)
      : shape_{.size = {kSide, kSide, kSide},
               .chunk = {kChunk, kChunk, kChunk},
               .type = type,
               .fill = std::vector<std::byte>(BytesPerSample(type))},
        context_(std::move(context)) {
    const std::size_t count = (kSide / kChunk) * (kSide / kChunk) * (kSide / kChunk);
    for (std::size_t i = 0; i < count; ++i) chunks_.emplace_back(std::vector<std::byte>(shape_.chunk_bytes(), std::byte{3}));
  }

  const ArrayShape& shape() const override { return shape_; }

  void ReadChunk(std::span<const std::uint64_t> index, ChunkDone done, StillWanted /*wanted*/) override {
    constexpr std::uint64_t kCount = kSide / kChunk;
    const Bytes& chunk = chunks_[(index[0] * kCount + index[1]) * kCount + index[2]];
    context_->PostDecode([&chunk, done = std::move(done)] { done(std::optional(StoredChunk{chunk, chunk.size()})); });
  }

 private:
  const ArrayShape shape_;
  const SourceContext context_;
  std::vector<Bytes> chunks_;
};

// Arguments: the axis of the array that is x; the number of a sample type.
void ReadVolume(benchmark::State& state) {
  const auto context = std::make_shared<ReadContext>(ReadContext::Limits{});
  const auto type = SampleType(state.range(1));
  const std::array<int, 3> axes = state.range(0) == 2   ? std::array{2, 1, 0}
                                  : state.range(0) == 1 ? std::array{1, 2, 0}
                                                        : std::array{0, 1, 2};
  const auto source = *MakeChunkedSource(
      "ready", {.levels = {{.array = std::make_shared<ReadyChunks>(type, context), .axes = axes, .at = {0, 0, 0}}}}, context);
  const SourceLevel& level = source->info().levels[0];
  std::vector<std::byte> out(std::size_t(level.description.voxel_bytes()));
  for (auto _ : state) {
    const Status status = source->ReadNow(0, level.description.geometry.bounds(), out);
    if (!status.ok()) state.SkipWithError(status.message().c_str());
  }
  state.SetBytesProcessed(std::int64_t(state.iterations()) * std::int64_t(out.size()));
}
BENCHMARK(ReadVolume)
    ->ArgNames({"x", "type"})
    ->Args({2, int(SampleType::kUint16)})
    ->Args({1, int(SampleType::kUint16)})
    ->Args({0, int(SampleType::kUint16)})
    ->Args({2, int(SampleType::kInt16)})
    ->Args({2, int(SampleType::kUint8)})
    ->Args({0, int(SampleType::kUint8)})
    ->Args({2, int(SampleType::kFloat32)})
    ->Args({2, int(SampleType::kFloat64)})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

void CopyMemory(benchmark::State& state) {
  const std::size_t bytes = 2 * kSide * kSide * kSide, threads = std::max(1U, std::thread::hardware_concurrency());
  const std::vector<std::byte> from(bytes, std::byte{3});
  std::vector<std::byte> to(bytes);
  for (auto _ : state) {
    std::vector<std::future<void>> parts;
    for (std::size_t t = 0; t < threads; ++t) {
      const std::size_t begin = bytes * t / threads, end = bytes * (t + 1) / threads;
      parts.push_back(
          std::async(std::launch::async, [&, begin, end] { std::memcpy(to.data() + begin, from.data() + begin, end - begin); }));
    }
  }
  state.SetBytesProcessed(std::int64_t(state.iterations()) * std::int64_t(bytes));
}
BENCHMARK(CopyMemory)->UseRealTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace slabstream
