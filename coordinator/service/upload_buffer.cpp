#include "coordinator/service/upload_buffer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <utility>

#include "common/base/check.h"
#include "common/volume/memory_budget.h"
#include "data/catalogue/client_file.h"
#include "data/layers/color_table.h"

namespace slabstream {
namespace {

LabelTable TableOf(const std::vector<NewLabel>& labels) {
  LabelTable table;
  for (const NewLabel& label : labels) table.labels.push_back({label.value, label.color.value_or(StandardColor(label.value)), label.name});
  return table;
}

}  // namespace

Result<std::shared_ptr<UploadBuffer>> UploadBuffer::Make(const AddVolume& order) {
  if (Status fits = CheckFitsMemory(std::int64_t(BytesToSend(order)), "dataset \"" + order.name + "\""); !fits.ok()) return fits;
  std::shared_ptr<UploadBuffer> buffer(new UploadBuffer(order));
  if (order.file) {
    buffer->file_.resize(order.file->bytes);
    return buffer;
  }
  const SampleTypes types(order.description.type, order.layers);
  for (const Layer layer : kLayers) {
    const std::optional<ScalarType> type = types.Of(layer);
    if (!type) continue;
    VolumeDescription description = order.description;
    description.type = *type;
    if (layer != Layer::kVolume) description.mapping = {};
    buffer->parts_[std::size_t(layer)] =
        std::make_shared<Volume>(Volume{description, MakeVoxelBlock(description.geometry.bounds(), *type)});
  }
  return buffer;
}

void UploadBuffer::Store(std::uint64_t begin, std::span<const std::byte> bytes) {
  if (order_.file) {
    CHECK(begin + bytes.size() <= file_.size());
    std::ranges::copy(bytes, file_.begin() + std::ptrdiff_t(begin));
    return;
  }
  std::uint64_t part_begin = 0;
  for (const std::shared_ptr<Volume>& part : parts_) {
    if (part == nullptr) continue;
    AlignedVector<std::byte>& to = part->block.bytes;
    if (!bytes.empty() && begin < part_begin + to.size()) {
      const std::size_t at = std::size_t(begin - part_begin), count = std::min(bytes.size(), to.size() - at);
      std::memcpy(to.data() + at, bytes.data(), count);
      bytes = bytes.subspan(count);
      begin += count;
    }
    part_begin += to.size();
  }
  CHECK(bytes.empty());
}

Result<DataSource> UploadBuffer::Finish() {
  if (order_.file) {
    const AlignedVector<std::byte> bytes = std::move(file_);
    Result<std::shared_ptr<const ClientFile>> file = ClientFile::Write(order_.file->name, bytes);
    if (!file.ok()) return file.status();
    DataSource source((*file)->path(), "");
    source.sent = *std::move(file);
    return source;
  }
  LayeredVolume whole;
  whole.volume = std::move(parts_[std::size_t(Layer::kVolume)]);
  if (const auto labels = std::move(parts_[std::size_t(Layer::kLabels)])) {
    const std::uint32_t most = VisitScalarType(labels->block.type, [&]<class T>(const T*) {
      const T* const samples = labels->block.samples<T>();
      return std::uint32_t(*std::max_element(samples, samples + labels->block.box.voxel_count()));
    });
    if (most > order_.labels.size()) {
      return Status::InvalidArgument(
          fmt::format("dataset \"{}\" has label number {}, but only {} labels", order_.name, most, order_.labels.size()));
    }
    whole.layers.table = std::make_shared<const LabelTable>(TableOf(order_.labels));
    whole.layers.labels = labels;
  }
  DataSource source(DataLoader([whole](const TellRead&) -> Result<LoadedData> { return LoadedData{whole}; }));
  source.held_bytes = BytesToSend(order_);
  if (auto overlay = std::shared_ptr<const Volume>(std::move(parts_[std::size_t(Layer::kOverlay)]))) {
    source.overlay =
        std::make_shared<const DataSource>(VolumeLoader([overlay]() -> Result<std::shared_ptr<const Volume>> { return overlay; }));
  }
  return source;
}

}  // namespace slabstream
