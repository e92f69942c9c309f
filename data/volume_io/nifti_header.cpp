#include "data/volume_io/nifti_header.h"

#include <cstring>

#include "data/volume_io/binary_header.h"

namespace slabstream {
namespace {

// Where each field lies.
struct Layout {
  std::size_t magic, dim, intent, data_type, pixdim, vox_offset, slope, intercept, unit, qform_code, sform_code, quaternion, qoffset, srow;
};
constexpr Layout kNifti1 = {344, 40, 68, 70, 76, 108, 112, 116, 123, 252, 254, 256, 268, 280};
constexpr Layout kNifti2 = {4, 16, 504, 12, 104, 168, 176, 184, 500, 344, 348, 352, 376, 400};

template <class Size, class Code, class Intent, class Real, class Offset, class Unit>
NiftiHeader FieldsOf(const BinaryHeader& bytes, const Layout& at) {
  const auto real = [&](std::size_t offset, std::size_t i) { return double(bytes.At<Real>(offset + i * sizeof(Real))); };
  const auto reals = [&](std::size_t offset) { return Vec3{real(offset, 0), real(offset, 1), real(offset, 2)}; };
  NiftiHeader header{.dimensions = bytes.At<Size>(at.dim),
                     .data_type = bytes.At<std::int16_t>(at.data_type),
                     .intent = bytes.At<Intent>(at.intent),
                     .unit = int(bytes.At<Unit>(at.unit)) & 7,
                     .time_unit = int(bytes.At<Unit>(at.unit)) & 56,
                     .qfac = real(at.pixdim, 0),
                     .spacing = reals(at.pixdim + sizeof(Real)),
                     .time_step = real(at.pixdim, 4),
                     .vox_offset = double(bytes.At<Offset>(at.vox_offset)),
                     .slope = real(at.slope, 0),
                     .intercept = real(at.intercept, 0),
                     .qform_code = bytes.At<Code>(at.qform_code),
                     .sform_code = bytes.At<Code>(at.sform_code),
                     .quaternion = reals(at.quaternion),
                     .qoffset = reals(at.qoffset)};
  constexpr std::int64_t kMostDimensions = 7;
  if (header.dimensions >= 1 && header.dimensions <= kMostDimensions) {
    for (std::size_t i = 1; i <= std::size_t(header.dimensions); ++i)
      header.sizes.push_back(double(bytes.At<Size>(at.dim + i * sizeof(Size))));
  }
  for (std::size_t i = 0; i < header.srow.size(); ++i) header.srow[i] = real(at.srow, i);
  return header;
}

}  // namespace

std::size_t NiftiHeaderBytes(std::span<const std::byte, 4> first) {
  for (const bool big_endian : {false, true}) {
    const auto bytes = BinaryHeader(first, big_endian).At<std::int32_t>(0);
    if (bytes == kNifti1Bytes || bytes == kNifti2Bytes) return std::size_t(bytes);
  }
  return 0;
}

std::optional<NiftiHeader> ParseNifti(std::span<const std::byte> bytes, bool single) {
  const bool second = bytes.size() == std::size_t{kNifti2Bytes};
  const bool big_endian = BinaryHeader(bytes, false).At<std::int32_t>(0) != std::int32_t(bytes.size());
  const Layout& at = second ? kNifti2 : kNifti1;
  const auto has_magic = [&](const char* magic) { return std::memcmp(bytes.data() + at.magic, magic, 4) == 0; };
  const bool in_one_file = has_magic(second ? "n+2" : "n+1"), pair = has_magic(second ? "ni2" : "ni1");
  const bool analyze = !in_one_file && !pair;
  if (analyze && (second || single)) return std::nullopt;
  const BinaryHeader fields(bytes, big_endian);
  NiftiHeader header = second ? FieldsOf<std::int64_t, std::int32_t, std::int32_t, double, std::int64_t, std::int32_t>(fields, kNifti2)
                              : FieldsOf<std::int16_t, std::int16_t, std::int16_t, float, float, std::uint8_t>(fields, kNifti1);
  header.version = second ? "NIfTI-2" : analyze ? "Analyze 7.5" : "NIfTI-1";
  header.big_endian = big_endian;
  header.analyze = analyze;
  header.pair = pair || analyze;
  // Analyze 7.5 has a scale factor where SPM put one, and nothing else of NIfTI's fields.
  if (analyze) header.intent = header.unit = header.time_unit = header.qform_code = header.sform_code = 0, header.intercept = 0;
  return header;
}

}  // namespace slabstream
