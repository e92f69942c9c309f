#include "gateway/request_fields.h"

#include <fmt/format.h>

#include <charconv>
#include <optional>

#include "common/text/split.h"

namespace slabstream {
namespace {

// '+' is a blank, as forms write it. nullopt: a '%' without two hexadecimal digits.
std::optional<std::string> Decoded(std::string_view text) {
  std::string plain;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '+') {
      plain += ' ';
    } else if (text[i] != '%') {
      plain += text[i];
    } else {
      unsigned code = 0;
      if (i + 2 >= text.size()) return std::nullopt;
      const auto [end, error] = std::from_chars(&text[i + 1], &text[i + 1] + 2, code, 16);
      if (error != std::errc() || end != &text[i + 1] + 2) return std::nullopt;
      plain += char(code);
      i += 2;
    }
  }
  return plain;
}

}  // namespace

Result<Target> ParseTarget(std::string_view text) {
  const std::size_t question = text.find('?');
  Target target;
  target.path = text.substr(0, question);
  if (!target.path.starts_with('/')) return Status::InvalidArgument("the address has no path");
  if (question == std::string_view::npos) return target;
  for (const std::string_view part : Split(text.substr(question + 1), '&')) {
    if (part.empty()) continue;
    if (target.fields.size() == kMaxPictureFields) {
      return Status::InvalidArgument(fmt::format("the address has more than {} fields", kMaxPictureFields));
    }
    const std::size_t equals = part.find('=');
    std::optional<std::string> name = Decoded(part.substr(0, equals));
    std::optional<std::string> value = equals == std::string_view::npos ? "" : Decoded(part.substr(equals + 1));
    if (!name || !value) return Status::InvalidArgument("the address has a % without two hexadecimal digits");
    target.fields.push_back({*std::move(name), *std::move(value)});
  }
  return target;
}

Result<PictureFields> FieldsOf(const Target& target, std::string_view body) {
  PictureFields fields;
  for (const PictureField& field : target.fields) {
    if (field.name != "token") fields.push_back(field);
  }
  if (body.empty()) return fields;
  const Result<Json> json = ParseJson(body);
  if (!json.ok()) return Status::InvalidArgument("the body: " + json.status().message());
  Result<PictureFields> more = FieldsOfJson(*json);
  if (!more.ok()) return more.status();
  fields.insert(fields.end(), more->begin(), more->end());
  return fields;
}

std::string FieldReader::Need(const std::string& name, std::string_view purpose) {
  const auto found = std::ranges::find(fields_, name, &PictureField::name);
  if (found == fields_.end()) {
    Refuse(fmt::format("{} is missing: {}", name, purpose));
    return "";
  }
  std::string text = std::move(found->text);
  fields_.erase(found);
  if (Has(name)) Refuse(name + " is given twice");
  return text;
}

std::string FieldReader::Dataset() {
  std::string dataset = Need("dataset", "the name of a dataset of the service");
  NothingElse();
  if (dataset.empty() || dataset.size() > kMaxNameBytes) {
    Refuse(fmt::format("dataset has {} bytes, but must have 1 to {}", dataset.size(), kMaxNameBytes));
  }
  return dataset;
}

void FieldReader::NothingElse() {
  if (!fields_.empty()) Refuse(fmt::format("there is no option '{}'", Printable(fields_.front().name.substr(0, 64))));
}

}  // namespace slabstream
