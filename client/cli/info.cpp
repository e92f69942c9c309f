#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>
#include <numeric>
#include <string_view>

#include "client/cli/commands.h"
#include "client/cli/input_volume.h"
#include "common/planning/frame_plan.h"
#include "common/volume/summary.h"

namespace slabstream {
namespace {

std::string_view NameOf(ScalarType type) {
  switch (type) {
    case ScalarType::kUint8: return "uint8";
    case ScalarType::kUint16: return "uint16";
    case ScalarType::kFloat32: break;
  }
  return "float32";
}

std::string TransferName(const TransferChoice& transfer) {
  const auto* preset = std::get_if<std::string>(&transfer.choice);
  return preset != nullptr ? *preset : "file";
}

// The histogram in kRows rows. Bars are logarithmic: empty space outnumbers everything else in most volumes.
std::string HistogramText(const VolumeSummary& summary) {
  constexpr int kRows = 16, kBarWidth = 50;
  static_assert(kHistogramBins % kRows == 0);
  const int bins = kHistogramBins / kRows;
  std::array<std::uint64_t, kRows> rows{};
  for (int i = 0; i < kHistogramBins; ++i) rows[std::size_t(i / bins)] += summary.histogram[std::size_t(i)];
  const double most = std::log1p(double(*std::max_element(rows.begin(), rows.end())));
  std::string text;
  for (int row = 0; row < kRows; ++row) {
    const double width = (double(summary.range.max) - summary.range.min) / kRows;
    const std::uint64_t count = rows[std::size_t(row)];
    const int bar = most > 0 ? int(std::ceil(kBarWidth * std::log1p(double(count)) / most)) : 0;
    text += fmt::format("  {:>12.6g} {:>12} {}\n", summary.range.min + width * row, count, std::string(std::size_t(bar), '#'));
  }
  return text;
}

std::string InfoText(const VolumeFileInfo& info, const VolumeSummary& summary, const std::string& transfer, double occupancy) {
  const VolumeDescription& d = info.description;
  const auto vector = [](const Vec3& v) { return fmt::format("{:.6g} {:.6g} {:.6g}", v.x, v.y, v.z); };
  std::string text = fmt::format("format       {}\n", info.format);
  text += fmt::format("size         {} x {} x {} voxels ({:.1f} MiB)\n", d.geometry.size.x, d.geometry.size.y, d.geometry.size.z,
                      double(d.voxel_bytes()) / (1 << 20));
  text += fmt::format("samples      {}, {} in the file; value = {:g} * sample + {:g}\n", NameOf(d.type), info.file_type, d.mapping.scale,
                      d.mapping.offset);
  text += fmt::format("spacing      {}\norigin       {}\n", vector(d.geometry.spacing), vector(info.origin));
  text += fmt::format("directions   x ({})  y ({})  z ({})\n", vector(info.directions[0]), vector(info.directions[1]),
                      vector(info.directions[2]));
  text += fmt::format("values       {:g} ... {:g}\n", summary.range.min, summary.range.max);
  if (summary.non_finite > 0) text += fmt::format("not finite   {} voxels (never visible)\n", summary.non_finite);
  text += fmt::format("occupancy    {:.4g} under transfer function '{}'\n", occupancy, transfer);
  return text + "histogram    lowest value of the row, voxels, bar by the logarithm of their number\n" + HistogramText(summary);
}

std::string InfoJson(const VolumeFileInfo& info, const VolumeSummary& summary, const std::string& transfer, double occupancy) {
  const VolumeDescription& d = info.description;
  const auto vector = [](const Vec3& v) { return nlohmann::ordered_json{v.x, v.y, v.z}; };
  const nlohmann::ordered_json json = {{"format", info.format},
                                       {"size", {d.geometry.size.x, d.geometry.size.y, d.geometry.size.z}},
                                       {"type", NameOf(d.type)},
                                       {"file_type", info.file_type},
                                       {"voxel_bytes", d.voxel_bytes()},
                                       {"mapping", {{"scale", d.mapping.scale}, {"offset", d.mapping.offset}}},
                                       {"spacing", vector(d.geometry.spacing)},
                                       {"origin", vector(info.origin)},
                                       {"directions", {vector(info.directions[0]), vector(info.directions[1]), vector(info.directions[2])}},
                                       {"range", {{"min", summary.range.min}, {"max", summary.range.max}}},
                                       {"non_finite", summary.non_finite},
                                       {"transfer", transfer},
                                       {"occupancy", occupancy},
                                       {"histogram", summary.histogram}};
  return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace

Status RunInfo(const InfoOptions& options) {
  if (Status status = CheckVolumePath(options.path); !status.ok()) return status;
  const Result<LoadedVolume> loaded = ReadInputVolume(options.path);
  if (!loaded.ok()) return loaded.status();
  const VolumeSummary summary = Summarize(*loaded->volume);

  const Result<TransferFunction> transfer = ResolveTransfer(options.transfer, summary);
  if (!transfer.ok()) return transfer.status();
  const double occupancy = EstimateOccupancy(summary, *transfer);

  const std::string name = TransferName(options.transfer);
  std::cout << (options.json ? InfoJson(loaded->info, summary, name, occupancy) : InfoText(loaded->info, summary, name, occupancy));
  return Status::Ok();
}

}  // namespace slabstream
