#include "client/request/json_value.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "common/base/printable.h"

namespace slabstream {
double Decimal(float number) { return std::strtod(fmt::format("{}", number).c_str(), nullptr); }

void JsonValue::Complain(const std::string& what) const {
  if (!*mistake_) *mistake_ = Printable(place_.empty() ? what : fmt::format("{}: {}", place_, what));
}

std::string JsonValue::Shown() const {
  constexpr std::size_t kMost = 60;
  const std::string text = json_->dump();
  return text.size() <= kMost ? text : text.substr(0, kMost) + "...";
}

void JsonValue::Fields(const std::vector<std::pair<std::string, Read>>& fields) const {
  if (!json_->is_object()) return Complain(fmt::format("{} must be an object", Shown()));
  for (const auto& [name, value] : json_->items()) {
    const auto same = [](char a, char b) { return a == b || (a == '-' && b == '_'); };
    const auto found =
        std::ranges::find_if(fields, [&, &name = name](const auto& field) { return std::ranges::equal(field.first, name, same); });
    if (found != fields.end()) {
      found->second(JsonValue(value, place_.empty() ? name : place_ + "." + name, *mistake_));
      continue;
    }
    std::string known;
    for (const auto& field : fields) known += (known.empty() ? "" : ", ") + field.first;
    Complain(fmt::format("'{}' is no field; there are {}", name, known));
  }
}

void JsonValue::Each(const Read& read, std::size_t least) const {
  if (!json_->is_array() || json_->size() < least) {
    return Complain(fmt::format("{} must be a list{}", Shown(),
                                least == 0   ? ""
                                : least == 1 ? " of at least one"
                                             : fmt::format(" of {}", least)));
  }
  for (std::size_t i = 0; i < json_->size(); ++i) read(JsonValue((*json_)[i], fmt::format("{}[{}]", place_, i), *mistake_));
}

JsonValue JsonValue::At(const char* field) const {
  static const Json kMissing;
  JsonValue found(Has(field) ? (*json_)[field] : kMissing, place_ + "." + field, *mistake_);
  if (!json_->is_object()) Complain(fmt::format("{} must be an object", Shown()));
  if (!Has(field)) found.Complain("is missing");
  return found;
}

std::string JsonValue::Text() const {
  if (json_->is_string()) return json_->get<std::string>();
  Complain(fmt::format("{} must be a text", Shown()));
  return "";
}

double JsonValue::Number(const NumberRange& range) const {
  const double value = json_->is_number() ? json_->get<double>() : std::nan("");
  const bool inside = std::isfinite(value) && value <= range.max && (range.min_open ? value > range.min : value >= range.min);
  if (!inside) Complain(fmt::format("{} must be a number in {}{}, {}]", Shown(), range.min_open ? "(" : "[", range.min, range.max));
  return inside ? value : range.max;
}

int JsonValue::Integer(int min, int max) const {
  const bool inside = json_->is_number_integer() && json_->get<double>() >= min && json_->get<double>() <= max;
  if (!inside) Complain(fmt::format("{} must be a whole number in [{}, {}]", Shown(), min, max));
  return inside ? json_->get<int>() : min;
}

bool JsonValue::Boolean() const {
  if (json_->is_boolean()) return json_->get<bool>();
  Complain(Shown() + " must be true or false");
  return false;
}

std::size_t JsonValue::OneOf(std::span<const std::string_view> names) const {
  const std::string text = Text();
  const auto found = std::ranges::find(names, text);
  if (found != names.end()) return std::size_t(found - names.begin());
  Complain(fmt::format("{} must be one of {}", Shown(), fmt::join(names, ", ")));
  return 0;
}

}  // namespace slabstream
