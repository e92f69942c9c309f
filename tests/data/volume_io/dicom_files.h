// DICOM files, written by GDCM, whose writer knows nothing of our reader.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "data/volume_io/dicom_elements.h"
#include "tests/data/volume_io/stored_object.h"

namespace slabstream {

enum class DicomSyntax { kImplicit, kExplicit, kBigEndian, kJpegLossless, kJpegLs, kJpeg2000, kRle };

// Elements by tag. Values are text in the value representation that GDCM's dictionary has for the tag, numbers of binary ones too.
using DicomValues = std::map<DicomTag, std::string>;

inline constexpr DicomTag kTagImageType = 0x00080008, kTagModality = 0x00080060, kTagSeriesDescription = 0x0008103e,
                          kTagEchoTime = 0x00180081, kTagSeriesUid = 0x0020000e, kTagSeriesNumber = 0x00200011,
                          kTagInstanceNumber = 0x00200013, kTagPosition = 0x00200032, kTagOrientation = 0x00200037,
                          kTagSamplesPerPixel = 0x00280002, kTagPhotometric = 0x00280004, kTagFrames = 0x00280008, kTagRows = 0x00280010,
                          kTagColumns = 0x00280011, kTagPixelSpacing = 0x00280030, kTagBitsAllocated = 0x00280100,
                          kTagBitsStored = 0x00280101, kTagHighBit = 0x00280102, kTagPixelRepresentation = 0x00280103,
                          kTagIntercept = 0x00281052, kTagSlope = 0x00281053;

// A CT slice of 4 x 3 pixels at the origin, of type int16, in the series "1.2.3" with the number 1. No element is about a patient.
DicomValues SliceValues();
// The elements that say how samples of a type are stored.
DicomValues PixelValues(SampleType type);
// A point or direction of the patient's right, anterior, superior as DICOM writes it: left, posterior, superior; numbers between
// backslashes.
std::string Lps(const std::vector<Vec3>& ras);

struct DicomGroups {
  DicomTag sequence;
  DicomValues values;  // the values of its only item
};

struct DicomSpec {
  DicomValues values = SliceValues();
  FileBytes pixels;  // in little endian; empty: none
  // Compressed frames, one each, instead of pixels, and their transfer syntax (UID).
  std::vector<FileBytes> frames = {};
  std::string frames_syntax = {};
  DicomSyntax syntax = DicomSyntax::kExplicit;
  // Functional groups of a multi-frame image: of all frames, and of each.
  std::vector<DicomGroups> shared;
  std::vector<std::vector<DicomGroups>> per_frame;
  std::vector<std::pair<DicomTag, std::vector<DicomValues>>> sequences = {};  // further ones, with the values of their items
};

void WriteDicom(const std::string& path, const DicomSpec& spec);

// An element as explicit little endian has it, with any length; without a type as implicit has it.
FileBytes DicomElement(DicomTag tag, std::string_view type, std::uint32_t length, const FileBytes& value = "");
// Where the data set of a file of WriteDicom begins, behind its file meta information.
std::size_t BeginOfDataSet(const FileBytes& file);

// The slices of a stored object as a series: one file each, whose names and InstanceNumbers are in no order. `changed`: elements that
// differ from SliceValues(). Samples are of type `type`, in little endian.
void WriteSeries(const std::string& directory, const Stored& stored, SampleType type = SampleType::kUint8, const DicomValues& changed = {},
                 DicomSyntax syntax = DicomSyntax::kExplicit);

}  // namespace slabstream
