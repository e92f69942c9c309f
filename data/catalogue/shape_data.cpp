#include "data/catalogue/shape_data.h"

#include <algorithm>
#include <utility>

#include "common/shapes/packed_shape.h"
#include "data/shapes/shape_file.h"

namespace slabstream {
namespace {

// Zeros behind the bytes fill the last row and slice.
std::shared_ptr<const Volume> AsVolume(AlignedVector<std::byte> bytes) {
  constexpr std::size_t kRow = 4096, kRows = 4096;
  const std::size_t rows = (bytes.size() + kRow - 1) / kRow;
  const Index3 size = {std::int32_t(std::clamp<std::size_t>(bytes.size(), 1, kRow)), std::int32_t(std::clamp<std::size_t>(rows, 1, kRows)),
                       std::int32_t(std::max<std::size_t>((rows + kRows - 1) / kRows, 1))};
  auto volume = std::make_shared<Volume>();
  volume->description.geometry.size = size;
  volume->block = {volume->description.geometry.bounds(), ScalarType::kUint8, std::move(bytes)};
  volume->block.bytes.resize(CountIn(size));
  return volume;
}

}  // namespace

Result<LoadedData> DataOfShape(const Shape& shape) {
  Result<AlignedVector<std::byte>> bytes = PackShape(shape);
  if (!bytes.ok()) return bytes.status();
  const Result<ShapeInfo> info = InfoOf(*bytes);
  if (!info.ok()) return info.status();
  return LoadedData{.volume = AsVolume(*std::move(bytes)), .shape = std::make_shared<const ShapeInfo>(*info)};
}

Result<LoadedSource> LoadShape(const std::string& path, const TellRead& tell) {
  const Result<FileStamp> before = StampFiles({path});
  if (!before.ok()) return before.status();
  const Result<Shape> shape = ReadShape(path, tell);
  const Result<bool> changed = HaveChanged(*before);
  if (!changed.ok() || *changed) return Status::Unavailable(path + ": the file is being written; the next request reads it again");
  if (!shape.ok()) return shape.status();
  Result<LoadedData> data = DataOfShape(*shape);
  if (!data.ok()) return Status(data.status().code(), path + ": " + data.status().message());
  return LoadedSource{
      .volume = std::move(data->volume), .stamp = std::make_shared<const FileStamp>(*before), .shape = std::move(data->shape)};
}

}  // namespace slabstream
