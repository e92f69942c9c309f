#include "data/shapes/shape_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <span>
#include <string_view>
#include <system_error>
#include <vector>

#include "common/base/printable.h"
#include "common/files/files.h"
#include "common/memory/aligned_buffer.h"
#include "common/volume/memory_budget.h"
#include "data/shapes/shape_formats.h"
#include "data/volume_io/text_cursor.h"
#include "data/volume_io/text_header.h"
#include "data/volume_io/vtk_legacy_file.h"

namespace slabstream {
namespace {

struct ShapeFormat {
  std::vector<std::string_view> endings;
  void (*read)(std::string_view bytes, ShapeBuilder& builder) = nullptr;        // takes the file as a whole,
  void (*read_file)(const std::string& path, ShapeBuilder& builder) = nullptr;  // or reads it itself
  // Whether a file without such an ending, or a file whose ending others have, too, is one.
  bool (*claims)(const std::string& path) = nullptr;
};

bool IsPolydata(const std::string& path) { return VtkLegacyFile::KindOf(path) == "POLYDATA"; }

const std::vector<ShapeFormat>& Formats() {
  static const std::vector<ShapeFormat> formats = {
      {{".csv", ".fcsv", ".tsv"}, ReadTable},
      {{".gii"}, ReadGifti},
      {{".glb"}, ReadGlb},
      {{".npy"}, nullptr, ReadNpyOfPoints, IsNpyOfPoints},
      {{".obj"}, ReadObj},
      {{".ply"}, ReadPly},
      {{".stl"}, ReadStl},
      {{".tck"}, ReadTck},
      {{".trk"}, ReadTrk},
      {{".vtk"}, nullptr, ReadVtkPolydata, IsPolydata},
      {{".vtp"}, nullptr, ReadVtkPolydata},
      {{}, ReadFreeSurfer, nullptr, IsFreeSurfer},
  };
  return formats;
}

// Null: it is of none.
const ShapeFormat* FormatOf(const std::string& path) {
  const std::string lower = ToLower(path);
  const auto found = std::ranges::find_if(Formats(), [&](const ShapeFormat& format) {
    const auto ends = [&](std::string_view ending) { return lower.ends_with(ending); };
    return std::ranges::any_of(format.endings, ends) ? format.claims == nullptr || format.claims(path)
                                                     : format.endings.empty() && format.claims(path);
  });
  return found == Formats().end() ? nullptr : &*found;
}

Result<AlignedVector<char>> ReadAll(const std::string& path, ReadProgress& progress) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  TextCursor cursor(path);
  if (error || !cursor.is_open()) return Status::NotFound("cannot be opened for reading");
  if (Status status = CheckFitsMemory(std::int64_t(size), "the file"); !status.ok()) return status;
  progress.Begin(std::int64_t(size));
  AlignedVector<char> bytes(size);
  constexpr std::size_t kAtOnce = std::size_t{4} << 20;
  for (std::size_t at = 0; at < size;) {
    const std::size_t count = cursor.Read(std::as_writable_bytes(std::span(bytes).subspan(at, std::min(kAtOnce, size - at))));
    if (count == 0) return Status::DataLoss(fmt::format("has become shorter than {} bytes while it was read", size));
    at += count;
    progress.Add(std::int64_t(count));
  }
  return bytes;
}

}  // namespace

bool HoldsShape(const std::string& path) { return CheckIsFile(path).ok() && FormatOf(path) != nullptr; }

std::string ShapeEndings() {
  std::string endings;
  for (const ShapeFormat& format : Formats()) {
    for (const std::string_view ending : format.endings) endings.append(endings.empty() ? "" : ", ").append(ending);
  }
  return endings;
}

Result<Shape> ReadShape(const std::string& path, const TellRead& tell) {
  if (Status status = CheckIsFile(path); !status.ok()) return status;
  const ShapeFormat* const format = FormatOf(path);
  if (format == nullptr)
    return Status::InvalidArgument(fmt::format("{}: holds no shape that is known; must end in {}", path, ShapeEndings()));
  ReadProgress progress(tell);
  ShapeBuilder builder;
  if (format->read == nullptr) {
    format->read_file(path, builder);
  } else if (const Result<AlignedVector<char>> bytes = ReadAll(path, progress); bytes.ok()) {
    format->read({bytes->data(), bytes->size()}, builder);
  } else {
    builder.Fail(bytes.status());
  }
  Result<Shape> shape = builder.Finish();
  if (shape.ok()) return shape;
  const Status status = shape.status();
  return Printable(status.message().starts_with(path) ? status : Status(status.code(), path + ": " + status.message()));
}

}  // namespace slabstream
