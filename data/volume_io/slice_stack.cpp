#include "data/volume_io/slice_stack.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <optional>

#include "common/text/natural_order.h"
#include "data/volume_io/text_header.h"

namespace slabstream {
namespace {

// The name of a file in lower case, without its numbers.
std::string WithoutNumbers(const std::string& path) {
  std::string name = ToLower(std::filesystem::path(path).stem().string());
  std::erase_if(name, [](char c) { return c >= '0' && c <= '9'; });
  return name;
}

}  // namespace

std::vector<std::string> SlicesIn(const std::string& folder, const std::vector<std::string_view>& endings) {
  std::vector<std::string> paths;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    if (std::ranges::count(endings, ToLower(entry.path().extension().string())) > 0 && entry.is_regular_file(error)) {
      paths.push_back(entry.path().string());
    }
  }
  std::ranges::sort(paths, {}, InNaturalOrder);
  return paths;
}

namespace {

const std::vector<PictureKind>& PictureKinds() {
  static const std::vector<PictureKind> kKinds = {
      {"PNG", {".png"}, "a .png picture or a folder of numbered ones"},
      {"JPEG", {".jpg", ".jpeg"}, "a .jpg picture or a folder of numbered ones"},
      {"JPEG 2000", {".jp2", ".j2k", ".j2c", ".jpf"}, "a .jp2 picture or a folder of numbered ones"},
      {"BMP", {".bmp"}, "a .bmp picture or a folder of numbered ones"}};
  return kKinds;
}

bool IsPictureOf(const std::string& path, const PictureKind& kind) {
  std::error_code error;
  return std::ranges::count(kind.endings, ToLower(std::filesystem::path(path).extension().string())) > 0 &&
         std::filesystem::is_regular_file(path, error);
}

}  // namespace

const PictureKind& PictureKindOf(std::string_view format) { return *std::ranges::find(PictureKinds(), format, &PictureKind::format); }

bool IsPicture(const std::string& path) {
  return std::ranges::any_of(PictureKinds(), [&](const PictureKind& kind) { return IsPictureOf(path, kind); });
}

bool HasVolumeFiles(const std::string& folder) {
  std::vector<std::string_view> of_volumes;
  for (const VolumeFormat& format : FileFormats()) of_volumes.insert(of_volumes.end(), format.endings.begin(), format.endings.end());
  return !SlicesIn(folder, of_volumes).empty();
}

std::vector<std::string> SlicesOfPictures(const std::string& path, const PictureKind& kind) {
  if (IsPictureOf(path, kind)) return {path};
  // In a folder at least two, whose names differ in nothing but their numbers, and no volume files.
  std::vector<std::string> slices = SlicesIn(path, kind.endings);
  if (slices.size() < 2) return {};
  const std::string name = WithoutNumbers(slices.front());
  const bool numbered = std::ranges::all_of(slices, [&](const std::string& slice) { return WithoutNumbers(slice) == name; });
  return numbered && !HasVolumeFiles(path) ? slices : std::vector<std::string>();
}

Result<RawHeader> HeaderOfSlices(const std::string& path, RawHeader slice, std::int64_t count, std::int64_t file_bytes,
                                 const ReadOptions& options) {
  if (Status status = SetSize(slice, path, {double(slice.size.x), double(slice.size.y), double(count)}, {}); !status.ok()) return status;
  if (options.spacing) {
    slice.steps = StepsOf(*options.spacing);
    slice.unit.reset();  // whoever gives the distances says no unit
  }
  // More than LZW (1400), deflate (1032), JPEG (512) and LZMA (7000) reach; a file that claims more is damaged.
  constexpr std::int64_t kMaxRatio = 8192;
  const std::int64_t needed = slice.sample_bytes();
  if (needed / kMaxRatio > file_bytes) {
    return Status::DataLoss(
        fmt::format("{}: truncated: the header speaks of {} bytes of samples, the file has {}", path, needed, file_bytes));
  }
  return slice;
}

Status CheckSlice(const std::string& name, const RawHeader& slice, const RawHeader& volume) {
  const auto kind = [](const RawHeader& of) {
    return fmt::format("{} x {} {}{}", of.size.x, of.size.y, ToString(of.type),
                       of.components == 1 ? "" : fmt::format(" of {} components", of.components));
  };
  if (kind(slice) == kind(volume)) return Status::Ok();
  return Status::InvalidArgument(fmt::format("{} is {}, must be {} like the first one", name, kind(slice), kind(volume)));
}

Status ReadSlice(SliceFile& slice, const std::string& name, std::int64_t number, RawVolume& volume, const ReadOptions& options) {
  const Result<RawHeader> header = slice.ReadHeader();
  if (!header.ok()) return header.status();
  if (Status status = CheckSlice(name, *header, volume.header); !status.ok()) return status;
  if (options.headers_only) return Status::Ok();
  const Status status = slice.ReadSamples(*header, volume.bytes.data() + number * header->sample_bytes());
  if (options.progress != nullptr) options.progress->Add(header->sample_bytes());
  return status;
}

Result<RawVolume> ReadSliceStack(const std::string& folder, const std::vector<std::string>& paths, OpenSlice open,
                                 const ReadOptions& options) {
  std::int64_t file_bytes = 0;
  for (const std::string& path : paths) file_bytes += BytesOfFile(path);
  std::optional<RawVolume> raw;
  for (std::size_t number = 0; number < paths.size(); ++number) {
    const Result<std::unique_ptr<SliceFile>> slice = open(paths[number]);
    if (!slice.ok()) return slice.status();
    if (!raw) {
      const Result<RawHeader> first = (*slice)->ReadHeader();
      if (!first.ok()) return first.status();
      const Result<RawHeader> header = HeaderOfSlices(folder, *first, std::int64_t(paths.size()), file_bytes, options);
      if (!header.ok()) return header.status();
      Result<RawVolume> taken = TakeMemory(folder, *header, options);
      if (!taken.ok()) return taken;
      raw = *std::move(taken);
    }
    if (Status status = ReadSlice(**slice, paths[number], std::int64_t(number), *raw, options); !status.ok()) return status;
  }
  return *std::move(raw);
}

std::int64_t BytesOfFile(const std::string& path) {
  std::error_code error;
  const auto bytes = std::filesystem::file_size(path, error);
  return error ? 0 : std::int64_t(bytes);
}

}  // namespace slabstream
