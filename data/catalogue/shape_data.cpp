#include "data/catalogue/shape_data.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "common/shapes/packed_shape.h"
#include "data/open/file_times.h"
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

bool NamesShape(const std::string& text) {
  const Result<SourceText> source = ParseSourceText(text);
  if (!source.ok()) return false;
  if (!NamesFileTimes(source->path)) return HoldsShape(source->path);
  const Result<std::string> first = FirstFileOf(source->path);
  return first.ok() && HoldsShape(*first);
}

Result<ShapeFile> FindShapeFile(const std::string& text) {
  const Result<SourceText> source = ParseSourceText(text);
  if (!source.ok()) return source.status();
  if (const std::string rest = WithoutReadOption(text, "time"); rest != source->path) {
    return Status::InvalidArgument(
        fmt::format("{}: has options '{}', but of a shape only a time can be named", source->path, rest.substr(source->path.size())));
  }
  if (!NamesFileTimes(source->path)) return ShapeFile{.path = source->path, .stamped = {source->path}};
  const Result<std::vector<TimeFile>> files = FilesOfTimes(source->path);
  if (!files.ok()) return files.status();
  const auto& time = source->options.time;
  const std::size_t number = time ? std::size_t(time->first) : 0;
  if (number >= files->size()) return NoSuchFileTime(source->path, int(number), files->size());
  ShapeFile file{.path = (*files)[number].file, .times = TimesOf(*files), .time = int(number), .stamped = {(*files)[number].file}};
  if (!time) file.stamped.push_back(ListOfFileTimes(source->path));
  return file;
}

Result<LoadedData> DataOfShape(const Shape& shape) {
  Result<AlignedVector<std::byte>> bytes = PackShape(shape);
  if (!bytes.ok()) return bytes.status();
  const Result<ShapeInfo> info = InfoOf(*bytes);
  if (!info.ok()) return info.status();
  return LoadedData{.volume = AsVolume(*std::move(bytes)), .shape = std::make_shared<const ShapeInfo>(*info)};
}

Result<LoadedSource> LoadShape(const std::string& text, const TellRead& tell) {
  const Result<ShapeFile> file = FindShapeFile(text);
  if (!file.ok()) return file.status();
  const Result<FileStamp> before = StampFiles(file->stamped);
  if (!before.ok()) return before.status();
  const Result<Shape> shape = ReadShape(file->path, tell);
  const Result<bool> changed = HaveChanged(*before);
  if (!changed.ok() || *changed) return Status::Unavailable(file->path + ": the file is being written; the next request reads it again");
  if (!shape.ok()) return shape.status();
  Result<LoadedData> data = DataOfShape(*shape);
  if (!data.ok()) return Status(data.status().code(), file->path + ": " + data.status().message());
  SourceInfo info;
  info.times = file->times;
  info.time = file->time;
  return LoadedSource{.file = std::move(info),
                      .volume = std::move(data->volume),
                      .stamp = std::make_shared<const FileStamp>(*before),
                      .shape = std::move(data->shape)};
}

}  // namespace slabstream
