// Pictures, one a slice: which files of a folder they are, in which order, and how they become a volume. A picture alone is a volume of one
// slice.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/status.h"
#include "data/volume_io/formats.h"
#include "data/volume_io/raw_volume.h"

namespace slabstream {

// The files of a folder with these endings (lower case: ".tif"), in natural order: "s2.tif" before "s10.tif". Empty if there are none or it
// is no folder.
std::vector<std::string> SlicesIn(const std::string& folder, const std::vector<std::string_view>& endings);

// Formats of pictures.
struct PictureKind {
  std::string_view format;
  std::vector<std::string_view> endings;  // in lower case
  std::string_view text;                  // VolumeFormat::also
};
const PictureKind& PictureKindOf(std::string_view format);
// Whether the path is a file with the ending of a picture.
bool IsPicture(const std::string& path);

// Whether files of this folder have the ending of a volume format.
bool HasVolumeFiles(const std::string& folder);

// An open picture. Messages name its file.
class SliceFile {
 public:
  virtual ~SliceFile() = default;
  // Size (along z: 1), components, type and spacing. InvalidArgument: a kind of picture that is not read.
  virtual Result<RawHeader> ReadHeader() = 0;
  // Fills `out` with the samples, in this machine's byte order. `header` is its own. DataLoss: truncated or damaged.
  virtual Status ReadSamples(const RawHeader& header, std::byte* out) = 0;
};

// What decoders in C read a picture from.
struct ClosePicture {
  void operator()(std::FILE* file) const { (void)std::fclose(file); }
};
using PictureHandle = std::unique_ptr<std::FILE, ClosePicture>;

// "PATH: WHY: COMPLAINT", where the decoder has one.
inline Status PictureFailure(StatusCode code, const std::string& path, const std::string& why, std::string_view complaint) {
  return {code, path + ": " + why + (complaint.empty() ? "" : ": ") + std::string(complaint)};
}

// The header of a volume of `count` slices like `slice`. Spacing: options.spacing if it is given, else that of the
// slice. InvalidArgument: too many. DataLoss: files of `file_bytes` cannot hold it.
Result<RawHeader> HeaderOfSlices(const std::string& path, RawHeader slice, std::int64_t count, std::int64_t file_bytes,
                                 const ReadOptions& options);

// InvalidArgument: a slice differs from the volume in size, type or components. `name`: of the slice.
Status CheckSlice(const std::string& name, const RawHeader& slice, const RawHeader& volume);

// Reads a slice, or only its header, as number `number` of the volume. `name`: of the slice, for messages. InvalidArgument: it differs from
// the first one in size, type or components.
Status ReadSlice(SliceFile& slice, const std::string& name, std::int64_t number, RawVolume& volume, const ReadOptions& options);

// A folder of slices; `open` opens one.
using OpenSlice = Result<std::unique_ptr<SliceFile>> (*)(const std::string& path);
Result<RawVolume> ReadSliceStack(const std::string& folder, const std::vector<std::string>& paths, OpenSlice open,
                                 const ReadOptions& options);

// 0 if it cannot be told.
std::int64_t BytesOfFile(const std::string& path);

// The slices of a picture or of a folder of numbered ones; none: it is neither.
std::vector<std::string> SlicesOfPictures(const std::string& path, const PictureKind& kind);

template <class File>
std::vector<std::string> SlicesOf(const std::string& path) {
  return SlicesOfPictures(path, PictureKindOf(File::kFormat));
}

// The format of pictures of a kind. `File` is a SliceFile that is made from a path. It has a `Status Open()`, called once and before all
// else, and `kFormat`, the name of its PictureKind.
template <class File>
VolumeFormat StackFormat() {
  constexpr OpenSlice kOpen = [](const std::string& path) -> Result<std::unique_ptr<SliceFile>> {
    auto file = std::make_unique<File>(path);
    if (Status status = file->Open(); !status.ok()) return status;
    return std::unique_ptr<SliceFile>(std::move(file));
  };
  return {.name = File::kFormat,
          .endings = {},
          .also = PictureKindOf(File::kFormat).text,
          .recognises = [](const std::string& path, const ReadOptions&) { return !SlicesOf<File>(path).empty(); },
          .options = {"channel", "spacing"},
          .read = [](const std::string& path,
                     const ReadOptions& options) { return ReadSliceStack(path, SlicesOf<File>(path), kOpen, options); }};
}

}  // namespace slabstream
