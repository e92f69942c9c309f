// DICOM: a folder, searched with its sub-folders, or one file. Positions, orientations and rescalings are those of the images; the
// definition of attributes is PS3.3, C.7.6.
#include <fmt/format.h>

#include <filesystem>

#include "data/volume_io/dicom_frames.h"
#include "data/volume_io/dicom_series.h"
#include "data/volume_io/formats.h"
#include "data/volume_io/slice_stack.h"

namespace slabstream {
namespace {

// The frames of a series in the order of its stack.
std::vector<DicomFrameNumber> StackedFrames(const DicomSeries& series) {
  std::vector<DicomFrameNumber> frames, stacked;
  for (const DicomImage& image : series.images) {
    for (std::size_t i = 0; i < image.frames.size(); ++i) frames.push_back({&image, i});
  }
  for (const std::size_t i : series.stack.order) stacked.push_back(frames[i]);
  return stacked;
}

// A folder that holds files of other formats is not taken for DICOM, even if DICOM files lie in it or below it.
bool Recognises(const std::string& path, const ReadOptions&) {
  std::error_code error;
  return std::filesystem::is_directory(path, error) ? !HasVolumeFiles(path) && HoldsDicom(path) : BeginsLikeDicom(path);
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
  const std::vector<DicomFrameNumber> frames = StackedFrames(series);
  const DicomSamples samples = SamplesOf(frames);
  const RawHeader header{.size = series.stack.size,
                         .world = World::kPatient,
                         .steps = series.stack.steps,
                         .origin = series.stack.origin,
                         .matrix = "ImageOrientationPatient",
                         .type = samples.type,
                         .rescale = samples.rescale};
  Result<RawVolume> raw = TakeMemory(path, header, options);
  if (!raw.ok()) return raw;
  std::error_code error;
  const bool elsewhere = frames.front().image->path != path && !std::filesystem::is_directory(path, error);
  if (elsewhere) raw->other_files = {std::filesystem::absolute(path, error).parent_path()};  // a DICOMDIR stands for its folder
  if (options.headers_only) return raw;
  if (Status status = ReadFrames(frames, samples, raw->bytes, options.progress); !status.ok()) return status;
  return raw;
}

}  // namespace

VolumeFormat Dicom() {
  return {
      .name = "DICOM", .endings = {}, .also = "DICOM, a folder or a file", .recognises = Recognises, .options = {"series"}, .read = Read};
}

bool IsDicom(const std::string& path) {
  const VolumeFormat* const format = FindFormat(path, {});
  return format != nullptr && format->read == Read;
}

}  // namespace slabstream
