#include "coordinator/service/upload_buffer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "common/base/check.h"
#include "common/volume/memory_budget.h"
#include "data/catalogue/client_file.h"

namespace slabstream {
namespace {

LabelTable TableOf(const std::vector<NewLabel>& labels) {
  LabelTable table{.labels = {}, .complete = true};
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
  const auto make_room = [&](ScalarType type) {
    VolumeDescription description = order.description;
    if (!buffer->parts_.empty()) description.mapping = {};
    description.type = type;
    buffer->parts_.push_back(std::make_shared<Volume>(Volume{description, MakeVoxelBlock(description.geometry.bounds(), type)}));
  };
  make_room(order.description.type);
  if (order.label_bytes > 0) make_room(order.label_bytes == 1 ? ScalarType::kUint8 : ScalarType::kUint16);
  if (order.overlay) make_room(ScalarType::kFloat32);
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
  const auto source_of = [](std::shared_ptr<const Volume> volume, std::shared_ptr<const LabelTable> labels = nullptr) {
    return DataSource(DataLoader([volume = std::move(volume), labels = std::move(labels)](const TellRead&) -> Result<LoadedData> {
      return LoadedData{.volume = volume, .labels = labels};
    }));
  };
  DataSource source = source_of(parts_.front());
  source.held_bytes = BytesToSend(order_);
  if (order_.label_bytes > 0) {
    Result<std::shared_ptr<const Volume>> labels = ValuesOf(*parts_[1]);
    if (!labels.ok()) return labels.status();
    source.labels =
        std::make_shared<const DataSource>(source_of(*std::move(labels), std::make_shared<const LabelTable>(TableOf(order_.labels))));
  }
  if (order_.overlay) source.overlay = std::make_shared<const DataSource>(source_of(parts_.back()));
  return source;
}

// The labels themselves in place of their numbers.
Result<std::shared_ptr<const Volume>> UploadBuffer::ValuesOf(const Volume& numbers) const {
  const std::vector<NewLabel>& labels = order_.labels;
  const std::uint64_t greatest = labels.empty() ? 0 : labels.back().value;
  const ScalarType type = greatest <= 0xFF         ? ScalarType::kUint8
                          : greatest <= 0xFFFF     ? ScalarType::kUint16
                          : greatest <= 0xFFFFFFFF ? ScalarType::kUint32
                                                   : ScalarType::kUint64;
  auto values = std::make_shared<Volume>(Volume{numbers.description, MakeVoxelBlock(numbers.block.box, type)});
  values->description.type = type;
  std::size_t most = 0;
  VisitScalarType(numbers.block.type, [&]<class N>(const N*) {
    VisitLabelType(type, [&]<class T>(const T*) {
      T* const to = values->block.samples<T>();
      const N* const from = numbers.block.samples<N>();
      for (std::size_t i = 0; i < std::size_t(numbers.block.box.voxel_count()); ++i) {
        const auto number = std::size_t(from[i]);
        most = std::max(most, number);
        if (number > 0 && number <= labels.size()) to[i] = T(labels[number - 1].value);
      }
    });
  });
  if (most <= labels.size()) return std::shared_ptr<const Volume>(std::move(values));
  return Status::InvalidArgument(fmt::format("dataset \"{}\" has label number {}, but only {} labels", order_.name, most, labels.size()));
}

}  // namespace slabstream
