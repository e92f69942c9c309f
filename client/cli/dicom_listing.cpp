#include "client/cli/dicom_listing.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/base/printable.h"
#include "data/volume_io/read_options.h"

namespace slabstream {
namespace {

// What a terminal can show, of texts in any encoding.
std::string Plain(const std::string& text) {
  std::string plain = Printable(text);
  std::ranges::replace_if(
      plain, [](char c) { return static_cast<unsigned char>(c) >= 0x80; }, '?');
  return plain;
}

Vec3 SpacingOf(const DicomStack& stack) { return {Length(stack.steps[0]), Length(stack.steps[1]), Length(stack.steps[2])}; }

// "20" slices, or "20 x 3 times".
std::string SlicesText(const DicomSeries& series) {
  const DicomStack& stack = series.stack;
  if (!series.trouble.ok()) return fmt::format("{}", series.frame_count());
  return stack.times.count > 1 ? fmt::format("{} x {} times", stack.size.z, stack.times.count) : fmt::format("{}", stack.size.z);
}

// Why it is not read, or is read only if --series asks for it.
std::string RemarkOn(const DicomSeries& series) {
  if (!series.trouble.ok()) return series.trouble.message();
  return series.other;
}

}  // namespace

Result<std::vector<DicomSeries>> SeriesAt(const std::string& source) {
  const Result<SourceText> parsed = ParseSourceText(source);
  if (!parsed.ok()) return parsed.status();
  if (!IsDicom(parsed->path)) return std::vector<DicomSeries>();
  Result<std::vector<DicomSeries>> all = ListDicomSeries(parsed->path);
  if (!all.ok()) return Printable(all.status());
  return all;
}

bool NeedsChoice(const std::vector<DicomSeries>& all, const std::string& source) {
  const Result<SourceText> parsed = ParseSourceText(source);
  return parsed.ok() && parsed->options.series.empty() &&
         std::ranges::count_if(all, [](const DicomSeries& series) { return series.other.empty(); }) > 1;
}

std::string SeriesText(const std::vector<DicomSeries>& all) {
  if (all.empty()) return "";
  std::string text =
      fmt::format("{:<8} {:<8} {:<20} {:<26} {}\n", "series", "modality", "pixels and slices", "spacing (mm)", "UID, description");
  for (const DicomSeries& series : all) {
    const DicomImage& first = series.images.front();
    const Vec3 spacing = SpacingOf(series.stack);
    text += fmt::format("{:<8} {:<8} {:<20} {:<26} {}{}\n", Plain(series.number), Plain(series.modality),
                        fmt::format("{} x {} x {}", first.columns, first.rows, SlicesText(series)),
                        series.trouble.ok() ? fmt::format("{:.6g} x {:.6g} x {:.6g}", spacing.x, spacing.y, spacing.z) : "-",
                        Plain(series.uid), series.description.empty() ? "" : fmt::format(", \"{}\"", Plain(series.description)));
    if (const std::string remark = RemarkOn(series); !remark.empty()) text += fmt::format("{:<8} no volume: {}\n", "", Plain(remark));
  }
  return text;
}

Json SeriesJson(const std::vector<DicomSeries>& all) {
  Json json = Json::array();
  for (const DicomSeries& series : all) {
    const DicomImage& first = series.images.front();
    Json each = {{"number", series.number},
                 {"uid", series.uid},
                 {"modality", series.modality},
                 {"description", series.description},
                 {"size", {first.columns, first.rows, series.frame_count()}}};
    if (series.trouble.ok()) {
      each["size"][2] = series.stack.size.z;
      if (series.stack.times.count > 1) each["times"] = series.stack.times.count;
      const Vec3 spacing = SpacingOf(series.stack);
      each["spacing"] = {spacing.x, spacing.y, spacing.z};
    }
    if (const std::string remark = RemarkOn(series); !remark.empty()) each["no_volume"] = remark;
    json.push_back(std::move(each));
  }
  return json;
}

}  // namespace slabstream
