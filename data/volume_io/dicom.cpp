// DICOM: a folder, searched with its sub-folders, or one file. Positions, orientations and rescalings are those of the images; the
// definition of attributes is PS3.3, C.7.6.
#include <fmt/format.h>

#include <filesystem>
#include <span>

#include "data/volume_io/dicom_frames.h"
#include "data/volume_io/dicom_segments.h"
#include "data/volume_io/dicom_series.h"
#include "data/volume_io/formats.h"
#include "data/volume_io/slice_stack.h"

namespace slabstream {
namespace {

// The frames of a volume of the series, in the order of its stack.
std::vector<DicomFrameNumber> StackedFrames(const DicomSeries& series, std::int64_t volume) {
  std::vector<DicomFrameNumber> frames, stacked;
  for (const DicomImage& image : series.images) {
    for (std::size_t i = 0; i < image.frames.size(); ++i) frames.push_back({&image, i});
  }
  const std::size_t count = std::size_t(series.stack.size.z), begin = std::size_t(volume) * count;
  for (std::size_t i = begin; i < begin + count; ++i) stacked.push_back(frames[series.stack.order[i]]);
  return stacked;
}

// A folder that holds files of other formats is not taken for DICOM, even if DICOM files lie in it or below it.
bool Recognises(const std::string& path, const ReadOptions&) {
  std::error_code error;
  return std::filesystem::is_directory(path, error) ? !HasVolumeFiles(path) && HoldsDicom(path) : BeginsLikeDicom(path);
}

Result<RawVolume> ReadStack(const std::string& path, const DicomSeries& series, RawHeader header, const ReadOptions& options) {
  const std::vector<DicomFrameNumber> frames = StackedFrames(series, header.number);
  const DicomSamples samples = SamplesOf(frames);
  header.type = samples.type;
  header.rescale = samples.rescale;
  if (samples.as_values) header.notes.emplace_back("slices differ in RescaleSlope, RescaleIntercept or their type: voxels are data values");
  Result<RawVolume> raw = TakeMemory(path, header, options);
  if (!raw.ok() || options.headers_only) return raw;
  Result<DicomFrameReader> reader = DicomFrameReader::Start(frames, samples);
  if (!reader.ok()) return reader.status();
  const std::size_t slice_bytes = raw->bytes.size() / frames.size();
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (Status status = reader->Read(std::span(raw->bytes).subspan(i * slice_bytes, slice_bytes)); !status.ok()) return status;
    if (options.progress != nullptr) options.progress->Add(std::int64_t(slice_bytes));
  }
  return raw;
}

Result<RawVolume> Read(const std::string& path, const ReadOptions& options) {
  const Result<std::vector<DicomSeries>> all = ListDicomSeries(path);
  if (!all.ok()) return all.status();
  const Result<const DicomSeries*> chosen = ChooseSeries(*all, options.series, path);
  if (!chosen.ok()) return chosen.status();
  const DicomSeries& series = **chosen;
  if (!series.trouble.ok()) {
    return Status(series.trouble.code(), fmt::format("{}: series {}: {}", path, series.number, series.trouble.message()));
  }
  const DicomImage& first = series.images.front();
  RawHeader header{.size = series.stack.size,
                   .times = series.stack.times,
                   .world = World::kPatient,
                   .steps = series.stack.steps,
                   .origin = series.stack.origin,
                   .matrix = "ImageOrientationPatient"};
  const std::string& told_apart = series.stack.told_apart;
  const Result<std::int64_t> volume = ChosenVolume(
      told_apart.empty() ? path : fmt::format("{}: series {}, of {}", path, series.number, told_apart), header.times.count, options);
  if (!volume.ok()) return volume.status();
  header.number = *volume;
  if (!told_apart.empty()) header.notes.push_back(fmt::format("times are told apart by {}", told_apart));
  if (series.copies > 0) {
    header.notes.push_back(
        fmt::format("{} copies of its images, of the same SOPInstanceUID and the same pixels, are left out", series.copies));
  }
  if (first.photometric == "MONOCHROME1") {
    header.notes.emplace_back("MONOCHROME1: low values are meant to be bright; values are not inverted");
  }
  Result<RawVolume> raw = first.is_segmentation() ? ReadSegments(path, series, std::move(header), options)
                                                  : ReadStack(path, series, std::move(header), options);
  std::error_code error;
  const bool elsewhere = first.path != path && !std::filesystem::is_directory(path, error);
  if (raw.ok() && elsewhere) raw->other_files = {std::filesystem::absolute(path, error).parent_path()};  // a DICOMDIR stands for its folder
  return raw;
}

}  // namespace

VolumeFormat Dicom() {
  return {.name = "DICOM",
          .endings = {},
          .also = "DICOM, a folder or a file",
          .recognises = Recognises,
          .options = {"series", "time", "channel"},
          .read = Read};
}

bool IsDicom(const std::string& path) {
  const VolumeFormat* const format = FindFormat(FileFormats(), path, {});
  return format != nullptr && format->read == Read;
}

}  // namespace slabstream
