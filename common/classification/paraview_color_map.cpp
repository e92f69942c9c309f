// ParaView's colour-map JSON, as Edit Color Map > Choose Preset > Export writes it.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <ranges>
#include <string_view>
#include <utility>

#include "common/base/printable.h"
#include "common/classification/transfer_function.h"
#include "common/json/json.h"

namespace slabstream {
namespace {

constexpr std::size_t kNumbersPerPoint = 4;  // of both curves

// The numbers of one curve. Errors name the field; the caller adds the name of the file.
Result<std::vector<double>> ReadCurve(const Json& preset, const char* field) {
  const Json& array = preset.at(field);
  if (!array.is_array()) return Status::InvalidArgument(std::string(field) + " is not an array");
  if (array.empty() || array.size() % kNumbersPerPoint != 0 || array.size() / kNumbersPerPoint > std::size_t{kMaxTransferPoints}) {
    return Status::InvalidArgument(
        fmt::format("{} has {} numbers, must be 4 a point and 1 to {} points", field, array.size(), kMaxTransferPoints));
  }
  std::vector<double> numbers;
  numbers.reserve(array.size());
  for (const Json& number : array) {
    if (!number.is_number()) return Status::InvalidArgument(fmt::format("{}[{}] is not a number", field, numbers.size()));
    numbers.push_back(number.get<double>());
  }
  return numbers;
}

constexpr const char* kMaterial = "Material";
constexpr std::array<std::pair<std::string_view, float Material::*>, 4> kMaterialFields = {{{"ambient", &Material::ambient},
                                                                                            {"diffuse", &Material::diffuse},
                                                                                            {"specular", &Material::specular},
                                                                                            {"shininess", &Material::shininess}}};

Result<Material> ReadMaterial(const Json& json) {
  if (!json.is_object()) return Status::InvalidArgument(fmt::format("{} is not an object", kMaterial));
  Material material;
  for (const auto& [name, value] : json.items()) {
    const auto* const field = std::ranges::find(kMaterialFields, name, [](const auto& each) { return each.first; });
    if (field == kMaterialFields.end()) {
      return Status::InvalidArgument(
          fmt::format("{} has the field \"{}\", must be one of: {}", kMaterial, name, fmt::join(kMaterialFields | std::views::keys, ", ")));
    }
    if (!value.is_number()) return Status::InvalidArgument(fmt::format("{}.{} is not a number", kMaterial, name));
    material.*field->second = value.get<float>();
  }
  return material;
}

// Numbers of a field of a region: `least` to `most`, `step` of them a time.
Result<std::vector<double>> ReadNumbers(const Json& region, const char* field, std::size_t least, std::size_t most, std::size_t step) {
  const Json& array = region.at(field);
  const auto wrong = [&](std::string_view why) { return Status::InvalidArgument(fmt::format("{} {}", field, why)); };
  if (!array.is_array()) return wrong("is not an array");
  if (array.size() < least || array.size() > most || array.size() % step != 0) {
    return wrong(least == most ? fmt::format("has {} numbers, must have {}", array.size(), least)
                               : fmt::format("has {} numbers, must have {} to {}, {} a corner", array.size(), least, most, step));
  }
  std::vector<double> numbers;
  for (const Json& number : array) {
    if (!number.is_number()) return wrong(fmt::format("has something at {} that is not a number", numbers.size()));
    numbers.push_back(number.get<double>());
  }
  return numbers;
}

constexpr const char *kRegions = "Regions", *kCorners = "Corners", *kValues = "Values", *kSlopes = "Slopes", *kColor = "Color",
                     *kOpacity = "Opacity", *kSoftness = "Softness";
constexpr std::array<std::string_view, 6> kRegionFields = {kCorners, kValues, kSlopes, kColor, kOpacity, kSoftness};

Result<TransferRegion> ReadRegion(const Json& json) {
  if (!json.is_object()) return Status::InvalidArgument("is not an object");
  for (const auto& [name, value] : json.items()) {
    if (std::ranges::find(kRegionFields, name) != kRegionFields.end()) continue;
    return Status::InvalidArgument(fmt::format("has the field \"{}\", must be one of: {}", name, fmt::join(kRegionFields, ", ")));
  }
  if (json.contains(kCorners) == (json.contains(kValues) && json.contains(kSlopes)) || json.contains(kValues) != json.contains(kSlopes)) {
    return Status::InvalidArgument(fmt::format("must have either {} or {} and {}", kCorners, kValues, kSlopes));
  }
  if (!json.contains(kColor)) return Status::InvalidArgument(fmt::format("has no {}", kColor));
  TransferRegion region;
  if (json.contains(kCorners)) {
    const Result<std::vector<double>> corners = ReadNumbers(json, kCorners, 6, 2 * std::size_t{kMaxRegionCorners}, 2);
    if (!corners.ok()) return corners.status();
    for (std::size_t i = 0; i < corners->size(); i += 2) region.corners.push_back({(*corners)[i], (*corners)[i + 1]});
  } else {
    const Result<std::vector<double>> values = ReadNumbers(json, kValues, 2, 2, 1), slopes = ReadNumbers(json, kSlopes, 2, 2, 1);
    if (!values.ok()) return values.status();
    if (!slopes.ok()) return slopes.status();
    const double from = (*values)[0], to = (*values)[1], least = (*slopes)[0], most = (*slopes)[1];
    region.corners = {{from, least}, {to, least}, {to, most}, {from, most}};
  }
  const Result<std::vector<double>> color = ReadNumbers(json, kColor, 3, 3, 1);
  if (!color.ok()) return color.status();
  region.color = {float((*color)[0]), float((*color)[1]), float((*color)[2])};
  const auto read = [&](const char* field, double& number) {
    if (!json.contains(field)) return Status::Ok();
    if (!json.at(field).is_number()) return Status::InvalidArgument(fmt::format("{} is not a number", field));
    number = json.at(field).get<double>();
    return Status::Ok();
  };
  if (Status status = read(kOpacity, region.opacity); !status.ok()) return status;
  if (Status status = read(kSoftness, region.softness); !status.ok()) return status;
  return region;
}

Status ReadRegions(const Json& array, TransferFunction& transfer) {
  if (!array.is_array() || array.empty() || array.size() > std::size_t{kMaxTransferRegions}) {
    return Status::InvalidArgument(fmt::format("{} must be an array of 1 to {} regions", kRegions, kMaxTransferRegions));
  }
  for (const Json& json : array) {
    Result<TransferRegion> region = ReadRegion(json);
    if (!region.ok())
      return Status::InvalidArgument(fmt::format("{}[{}] {}", kRegions, transfer.regions.size(), region.status().message()));
    transfer.regions.push_back(*std::move(region));
  }
  return Status::Ok();
}

Status ReadCurves(const Json& preset, TransferFunction& transfer) {
  if (!preset.contains("RGBPoints")) return Status::InvalidArgument("not a colour map: RGBPoints is missing");
  Result<std::vector<double>> colors = ReadCurve(preset, "RGBPoints");
  if (!colors.ok()) return colors.status();
  for (std::size_t i = 0; i < colors->size(); i += kNumbersPerPoint) {
    const double* p = colors->data() + i;
    transfer.colors.push_back({p[0], {float(p[1]), float(p[2]), float(p[3])}});
  }

  if (preset.contains("Points")) {
    Result<std::vector<double>> opacities = ReadCurve(preset, "Points");
    if (!opacities.ok()) return opacities.status();
    for (std::size_t i = 0; i < opacities->size(); i += kNumbersPerPoint) {
      const double* p = opacities->data() + i;
      // VTK takes midpoints of 0 and 1 too, as this close to the end.
      constexpr double kEdge = 1e-5;
      const double midpoint = p[2] == 0 ? kEdge : p[2] == 1 ? 1 - kEdge : p[2];
      transfer.opacities.push_back({p[0], p[1], midpoint, p[3]});
    }
  } else {
    transfer.opacities = {{transfer.colors.front().value, 0}, {transfer.colors.back().value, 1}};
  }
  return Status::Ok();
}

Result<TransferFunction> ReadPreset(const Json& preset) {
  if (!preset.is_object()) return Status::InvalidArgument("not a colour map: expected an object or an array of objects");
  TransferFunction transfer;
  const bool has_regions = preset.contains(kRegions);
  if (has_regions && (preset.contains("RGBPoints") || preset.contains("Points"))) {
    return Status::InvalidArgument(fmt::format("{} stand in the place of RGBPoints and Points: one of both must go", kRegions));
  }
  if (Status status = has_regions ? ReadRegions(preset.at(kRegions), transfer) : ReadCurves(preset, transfer); !status.ok()) return status;
  if (preset.contains(kMaterial)) {
    Result<Material> material = ReadMaterial(preset.at(kMaterial));
    if (!material.ok()) return material.status();
    transfer.material = *material;
  }
  if (Status status = Validate(transfer); !status.ok()) return status;
  return WithCurvesOfRegions(std::move(transfer));
}

}  // namespace

Result<TransferFunction> ParseParaViewColorMap(std::string_view json, std::string_view name) {
  const auto failed = [&](const std::string& why) { return Printable(Status::InvalidArgument(std::string(name) + ": " + why)); };
  const Result<Json> document = Json::Parse(json);
  if (!document.ok()) return failed(document.status().message());
  if (document->is_array() && document->empty()) return failed("not a colour map: the array is empty");
  Result<TransferFunction> transfer = ReadPreset(document->is_array() ? document->front() : *document);
  if (!transfer.ok()) return failed(transfer.status().message());
  return transfer;
}

std::string FormatParaViewColorMap(const TransferFunction& transfer, std::string_view name) {
  std::vector<double> colors, opacities;
  for (const ColorPoint& p : transfer.colors) colors.insert(colors.end(), {p.value, p.color.r, p.color.g, p.color.b});
  for (const OpacityPoint& p : transfer.opacities) opacities.insert(opacities.end(), {p.value, p.opacity, p.midpoint, p.sharpness});
  Json preset = {{"Name", name}};
  if (transfer.regions.empty()) {
    preset.update({{"ColorSpace", "RGB"}, {"RGBPoints", colors}, {"Points", opacities}});
  }
  for (const auto& [corners, color, opacity, softness] : transfer.regions) {
    std::vector<double> numbers;
    for (const auto& [value, slope] : corners) numbers.insert(numbers.end(), {value, slope});
    preset[kRegions].push_back({{kCorners, numbers}, {kColor, {color.r, color.g, color.b}}, {kOpacity, opacity}, {kSoftness, softness}});
  }
  for (const auto& [field, number] : kMaterialFields) {
    if (transfer.material) preset[kMaterial][std::string(field)] = (*transfer.material).*number;
  }
  return Json::array({preset}).dump(2) + "\n";
}

}  // namespace slabstream
