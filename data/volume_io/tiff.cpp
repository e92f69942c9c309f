// TIFF: a multi-page file, or a folder of files, one a slice.
//
// TIFF states no distance between slices, and its resolution is meant for print: spacing is 1 along x and z, and along y the ratio of the
// two resolutions. OME-TIFF states the size of voxels in its description.
#include <fmt/format.h>

#include <memory>
#include <utility>

#include "data/volume_io/formats.h"
#include "data/volume_io/tiff_stack.h"

namespace slabstream {
namespace {

Result<std::unique_ptr<SliceFile>> OpenSliceFile(const std::string& path) {
  const Result<std::unique_ptr<TiffFile>> file = TiffFile::Open(path);
  if (!file.ok()) return file.status();
  const Result<std::vector<TiffPage>> pages = (*file)->ReadPages();
  if (!pages.ok()) return pages.status();
  if (pages->size() != 1) return (*file)->Refused(fmt::format("has {} pages, must have 1 in a folder of slices", pages->size()));
  Result<std::unique_ptr<TiffFile>> page = (*file)->At(pages->front().offset);
  if (!page.ok()) return page.status();
  return std::unique_ptr<SliceFile>(*std::move(page));
}

Result<RawVolume> ReadPages(const std::string& path, const ReadOptions& options) {
  const Result<TiffStack> stack = OpenTiffStack(path, options);
  if (!stack.ok()) return stack.status();
  Result<RawVolume> raw = TakeMemory(path, stack->header, stack->of_pages);
  for (std::int64_t slice = 0; raw.ok() && slice < stack->order.count; ++slice) {
    const std::int64_t number = stack->order.PageOf(slice);
    const Result<std::unique_ptr<TiffFile>> page = stack->file->At(stack->pages[std::size_t(number)].offset);
    if (!page.ok()) return page.status();
    const std::string name = fmt::format("{}: page {}", path, number + 1);
    if (Status status = ReadSlice(**page, name, slice, *raw, options); !status.ok()) return status;
  }
  return raw;
}

std::vector<std::string_view> Endings() { return {".tif", ".tiff"}; }

// A folder of slices.
bool Recognises(const std::string& path, const ReadOptions&) { return !SlicesIn(path, Endings()).empty(); }

Result<RawVolume> Read(const std::string& path, const ReadOptions& options) {
  const std::vector<std::string> slices = SlicesIn(path, Endings());
  if (slices.empty()) return ReadPages(path, options);
  if (options.time) return Status::InvalidArgument(path + ": time is for OME-TIFF files, not for a folder of slices");
  return ReadSliceStack(path, slices, OpenSliceFile, options);
}

}  // namespace

VolumeFormat Tiff() {
  return {.name = "TIFF",
          .endings = Endings(),
          .also = "a folder of .tif slices",
          .recognises = Recognises,
          .options = {"time", "channel", "spacing"},
          .read = Read};
}

}  // namespace slabstream
