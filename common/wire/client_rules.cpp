#include <algorithm>
#include <limits>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/printable.h"
#include "common/frame/dataset_name.h"
#include "common/renderers/registry.h"
#include "common/wire/rules.h"
#include "common/wire/validate_request.h"

namespace slabstream {
namespace {

// By the values of labels.
template <class Items, class Value>
void CheckRising(const Items& labels, const Value& value, Checker& check) {
  for (std::size_t i = 1; i < labels.size(); ++i) check.That(value(labels[i - 1]) < value(labels[i]), "labels", "values do not rise");
}

void CheckFinite(std::string_view field, const std::vector<double>& numbers, Checker& check) {
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const auto scope = check.In(field, i);
    check.Finite("", numbers[i]);
  }
}

bool IsIdentifier(std::string_view name) {
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  const auto is_letter = [](char c) { return c == '_' || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); };
  return !name.empty() && !is_digit(name.front()) && std::ranges::all_of(name, [&](char c) { return is_letter(c) || is_digit(c); });
}

}  // namespace

void Rules(const FrameRequest& m, Checker& check) { check.Adopt(Validate(m)); }

void Rules(const FrameProgress& m, Checker& check) { check.Range("groups_done", m.groups_done, 0, m.group_count); }

void Rules(const PictureGeometry& m, Checker& check) {
  check.That(AreRightHanded(m.right, m.up, -m.forward), "right", "not of three right-handed unit vectors at right angles");
  if (m.projection == Projection::kPerspective) check.Positive("target_depth", m.target_depth);
  check.Positive("pixel_size", m.pixel_size);
}

void Rules(const PictureKey::Bar& m, Checker& check) {
  check.That(m.colors.size() > 1 && std::ranges::is_sorted(m.colors, {}, &ColorPoint::value) && m.low() < m.high(), "colors",
             "not of rising values");
}

void Rules(const FrameReply& m, Checker& check) {
  check.Range("groups_done", m.groups_done, 0, m.group_count);
  const PixelBounds picture = {0, 0, m.size.width, m.size.height};
  check.That(!m.shares.empty(), "shares", "none");
  for (std::size_t i = 0; i < m.shares.size(); ++i) {
    const auto share = check.In("shares", i);
    const RunImageHeader& image = m.shares[i].runs.image;
    check.That(picture.Contains(image.bounds), "runs.image.bounds", "not inside the picture");
    check.That(image.format == m.shares.front().runs.image.format, "runs.image.format", "not that of the first share");
  }
  if (m.groups_done == m.group_count) check.Adopt(RequireRenderer(m.statistics.renderer).status());
}

void Rules(const SummaryQuery& m, Checker& check) { check.Adopt(Validate(m.transfer)); }

void Rules(const SummaryReply& m, Checker& check) {
  check.That(m.histogram.size() == kHistogramBins, "histogram", "not as many bins as expected");
  CheckRising(
      m.labels, [](const Label& label) { return label.value; }, check);
  check.Adopt(Validate(m.transfer));
}

void Rules(const SampleQuery& m, Checker& check) { check.That(!m.points.empty(), "points", "none"); }

void Rules(const StatisticsReply& m, Checker& check) {
  CheckRising(
      m.labels, [](const LabelStatistics& label) { return label.label.value; }, check);
}

void Rules(const JointHistogramReply& m, Checker& check) {
  check.That(m.histogram.counts.size() == std::size_t{kJointValues} * kJointSlopes, "counts", "not as many bins as expected");
}

void Rules(const PickQuery& m, Checker& check) {
  check.Between("x", m.x, 0, m.frame.size.width);
  check.Between("y", m.y, 0, m.frame.size.height);
}

void Rules(const DatasetFields& m, Checker& check) {
  check.That(!m.fields.empty(), "fields", "none");
  check.That(std::size_t(m.field) < m.fields.size(), "field", "not the number of one");
  check.That(m.time >= 0 && m.time < m.times.count, "time", "not the number of one");
}

void Rules(const Ball& m, Checker& check) { check.Positive("radius", m.radius); }

void Rules(const PathCamera& m, Checker& check) { check.Adopt(Validate(m.view)); }

void Rules(const ViewQuery& m, Checker& check) { CheckFinite("at", m.at, check); }
void Rules(const OwnerSteered& m, Checker& check) { CheckFinite("values", m.values, check); }

void Rules(const SentFile& m, Checker& check) {
  check.Adopt(CheckDatasetName(m.name));
  check.That(!m.name.starts_with('.'), "name", "begins with a dot");
}

void Rules(const AddVolume& m, Checker& check) {
  check.That(!IsOfLabels(m.description.type), "description.type", "one of labels");
  const std::size_t most = m.label_bytes == 0 ? 0 : m.label_bytes == 1 ? 255 : kMaxLabels;
  if (m.labels.size() > most) check.Fail("labels", "more than numbers of label_bytes");
  CheckRising(
      m.labels, [](const NewLabel& label) { return label.value; }, check);
}

void Rules(const SteeredParameter& m, Checker& check) {
  check.That(IsIdentifier(m.name), "name", "'" + m.name + "' is no identifier");
  check.Between("value", m.value, m.least, m.most);
}

void Rules(const RegisterOwner& m, Checker& check) {
  check.That(!IsOfLabels(m.description.type), "description.type", "one of labels");
  check.That(m.owner < m.owners, "owner", "not below owners");
  check.That((m.owner == 0 && m.field == 0) || m.steered.empty(), "steered", "of another owner than 0");
  std::set<std::string_view> names;
  for (const SteeredParameter& each : m.steered) check.That(names.insert(each.name).second, "steered", "two of one name");
  names.clear();
  for (const std::string& each : m.fields) {
    check.That(!each.empty() && each.size() <= 64 && Printable(each) == each, "fields", "a name that is none, or has more than 64 bytes");
    check.That(names.insert(each).second, "fields", "two of one name");
  }
  const std::size_t fields = std::max<std::size_t>(m.fields.size(), 1);
  check.That(m.field < fields, "field", "not the number of one");
  check.That(fields * m.owners <= 4096, "fields", "more than 4096 owners of all");
}

void Rules(const VolumeCredit& m, Checker& check) {
  check.Range("allowed", m.allowed, m.received, std::numeric_limits<std::uint64_t>::max());
}

}  // namespace slabstream
