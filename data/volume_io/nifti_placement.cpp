// Where NIfTI's headers place a volume.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>

#include "data/volume_io/nifti_header.h"
#include "data/volume_io/world_placement.h"

namespace slabstream {
namespace {

struct Placement {
  std::array<Vec3, 3> steps;
  Vec3 origin;

  Vec3 At(const Vec3& voxel) const { return origin + voxel.x * steps[0] + voxel.y * steps[1] + voxel.z * steps[2]; }
};

Placement Sform(const NiftiHeader& fields, double millimetres) {
  const auto column = [&](std::size_t i) { return millimetres * Vec3{fields.srow[i], fields.srow[4 + i], fields.srow[8 + i]}; };
  return {{column(0), column(1), column(2)}, column(3)};
}

// None: the quaternion is longer than rounding makes it.
std::optional<Placement> Qform(const NiftiHeader& fields, double millimetres) {
  constexpr double kMostSquare = 1.01;
  auto [b, c, d] = fields.quaternion;
  const double square = b * b + c * c + d * d;
  if (square > kMostSquare) return std::nullopt;
  const double a = std::sqrt(std::max(0.0, 1 - square)), scale = square > 1 ? 1 / std::sqrt(square) : 1;
  b *= scale;
  c *= scale;
  d *= scale;
  // As nibabel and ITK: no distance may be 0 or negative.
  Vec3 spacing;
  for (int i = 0; i < 3; ++i) spacing[i] = millimetres * (fields.spacing[i] == 0 ? 1 : std::abs(fields.spacing[i]));
  if (fields.qfac < 0) spacing.z = -spacing.z;
  return Placement{{spacing.x * Vec3{a * a + b * b - c * c - d * d, 2 * (b * c + a * d), 2 * (b * d - a * c)},
                    spacing.y * Vec3{2 * (b * c - a * d), a * a + c * c - b * b - d * d, 2 * (c * d + a * b)},
                    spacing.z * Vec3{2 * (b * d + a * c), 2 * (c * d - a * b), a * a + d * d - b * b - c * c}},
                   millimetres * fields.qoffset};
}

// The largest distance between the places of a corner of the volume.
double LargestDistance(const Placement& a, const Placement& b, const Index3& size) {
  double largest = 0;
  for (unsigned corner = 0; corner < 8; ++corner) {
    Vec3 voxel;
    for (int i = 0; i < 3; ++i) voxel[i] = (corner >> i & 1) != 0 ? size[i] - 1 : 0;
    const double distance = Length(a.At(voxel) - b.At(voxel));
    if (!(distance <= largest)) largest = distance;  // not a number is far
  }
  return largest;
}

// NIFTI_XFORM_...
std::string CodeText(std::string_view matrix, int code) {
  constexpr std::array<std::string_view, 6> kMeanings = {"", "scanner", "aligned", "Talairach", "MNI 152", "template"};
  return fmt::format("{} (code {}: {})", matrix, code, std::size_t(code) < kMeanings.size() ? kMeanings[std::size_t(code)] : "unknown");
}

}  // namespace

Status PlaceNifti(const NiftiHeader& fields, const std::string& path, std::string_view matrix, RawHeader& header) {
  const auto wrong = [&](const std::string& why) { return Status::InvalidArgument(path + ": " + why); };
  const auto* const unit = std::ranges::find(kNiftiUnits, fields.unit, &NiftiUnit::code);
  const double millimetres = unit == kNiftiUnits.end() ? 1 : unit->millimetres;
  if (unit != kNiftiUnits.end()) header.unit = LengthUnit::kMillimetre;
  header.steps = StepsOf(millimetres * fields.spacing);
  const bool has_sform = fields.sform_code > 0, has_qform = fields.qform_code > 0;
  if ((matrix == "sform" && !has_sform) || (matrix == "qform" && !has_qform)) {
    return wrong(fmt::format("matrix is {}, but the file states none: {}_code is {}", matrix, matrix,
                             matrix == "sform" ? fields.sform_code : fields.qform_code));
  }
  if (!has_sform && !has_qform) {
    header.notes.push_back(fmt::format("{} states the spacing alone: neither directions of axes nor which side is left", fields.version));
    return Status::Ok();
  }
  const bool takes_sform = has_sform && matrix != "qform";
  const std::optional<Placement> qform = has_qform ? Qform(fields, millimetres) : std::nullopt;
  if (!takes_sform && !qform) {
    return wrong(
        fmt::format("qform: b, c and d of the quaternion are {}, whose squares must add up to at most 1", InBrackets(fields.quaternion)));
  }
  const Placement taken = takes_sform ? Sform(fields, millimetres) : *qform;
  header.world = World::kPatient;
  header.matrix = !takes_sform ? "qform" : has_qform ? "sform (--matrix qform takes the other one)" : "sform";
  header.steps = taken.steps;
  header.origin = taken.origin;

  const std::string sform_text = CodeText("sform", fields.sform_code), qform_text = CodeText("qform", fields.qform_code);
  std::string note = fmt::format("placed by the {}", takes_sform ? sform_text : qform_text);
  if (has_sform && has_qform) {
    const std::string_view other = takes_sform ? "qform" : "sform";
    const std::string& other_text = takes_sform ? qform_text : sform_text;
    constexpr double kAgree = 0.01;  // of a voxel
    const double apart = qform ? LargestDistance(Sform(fields, millimetres), *qform, header.size) : 0;
    const double voxel = std::min({Length(taken.steps[0]), Length(taken.steps[1]), Length(taken.steps[2])});
    if (!qform) {
      note += fmt::format("; the {} has no valid quaternion", other_text);
    } else if (apart < kAgree * voxel) {
      note += fmt::format("; the {} agrees", other_text);
    } else {
      note += fmt::format("; the {} places corners up to {:.3g} mm away: --matrix {} takes it", other_text, apart, other);
    }
  }
  header.notes.push_back(std::move(note));
  if (!takes_sform && (fields.spacing.x == 0 || fields.spacing.y == 0 || fields.spacing.z == 0)) {
    header.notes.push_back(fmt::format("the spacing of the qform is {}, where 0 is taken as 1", InBrackets(fields.spacing)));
  }
  return Status::Ok();
}

}  // namespace slabstream
