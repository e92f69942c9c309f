// The series of a DICOM folder or file: which there are, which of them could be volumes, and why the others are not.
//
// A folder is searched with all its sub-folders, as exports have them; a DICOMDIR stands for its folder. Files are recognised by their
// bytes (DICM at byte 128), not by their names. Images belong together by their SeriesInstanceUID.
#pragma once

#include <string>
#include <vector>

#include "common/base/status.h"
#include "data/volume_io/dicom_image.h"
#include "data/volume_io/dicom_stack.h"

namespace slabstream {

inline constexpr std::size_t kMaxFilesLookedAt = std::size_t{1} << 18;  // files of a folder

struct DicomSeries {
  // Texts of the files; they may hold anything.
  std::string uid, number, modality, description;
  std::vector<DicomImage> images;
  std::size_t copies = 0;  // images that are left out, since they have the SOPInstanceUID and the pixels of one of these
  // What it is instead of a volume, such as "a localizer"; empty: it is chosen if it is the only one.
  std::string other;
  Status trouble;    // not ok: why it cannot be read; Printable
  DicomStack stack;  // all frames of all images, one image after the other; if there is no trouble

  std::size_t frame_count() const;
};

// Whether a volume of this path would be read as DICOM (formats.h).
bool IsDicom(const std::string& path);

// Whether there is any DICOM file in it. Errors count as no.
bool HoldsDicom(const std::string& directory);

// By number, then by UID; reads no pixels. `path`: a folder or a file. InvalidArgument: no DICOM file in it, or more than kMaxFilesLookedAt
// files; else errors as of ReadDicomFile.
Result<std::vector<DicomSeries>> ListDicomSeries(const std::string& path);

// The series with this UID or number; "": the only one that could be a volume. NotFound: there is none. InvalidArgument: there are several.
// Messages name `path` and the option `series`. Series in trouble are returned as well.
Result<const DicomSeries*> ChooseSeries(const std::vector<DicomSeries>& all, const std::string& series, const std::string& path);

}  // namespace slabstream
