// DICOM: a folder, searched with its sub-folders, or one file. Positions, orientations and rescalings are those of the images; the
// definition of attributes is PS3.3, C.7.6.
#include <fmt/format.h>

#include "common/volume/memory_budget.h"
#include "common/volume_io/dicom_frames.h"
#include "common/volume_io/dicom_series.h"
#include "common/volume_io/raw_volume.h"

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

}  // namespace

Result<RawVolume> ReadDicom(const std::string& path, const ReadOptions& options) {
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
  RawVolume raw{.header = {.size = series.stack.size,
                           .world = World::kPatient,
                           .steps = series.stack.steps,
                           .origin = series.stack.origin,
                           .matrix = "ImageOrientationPatient",
                           .type = samples.type,
                           .rescale = samples.rescale},
                .bytes = {}};
  if (Status status = CheckFitsMemory(raw.header.sample_bytes(), path); !status.ok()) return status;
  raw.bytes.resize(std::size_t(raw.header.sample_bytes()));
  if (Status status = ReadFrames(frames, samples, raw.bytes); !status.ok()) return status;
  return raw;
}

}  // namespace slabstream
