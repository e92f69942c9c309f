#include "data/metadata/json_fields.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/base/printable.h"
#include "data/sources/chunked_array.h"

namespace slabstream::metadata {
namespace {

// Python's json writes numbers that JSON does not have: NaN, Infinity, -Infinity. Here they become texts of the same name.
std::string WithNumbersAsTexts(std::string_view text) {
  static constexpr std::string_view kNumbers[] = {"NaN", "-Infinity", "Infinity"};
  std::string quoted;
  bool inside = false;  // of a text
  while (!text.empty()) {
    const auto* const number = std::ranges::find_if(kNumbers, [&](std::string_view each) { return !inside && text.starts_with(each); });
    const bool found = number != std::end(kNumbers);
    const std::size_t taken = found ? number->size() : inside && text.front() == '\\' ? std::min<std::size_t>(2, text.size()) : 1;
    if (text.front() == '"') inside = !inside;
    const std::string_view quote = found ? "\"" : "";
    quoted.append(quote).append(text.substr(0, taken)).append(quote);
    text.remove_prefix(taken);
  }
  return quoted;
}

}  // namespace

Result<Json> ParseJson(const std::string& object, std::string_view text) {
  Result<Json> json = Json::Parse(text);
  if (!json.ok()) json = Json::Parse(WithNumbersAsTexts(text));
  if (!json.ok()) return Status::DataLoss(fmt::format("{}: damaged: {}", object, json.status().message()));
  return json;
}

Result<std::optional<Json>> JsonReading::Get() {
  const Result<Bytes> bytes = bytes_.get();
  if (bytes.status().code() == StatusCode::kNotFound) return std::optional<Json>();
  if (!bytes.ok()) return bytes.status();
  const std::string_view text(reinterpret_cast<const char*>(bytes->span().data()), bytes->size());
  Result<Json> json = ParseJson(object_, text);
  if (!json.ok()) return json.status();
  return std::optional(*std::move(json));
}

std::string Join(std::string_view path, std::string_view name) {
  return path.empty() ? std::string(name) : fmt::format("{}/{}", path, name);
}

Field Field::operator[](std::string_view name) const {
  std::string place = place_.empty() ? std::string(name) : fmt::format("{}.{}", place_, name);
  return {object_, std::move(place), given() ? value_->find(name) : nullptr};
}

Field Field::operator[](std::size_t number) const {
  return {object_, fmt::format("{}[{}]", place_, number), is_array() && number < value_->size() ? &(*value_)[number] : nullptr};
}

Result<std::string> Field::Text() const {
  if (!is_text()) return Wrong("a text");
  return value_->text();
}

Result<double> Field::Number() const {
  if (!given() || !value_->is_number() || !std::isfinite(value_->get<double>())) return Wrong("a number");
  return value_->get<double>();
}

Result<std::uint64_t> Field::Whole(std::uint64_t least, std::uint64_t most) const {
  const bool whole = given() && value_->is_number_integer() && (value_->is_number_unsigned() || value_->get<std::int64_t>() >= 0);
  const std::uint64_t number = whole ? value_->get<std::uint64_t>() : 0;
  if (!whole || number < least || number > most) return Wrong(fmt::format("a whole number in [{}, {}]", least, most));
  return number;
}

Result<std::vector<std::uint64_t>> Field::Counts(std::size_t axes) const {
  const bool fits = axes > 0 ? size() == axes : size() >= 1 && size() <= kMaxArrayAxes;
  if (!is_array() || !fits)
    return Wrong(axes > 0 ? fmt::format("a list of {} numbers", axes) : fmt::format("a list of 1 to {} numbers", kMaxArrayAxes));
  std::vector<std::uint64_t> counts;
  for (std::size_t i = 0; i < size(); ++i) {
    const Result<std::uint64_t> count = (*this)[i].Whole(1, kMostElements);
    if (!count.ok()) return count.status();
    counts.push_back(*count);
  }
  return counts;
}

Status Field::Wrong(std::string_view must_be) const {
  constexpr std::size_t kMostShown = 80;
  std::string shown = value_ == nullptr ? "missing" : value_->dump();
  if (shown.size() > kMostShown) shown = shown.substr(0, kMostShown) + "...";
  const std::string place = place_.empty() ? "the whole" : place_;
  return Printable(Status::InvalidArgument(fmt::format("{}: {} is {}, must be {}", object_, place, shown, must_be)));
}

}  // namespace slabstream::metadata
