// The headers of NIfTI-1, NIfTI-2 and Analyze 7.5, as far as they say what samples are and where they lie. Fields, numbers and formulas are
// those of nifti1.h and nifti2.h, the formats' definitions.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "data/volume_io/raw_volume.h"

namespace slabstream {

inline constexpr std::int32_t kNifti1Bytes = 348, kNifti2Bytes = 540;  // sizes of headers, which begin with this number

struct NiftiHeader {
  std::string_view version;  // "NIfTI-1", "NIfTI-2" or "Analyze 7.5"
  bool analyze = false;
  bool pair = false;  // the samples are in a file of their own
  bool big_endian = false;
  std::vector<double> sizes;    // dim[1] ... dim[dim[0]]; empty: dim[0] is not in [1, 7]
  std::int64_t dimensions = 0;  // dim[0]
  int data_type = 0, intent = 0, unit = 0, time_unit = 0;
  double qfac = 1;
  Vec3 spacing;          // pixdim[1] to pixdim[3]
  double time_step = 0;  // pixdim[4]
  double vox_offset = 0, slope = 0, intercept = 0;
  int qform_code = 0, sform_code = 0;
  Vec3 quaternion, qoffset;  // b, c, d
  std::array<double, 12> srow{};
};

// The number that the header begins with, in either byte order: kNifti1Bytes or kNifti2Bytes. 0: it is neither.
std::size_t NiftiHeaderBytes(std::span<const std::byte, 4> first);

// `bytes`: as many as the header has. None: neither it nor the name of its file says that it is one of those. `single`: the file is named
// .nii, so that it is no Analyze 7.5, whose header has no mark.
std::optional<NiftiHeader> ParseNifti(std::span<const std::byte> bytes, bool single);

inline constexpr int kNiftiRgb = 128, kNiftiRgba = 2304;  // NIFTI_TYPE_RGB24, NIFTI_TYPE_RGBA32

// NIFTI_TYPE_... The first number of a type is the one that is written. The last three are SPM's, in Analyze 7.5.
inline constexpr std::array<std::pair<int, SampleType>, 15> kNiftiTypes = {{{2, SampleType::kUint8},
                                                                            {4, SampleType::kInt16},
                                                                            {8, SampleType::kInt32},
                                                                            {16, SampleType::kFloat32},
                                                                            {64, SampleType::kFloat64},
                                                                            {256, SampleType::kInt8},
                                                                            {512, SampleType::kUint16},
                                                                            {768, SampleType::kUint32},
                                                                            {1024, SampleType::kInt64},
                                                                            {1280, SampleType::kUint64},
                                                                            {kNiftiRgb, SampleType::kUint8},
                                                                            {kNiftiRgba, SampleType::kUint8},
                                                                            {130, SampleType::kInt8},
                                                                            {132, SampleType::kUint16},
                                                                            {136, SampleType::kUint32}}};

// NIFTI_UNITS_...
struct NiftiUnit {
  int code;
  LengthUnit unit;
  double millimetres;
};
inline constexpr std::array<NiftiUnit, 3> kNiftiUnits = {
    {{1, LengthUnit::kMetre, 1000}, {2, LengthUnit::kMillimetre, 1}, {3, LengthUnit::kMicrometre, 0.001}}};

// Places the volume: steps, origin, world and unit of `header`, whose size is known. The sform counts if its code is above 0, else the
// qform if its code is, else there is only the spacing, as in nibabel, FSL and SPM; `matrix`, unless it is empty, says which. A note tells
// which it was, and if both are stated, how far they place the corners of the volume apart. InvalidArgument, naming `path`: `matrix` is not
// stated, or the qform that counts has a quaternion that is none.
Status PlaceNifti(const NiftiHeader& fields, const std::string& path, std::string_view matrix, RawHeader& header);

}  // namespace slabstream
