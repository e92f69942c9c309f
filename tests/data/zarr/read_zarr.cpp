#include "tests/data/zarr/read_zarr.h"

#include <cstring>
#include <future>

#include "common/base/check.h"
#include "tests/data/zarr/zarr_files.h"

namespace slabstream {

SourceContext TestContext() {
  static const SourceContext context = std::make_shared<ReadContext>(ReadContext::Limits{.decode_threads = 2});
  return context;
}

Result<zarr::ZarrArray> OpenTestArray(const std::shared_ptr<Store>& store, const std::string& path) {
  const Result<std::optional<zarr::ZarrNode>> node = zarr::NodeReading(*store, path).Get();
  if (!node.ok()) return node.status();
  if (!node->has_value() || !(*node)->array) return Status::NotFound("no Zarr array is there");
  return zarr::OpenArray(zarr::MakeArrayContext(store, TestContext()), **node);
}

Result<zarr::ZarrArray> OpenTestArray(const std::string& folder, const std::string& path) {
  return OpenTestArray(FolderStore(folder), path);
}

Result<std::optional<StoredChunk>> ReadChunkNow(ChunkedArray& array, const std::vector<std::uint64_t>& index) {
  std::promise<Result<std::optional<StoredChunk>>> answer;
  array.ReadChunk(index, [&](Result<std::optional<StoredChunk>> chunk) { answer.set_value(std::move(chunk)); });
  return answer.get_future().get();
}

Result<std::vector<double>> ReadElements(const zarr::ZarrArray& array) {
  const ArrayShape& shape = array.array->shape();
  const std::size_t axes = shape.size.size(), element_bytes = BytesPerSample(shape.type);
  std::uint64_t count = 1;
  std::vector<std::uint64_t> chunks, strides(axes);  // of the elements, along the array's axes
  for (std::size_t i = 0; i < axes; ++i) chunks.push_back((shape.size[i] + shape.chunk[i] - 1) / shape.chunk[i]);
  std::vector<std::size_t> place(axes);
  for (std::size_t i = 0; i < axes; ++i) place[array.from[i]] = i;
  for (std::size_t axis = axes; axis-- > 0;) {
    strides[place[axis]] = count;
    count *= shape.size[place[axis]];
  }
  std::vector<double> elements(count);
  Status failed;
  ForEachIndex(chunks, [&](const Counts& index) {
    const auto chunk = ReadChunkNow(*array.array, index);
    if (!chunk.ok()) {
      failed = chunk.status();
      return;
    }
    const std::byte* from = nullptr;
    if (chunk->has_value()) {
      CHECK_EQ((*chunk)->elements.size(), shape.chunk_bytes());
      from = (*chunk)->elements.span().data();
    }
    ForEachIndex(shape.chunk, [&](const Counts& at) {
      const std::byte* const element = from == nullptr ? shape.fill.data() : from;
      if (from != nullptr) from += element_bytes;
      std::uint64_t to = 0;
      for (std::size_t i = 0; i < axes; ++i) {
        const std::uint64_t along = index[i] * shape.chunk[i] + at[i];
        if (along >= shape.size[i]) return;
        to += along * strides[i];
      }
      elements[to] = VisitSampleType(shape.type, [&](const auto* null) {
        std::remove_cvref_t<decltype(*null)> value;
        std::memcpy(&value, element, sizeof value);
        return double(value);
      });
    });
  });
  if (!failed.ok()) return failed;
  return elements;
}

}  // namespace slabstream
