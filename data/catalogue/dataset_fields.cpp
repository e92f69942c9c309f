#include "data/catalogue/dataset_fields.h"

#include <algorithm>
#include <string>

#include "data/volume_io/read_options.h"

namespace slabstream {
namespace {

// The first component shows if nothing is said; three or four of them are a colour.
void DescribeComponents(const SourceInfo& info, DatasetFields& fields) {
  const bool colour = info.components == 3 || info.components == 4;
  for (std::size_t i = 0; i < fields.fields.size(); ++i) {
    FieldInfo& field = fields.fields[i];
    field.shown = i == 0;
    if (!colour) continue;
    field.name = i < kComponentNames.size() ? kComponentNames[i] : "alpha";
    if (info.finest().type == ScalarType::kUint8) field.window = ValueRange{0, 255};
  }
}

}  // namespace

std::shared_ptr<const DatasetFields> FieldsOf(const DataSource& source, const SourceInfo& info) {
  DatasetFields fields;
  const Result<SourceText> text = source.load ? SourceText() : ParseSourceText(source.path);
  if (!text.ok()) return nullptr;
  if (!text->options.time) {
    fields.times = info.times;
    fields.time = info.time;
  }
  if (!text->options.channel && info.channels.size() > 1) {
    fields.fields.assign(info.channels.begin(), info.channels.begin() + std::ptrdiff_t(std::min(info.channels.size(), kMaxFields)));
    fields.field = info.channel;
    if (info.components > 1) DescribeComponents(info, fields);
  }
  const bool has_labels = source.labels != nullptr || info.hollow;
  const std::size_t others = (source.overlay != nullptr ? 1 : 0) + (has_labels ? 1 : 0);
  if (fields.fields.size() + others > kMaxFields) fields.fields.resize(kMaxFields - others);
  if (source.overlay != nullptr) fields.fields.push_back({.name = std::string(kOverlayField), .channel = false, .shown = false});
  if (has_labels) {
    fields.fields.push_back({.name = std::string(kLabelsField), .channel = false, .labels = true, .shown = info.hollow});
  }
  if (fields == DatasetFields()) return nullptr;
  return std::make_shared<const DatasetFields>(std::move(fields));
}

DataSource AtFieldAndTime(const DataSource& source, const DatasetFields& fields, int field, int time,
                          std::shared_ptr<const VolumeSummary> statistics) {
  const FieldInfo& info = fields.fields[std::size_t(field)];
  DataSource at = source;
  if (info.labels) {
    at = source.labels != nullptr ? *source.labels : LabelsAt(source);
  } else if (!info.channel) {
    at = *source.overlay;
  }
  at.overlay = at.labels = nullptr;
  if (info.channel && field != fields.field) at.path = WithReadOption(at.path, "channel", std::to_string(field));
  if (time != fields.time) at.path = AtTime(at.path, time);
  at.statistics = std::move(statistics);
  return at;
}

}  // namespace slabstream
