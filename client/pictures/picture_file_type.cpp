#include "client/pictures/picture_file_type.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>

namespace slabstream {

std::span<const PictureFileTypeNames> PictureFileTypes() {
  using enum PictureFileType;
  static constexpr std::array<PictureFileTypeNames, 7> kTypes = {{{kPng, ".png", "", "image/png"},
                                                                  {kJpeg, ".jpg", ".jpeg", "image/jpeg"},
                                                                  {kWebp, ".webp", "", "image/webp"},
                                                                  {kTiff, ".tif", ".tiff", "image/tiff"},
                                                                  {kExr, ".exr", "", "image/x-exr"},
                                                                  {kPdf, ".pdf", "", "application/pdf"},
                                                                  {kSvg, ".svg", "", "image/svg+xml"}}};
  return kTypes;
}

std::string PictureEndings() {
  std::string text;
  for (const PictureFileTypeNames& names : PictureFileTypes()) {
    const bool last = &names == &PictureFileTypes().back();
    text += fmt::format("{}{}", text.empty() ? "" : last ? " or " : ", ", names.ending);
  }
  return text;
}

std::optional<PictureFileType> PictureFileTypeOf(const std::string& path) {
  std::string ending = std::filesystem::path(path).extension().string();
  std::ranges::transform(ending, ending.begin(), [](unsigned char c) { return char(std::tolower(c)); });
  if (ending.empty()) return std::nullopt;
  for (const PictureFileTypeNames& names : PictureFileTypes()) {
    if (ending == names.ending || ending == names.other) return names.type;
  }
  return std::nullopt;
}

Status CheckPicturePath(const std::string& path) {
  if (PictureFileTypeOf(path)) return Status::Ok();
  return Status::InvalidArgument(fmt::format("output '{}' must end in {}", path, PictureEndings()));
}

Status CheckPictureSize(PictureFileType type, ImageSize size) {
  constexpr int kMostOfWebp = 16383;
  if (type != PictureFileType::kWebp || std::max(size.width, size.height) <= kMostOfWebp) return Status::Ok();
  return Status::InvalidArgument(
      fmt::format("--size {}x{} is too large for .webp, which has at most {} pixels a side", size.width, size.height, kMostOfWebp));
}

Status CheckPictureFile(const std::string& path, ImageSize size) {
  const Status status = CheckPicturePath(path);
  return status.ok() ? CheckPictureSize(*PictureFileTypeOf(path), size) : status;
}

}  // namespace slabstream
