// Folders of pictures, one a slice: which files of a folder they are, in which order, and how they become a volume.
#pragma once

#include <cstddef>
#include <cstdint>
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

// Whether files of this folder have the ending of a volume format.
bool HasVolumeFiles(const std::string& folder);

// A folder of numbered pictures and no volume files: at least two pictures, whose names differ in nothing but their numbers.
bool IsStackOfPictures(const std::string& folder, const std::vector<std::string_view>& endings);

// An open picture. Messages name its file.
class SliceFile {
 public:
  virtual ~SliceFile() = default;
  // Size (along z: 1), components, type and spacing. InvalidArgument: a kind of picture that is not read.
  virtual Result<RawHeader> ReadHeader() = 0;
  // Fills `out` with the samples, in this machine's byte order. `header` is its own. DataLoss: truncated or damaged.
  virtual Status ReadSamples(const RawHeader& header, std::byte* out) = 0;
};

// Of a volume of `count` slices like `slice`. Spacing: options.spacing if it is given, else that of the slice. InvalidArgument: too many.
// DataLoss: files of `file_bytes` cannot hold it.
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

// The format of folders of numbered pictures. `File` is a SliceFile that is made from a path. It has a `Status Open()`, called once and
// before all else, and `Endings()`, those of its files, for SlicesIn.
template <class File>
VolumeFormat StackFormat(std::string_view name, std::string_view also) {
  constexpr OpenSlice kOpen = [](const std::string& path) -> Result<std::unique_ptr<SliceFile>> {
    auto file = std::make_unique<File>(path);
    if (Status status = file->Open(); !status.ok()) return status;
    return std::unique_ptr<SliceFile>(std::move(file));
  };
  return {.name = name,
          .endings = {},
          .also = also,
          .recognises = [](const std::string& path, const ReadOptions&) { return IsStackOfPictures(path, File::Endings()); },
          .options = {"channel", "spacing"},
          .read = [](const std::string& folder,
                     const ReadOptions& options) { return ReadSliceStack(folder, SlicesIn(folder, File::Endings()), kOpen, options); }};
}

}  // namespace slabstream
