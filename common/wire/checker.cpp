#include "common/wire/checker.h"

#include <fmt/format.h>

#include "common/base/printable.h"

namespace slabstream {
namespace {

std::string Number(double value) { return std::isnan(value) ? "NaN" : fmt::format("{:.9g}", value); }

}  // namespace

Checker::Scope Checker::In(std::string_view field, std::optional<std::size_t> index) {
  const std::size_t length = path_.size();
  if (!field.empty()) path_.append(".").append(field);
  if (index) path_.append("[").append(std::to_string(*index)).append("]");
  return {path_, length};
}

void Checker::Fail(std::string_view field, std::string_view what) {
  if (!ok()) return;
  std::string message = path_;
  if (!field.empty()) message.append(".").append(field);
  status_ = Printable(Status::InvalidArgument(message.append(": ").append(what)));
}

void Checker::Adopt(const Status& status) {
  if (!status.ok()) Fail("", status.message());
}

double Checker::Between(std::string_view field, double value, double min, double max) {
  if (value >= min && value <= max) return value;
  FailNumber(field, value, fmt::format("in [{}, {}]", Number(min), Number(max)));
  return min;
}

double Checker::Positive(std::string_view field, double value) {
  if (std::isfinite(value) && value > 0) return value;
  FailNumber(field, value, "a finite number above 0");
  return 1;
}

std::string Checker::Text(std::string_view field, const std::string& value, std::size_t min_bytes, std::size_t max_bytes) {
  if (value.size() >= min_bytes && value.size() <= max_bytes) return value;
  Fail(field, fmt::format("a text of {} bytes, expected {} to {}", value.size(), min_bytes, max_bytes));
  return {};
}

int Checker::Count(std::string_view field, int size, std::size_t max) {
  if (static_cast<std::size_t>(size) <= max) return size;
  Fail(field, fmt::format("{} items, at most {}", size, max));
  return 0;
}

void Checker::FailRange(std::string_view field, std::uint64_t value, std::uint64_t min, std::uint64_t max) {
  Fail(field, fmt::format("{} is not in [{}, {}]", value, min, max));
}

void Checker::FailNumber(std::string_view field, double value, std::string_view expected) {
  Fail(field, fmt::format("{} is not {}", Number(value), expected));
}

void Checker::FailEnum(std::string_view field, int wire) { Fail(field, wire == 0 ? "not set" : fmt::format("unknown value {}", wire)); }

}  // namespace slabstream
