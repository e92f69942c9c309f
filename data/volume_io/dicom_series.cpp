#include "data/volume_io/dicom_series.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <map>

#include "common/base/printable.h"
#include "common/text/parse_number.h"
#include "data/volume_io/dicom_frames.h"
#include "data/volume_io/dicom_segments.h"
#include "data/volume_io/payload.h"

namespace slabstream {
namespace {

namespace fs = std::filesystem;

// Calls `visit` with each regular file below the folder until it returns false. ResourceExhausted: there are too many.
Status ForEachFile(const std::string& directory, const std::function<bool(const std::string& path)>& visit) {
  std::error_code error;
  std::size_t count = 0;
  fs::recursive_directory_iterator entry(directory, fs::directory_options::skip_permission_denied, error), end;
  for (; !error && entry != end; entry.increment(error)) {
    std::error_code unreadable;
    if (!entry->is_regular_file(unreadable)) continue;
    if (++count > kMaxFilesLookedAt) {
      return Status::ResourceExhausted(
          fmt::format("{}: more than {} files in it: name the folder of one study", directory, kMaxFilesLookedAt));
    }
    if (!visit(entry->path().string())) return Status::Ok();
  }
  return error ? Status::NotFound(fmt::format("{}: cannot read the folder: {}", directory, error.message())) : Status::Ok();
}

Result<std::vector<std::string>> FindDicomFiles(const std::string& directory) {
  std::vector<std::string> paths;
  const Status status = ForEachFile(directory, [&](const std::string& path) {
    if (BeginsLikeDicom(path)) paths.push_back(path);
    return true;
  });
  if (!status.ok()) return status;
  std::ranges::sort(paths);
  return paths;
}

// The images of these files; a DICOMDIR has none.
Result<std::vector<DicomImage>> ReadImages(const std::vector<std::string>& paths) {
  std::vector<DicomImage> images;
  for (const std::string& path : paths) {
    Result<DicomImage> image = ReadDicomImage(path);
    if (!image.ok()) return image.status();
    if (!image->media_directory) images.push_back(*std::move(image));
  }
  return images;
}

// Whether the files hold the same bytes of pixels.
bool SameBytes(const DicomImage& a, const DicomImage& b) {
  if (a.transfer_syntax != b.transfer_syntax || a.pixels.bytes != b.pixels.bytes || a.pixels.deflated_at != 0) return false;
  constexpr std::int64_t kBlock = std::int64_t{1} << 20;
  std::vector<std::byte> of_a, of_b;
  for (std::int64_t done = 0; done < a.pixels.bytes; done += kBlock) {
    of_a.resize(std::size_t(std::min(kBlock, a.pixels.bytes - done)));
    of_b.resize(of_a.size());
    const bool read = ReadPayload({.file = a.path, .offset = a.pixels.offset + done}, of_a).ok() &&
                      ReadPayload({.file = b.path, .offset = b.pixels.offset + done}, of_b).ok();
    if (!read || of_a != of_b) return false;
  }
  return true;
}

// Whether the frames have the same pixels, however they are encoded. Images that cannot be read both are refused for that, later.
Result<bool> SamePixels(const DicomImage& a, const DicomImage& b) {
  if (SameBytes(a, b)) return true;
  if (!CheckFrames(a).ok() || !CheckFrames(b).ok()) return CheckFrames(a).ok() == CheckFrames(b).ok();
  std::vector<std::vector<std::byte>> slices;
  std::vector<DicomFrameReader> readers;
  for (const DicomImage* image : {&a, &b}) {
    std::vector<DicomFrameNumber> frames;
    for (std::size_t i = 0; i < image->frames.size(); ++i) frames.push_back({image, i});
    Result<DicomFrameReader> reader = DicomFrameReader::Start(frames, {});
    if (!reader.ok()) return reader.status();
    readers.push_back(*std::move(reader));
    slices.emplace_back(std::size_t(a.frame_pixels()) * BytesPerSample(a.format.type()));
  }
  for (std::size_t i = 0; i < a.frames.size(); ++i) {
    for (std::size_t k = 0; k < 2; ++k) {
      if (Status status = readers[k].Read(slices[k]); !status.ok()) return status;
    }
    if (slices[0] != slices[1]) return false;
  }
  return true;
}

// Keeps one of the images that are copies of each other: of the same SOPInstanceUID, place and pixels.
Status LeaveOutCopies(DicomSeries& series) {
  std::map<std::string, std::size_t> firsts;  // numbers of images
  std::vector<bool> is_copy(series.images.size());
  for (std::size_t i = 0; i < series.images.size(); ++i) {
    const DicomImage& image = series.images[i];
    const auto [found, is_new] = firsts.emplace(image.instance_uid, i);
    if (is_new || image.instance_uid.empty()) continue;
    const DicomImage& first = series.images[found->second];
    const auto differ = [&](const char* what) {
      return Status::InvalidArgument(fmt::format("{} and {} have the same SOPInstanceUID, but different {}", first.path, image.path, what));
    };
    if (first.columns != image.columns || first.rows != image.rows || first.frames != image.frames)
      return differ("sizes, places or rescalings");
    if (first.format != image.format) return differ("types of pixels");
    const Result<bool> same = SamePixels(first, image);
    if (!same.ok()) return same.status();
    if (!*same) return differ("pixels");
    is_copy[i] = true;
  }
  std::vector<DicomImage> kept;
  for (std::size_t i = 0; i < series.images.size(); ++i) {
    if (!is_copy[i]) kept.push_back(std::move(series.images[i]));
  }
  series.copies = series.images.size() - kept.size();
  series.images = std::move(kept);
  return Status::Ok();
}

std::vector<DicomSlice> SlicesOf(const DicomSeries& series) {
  std::vector<DicomSlice> slices;
  for (const DicomImage& image : series.images) {
    for (std::size_t i = 0; i < image.frames.size(); ++i) {
      const std::string name = image.frames.size() == 1 ? image.path : fmt::format("frame {} of {}", i + 1, image.path);
      slices.push_back({&image.frames[i], image.columns, image.rows, name});
    }
  }
  return slices;
}

std::string WhatElse(const DicomSeries& series) {
  const auto any = [&](auto&& holds) { return std::ranges::any_of(series.images, holds); };
  if (std::ranges::all_of(series.images, [](const DicomImage& image) { return image.columns == 0 || image.rows == 0; })) return "no images";
  if (any(&DicomImage::is_colour)) return "colour images";
  if (any([](const DicomImage& image) { return image.mosaic; })) return "mosaics";
  if (any([](const DicomImage& image) { return image.localizer; })) return "a localizer";
  if (!any([](const DicomImage& image) { return image.frames.front().position.has_value(); })) return "images without a place";
  if (series.frame_count() == 1) return "a single slice";
  return "";
}

// Judges a series whose images are complete.
void Judge(DicomSeries& series) {
  series.trouble = LeaveOutCopies(series);
  series.other = WhatElse(series);
  if (!series.trouble.ok()) return;
  const DicomImage& first = series.images.front();
  if (series.other == "no images") {
    series.trouble = Status::InvalidArgument(fmt::format("no images: its modality is '{}'", series.modality));
    return;
  }
  if (series.other == "mosaics") {
    series.trouble = Status::InvalidArgument(first.path + " holds many slices in one image (a mosaic); dcm2niix takes it apart");
    return;
  }
  for (const DicomImage& image : series.images) {
    series.trouble = CheckFrames(image);
    if (!series.trouble.ok()) return;
  }
  if (series.frame_count() == 1 && first.frames.front().position) {
    const std::string folder = fs::path(first.path).parent_path().string();
    series.trouble = Status::InvalidArgument(fmt::format(
        "a single slice, a volume has at least 2; the folder of a series is read as a whole: '{}'", folder.empty() ? "." : folder));
    return;
  }
  const bool of_segments = std::ranges::any_of(series.images, &DicomImage::is_segmentation);
  if (of_segments && series.images.size() > 1) {
    series.trouble = Status::InvalidArgument(fmt::format("{} segmentations, such as {} and {}; each file is a volume of its own",
                                                         series.images.size(), first.path, series.images[1].path));
    return;
  }
  if (of_segments) series.trouble = CheckSegments(first);
  if (!series.trouble.ok()) return;
  Result<DicomStack> stack = of_segments ? ArrangeSegments(SlicesOf(series)) : ArrangeSlices(SlicesOf(series));
  if (stack.ok()) {
    series.stack = *std::move(stack);
  } else {
    series.trouble = stack.status();
  }
}

// "2 (CT, 300 images, "THORAX")"
std::string Described(const DicomSeries& series) {
  return fmt::format("{} ({}, {} images, \"{}\")", series.number.empty() ? series.uid : series.number, series.modality,
                     series.frame_count(), series.description);
}

std::string DescribedAll(const std::vector<const DicomSeries*>& series) {
  constexpr std::size_t kShown = 5;
  std::string text;
  for (std::size_t i = 0; i < std::min(series.size(), kShown); ++i) text += (i > 0 ? ", " : "") + Described(*series[i]);
  return text + (series.size() > kShown ? ", ..." : "");
}

}  // namespace

std::size_t DicomSeries::frame_count() const {
  std::size_t count = 0;
  for (const DicomImage& image : images) count += image.frames.size();
  return count;
}

bool HoldsDicom(const std::string& directory) {
  bool found = false;
  (void)ForEachFile(directory, [&](const std::string& path) {
    found = BeginsLikeDicom(path);
    return !found;
  });
  return found;
}

Result<std::vector<DicomSeries>> ListDicomSeries(const std::string& path) {
  std::vector<std::string> paths = {path};
  std::error_code error;
  if (fs::is_directory(path, error)) {
    Result<std::vector<std::string>> found = FindDicomFiles(path);
    if (!found.ok()) return found.status();
    paths = *std::move(found);
    if (paths.empty()) return Status::InvalidArgument(path + ": no DICOM file in it or its sub-folders");
  }
  Result<std::vector<DicomImage>> images = ReadImages(paths);
  if (!images.ok()) return images.status();
  if (images->empty() && paths.front() == path) {  // a DICOMDIR
    const std::string folder = fs::path(path).parent_path().string();
    return ListDicomSeries(folder.empty() ? "." : folder);
  }
  std::map<std::string, DicomSeries> by_uid;
  for (DicomImage& image : *images) by_uid[image.series_uid].images.push_back(std::move(image));
  std::vector<DicomSeries> all;
  for (auto& [uid, series] : by_uid) {
    const DicomImage& first = series.images.front();
    series.uid = uid;
    series.number = first.number;
    series.modality = first.modality;
    series.description = first.description;
    Judge(series);
    series.trouble = Printable(series.trouble);  // it quotes texts of the file
    all.push_back(std::move(series));
  }
  std::ranges::stable_sort(all, {}, [](const DicomSeries& series) { return ParseNumber<double>(series.number).value_or(0); });
  return all;
}

Result<const DicomSeries*> ChooseSeries(const std::vector<DicomSeries>& all, const std::string& series, const std::string& path) {
  std::vector<const DicomSeries*> found;
  for (const DicomSeries& each : all) {
    const bool fits = series.empty() ? each.other.empty() : each.uid == series || each.number == series;
    if (fits) found.push_back(&each);
  }
  if (found.size() == 1) return found.front();
  if (!series.empty() && found.empty()) {
    std::vector<const DicomSeries*> listed;
    for (const DicomSeries& each : all) listed.push_back(&each);
    return Status::NotFound(fmt::format("{}: no series '{}' in it, but these: {}", path, series, DescribedAll(listed)));
  }
  if (!series.empty()) {
    return Status::InvalidArgument(fmt::format("{}: {} series have the number {}; choose one by its UID: --series {} or {}", path,
                                               found.size(), series, found[0]->uid, found[1]->uid));
  }
  if (!found.empty()) {
    return Status::InvalidArgument(
        fmt::format("{}: {} series in it are volumes, choose one with --series: {}", path, found.size(), DescribedAll(found)));
  }
  if (all.size() == 1 && !all.front().trouble.ok()) return &all.front();
  std::string kinds;
  for (const DicomSeries& each : all) {
    if (kinds.find(each.other) == std::string::npos) kinds += (kinds.empty() ? "" : ", ") + each.other;
  }
  return Status::InvalidArgument(
      fmt::format("{}: none of the {} series in it is a volume ({}); --series chooses one nevertheless", path, all.size(), kinds));
}

}  // namespace slabstream
