// TIFF: a multi-page file, an OME-TIFF in several files, or a folder of files, one a slice.
//
// TIFF states no distance between slices, and its resolution is meant for print: spacing is 1 along x and z, and along y the ratio of the
// two resolutions. Descriptions of OME and ImageJ state the size of voxels.
#include <fmt/format.h>

#include <filesystem>
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
  Result<std::unique_ptr<TiffFile>> page = TiffFile::Open(path);
  if (!page.ok()) return page.status();
  return std::unique_ptr<SliceFile>(*std::move(page));
}

Result<RawVolume> ReadPages(const std::string& path, const ReadOptions& options) {
  const Result<TiffStack> stack = OpenTiffStack(path, options);
  if (!stack.ok()) return stack.status();
  Result<RawVolume> raw = TakeMemory(path, stack->header, stack->of_pages);
  if (!raw.ok()) return raw;
  if (stack->files.size() > 1) raw->other_files = {std::filesystem::path(path).parent_path()};
  std::unique_ptr<TiffFile> page;
  for (std::size_t number = 0; number < stack->slices.size(); ++number) {
    const TiffSlice& slice = stack->slices[number];
    if (page == nullptr || slice.plane == 0) {
      Result<std::unique_ptr<TiffFile>> opened = TiffFile::Open(stack->files[slice.file], slice.directory);
      if (!opened.ok()) return opened.status();
      page = *std::move(opened);
    }
    page->SetPlane(slice.plane);
    if (Status status = ReadSlice(*page, stack->NameOf(slice), std::int64_t(number), *raw, options); !status.ok()) return status;
  }
  if (!options.headers_only) TakeChannel(*raw, stack->of_pages);  // which may be a component of a channel's pages
  return raw;
}

std::vector<std::string_view> Endings() { return {".tif", ".tiff", ".btf", ".tf8", ".tf2"}; }

// A folder of slices.
bool Recognises(const std::string& path, const ReadOptions&) { return !SlicesIn(path, Endings()).empty(); }

Result<RawVolume> Read(const std::string& path, const ReadOptions& options) {
  const std::vector<std::string> slices = SlicesIn(path, Endings());
  if (slices.empty()) return ReadPages(path, options);
  if (const std::size_t files = FilesOf(slices.front()); files > 1) {
    Result<RawVolume> raw = ReadPages(slices.front(), options);
    if (raw.ok()) {
      raw->header.notes.push_back(fmt::format("the folder has {} TIFF files: this is the OME-TIFF of {} files that {} belongs to",
                                              slices.size(), files, slices.front()));
    }
    return raw;
  }
  if (options.time) return Status::InvalidArgument(path + ": time is for TIFF files that state several, not for a folder of slices");
  return ReadSliceStack(path, slices, OpenSliceFile, options);
}

}  // namespace

VolumeFormat Tiff() {
  std::vector<std::string_view> endings = Endings();
  endings.push_back(".companion.ome");
  return {.name = "TIFF",
          .endings = std::move(endings),
          .also = "a folder of .tif slices",
          .recognises = Recognises,
          .options = {"time", "channel", "series", "spacing"},
          .read = Read};
}

}  // namespace slabstream
