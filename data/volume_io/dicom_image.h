// What a DICOM file says of its images: one, or the frames of a multi-frame file. Facts only, and none of the patient; which images make a
// volume is dicom_series.h's business.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/math/vec.h"
#include "common/volume/volume.h"
#include "data/volume_io/dicom_elements.h"
#include "data/volume_io/sample_type.h"

namespace slabstream {

// Attributes that may tell images at the same position apart, such as EchoTime; the most telling first.
std::size_t DistinctionCount();
const char* DistinctionName(std::size_t distinction);

// One slice. What the file does not say is absent; numbers are as in the file, and may be NaN.
struct DicomFrame {
  std::optional<Vec3> position;                   // ImagePositionPatient: of the first pixel, in mm to left, posterior, superior
  std::optional<std::array<Vec3, 2>> directions;  // ImageOrientationPatient: along a row, and down a column
  std::optional<std::array<double, 2>> spacing;   // along a row and down a column, mm: the reverse of PixelSpacing
  std::optional<double> slice_spacing;            // SpacingBetweenSlices, mm
  ValueMapping rescale;                           // RescaleSlope, RescaleIntercept
  int segment = 0;                                // ReferencedSegmentNumber of a segmentation; 0: none
  std::vector<std::string> distinctions;          // values, "" if absent; DistinctionCount() of them

  friend bool operator==(const DicomFrame&, const DicomFrame&) = default;
};

// How a pixel's bits are stored.
struct DicomPixelFormat {
  int bits_allocated = 0, bits_stored = 0, high_bit = 0;
  bool is_signed = false;
  bool is_float = false;  // floats of 32 or 64 bits; what is above then says nothing

  // The type of the pixels in memory, where a single bit takes a byte.
  SampleType type() const;
  friend bool operator==(const DicomPixelFormat&, const DicomPixelFormat&) = default;
};

// What the frames of a segmentation hold (PS3.3 C.8.20): bits of a segment each; shares of a segment each; or numbers of segments.
enum class DicomSegmentation { kNone, kBinary, kFractional, kLabelMap };

struct DicomSegment {
  int number = 0;  // SegmentNumber
  std::string label;
};

struct DicomImage {
  std::string path;
  std::string instance_uid;  // SOPInstanceUID, which copies share
  std::string series_uid, modality, description;
  std::string number;                      // SeriesNumber, as it is written
  bool localizer = false, mosaic = false;  // ImageType
  bool modality_lut = false;               // values come from a table instead of slope and intercept
  std::int32_t columns = 0, rows = 0;      // 0: the file has no image
  int samples_per_pixel = 1;
  std::string photometric;  // PhotometricInterpretation
  DicomPixelFormat format;
  std::string transfer_syntax;
  DicomPixelData pixels;
  std::vector<DicomFrame> frames;  // one or more
  DicomSegmentation segmentation = DicomSegmentation::kNone;
  std::vector<DicomSegment> segments;  // in the order of the file
  bool media_directory = false;        // DICOMDIR: it has no image, its folder is meant
  Status trouble;                      // why its frames cannot be read: the file has fewer than it claims, or they are no slices

  std::int64_t frame_pixels() const { return std::int64_t{columns} * rows; }
  // Bits of a frame as it is stored; frames follow each other without a gap. If a pixel has 1 bit, the lowest bit of a
  // byte is its first pixel.
  std::int64_t frame_bits() const { return frame_pixels() * format.bits_allocated; }
  bool is_segmentation() const { return segmentation != DicomSegmentation::kNone; }
  // The colours of a label map's palette stand for its labels.
  bool is_colour() const {
    return samples_per_pixel != 1 || (photometric == "PALETTE COLOR" && segmentation != DicomSegmentation::kLabelMap);
  }
};

// Errors as of ReadDicomFile.
Result<DicomImage> ReadDicomImage(const std::string& path);

}  // namespace slabstream
