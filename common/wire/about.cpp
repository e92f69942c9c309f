#include "common/wire/about.h"

#include <algorithm>
#include <cctype>
#include <string_view>

#include "common/base/check.h"
#include "common/text/parse_number.h"

namespace slabstream {
namespace {

using google::protobuf::EnumDescriptor;
using google::protobuf::EnumValueDescriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;

template <class T>
T Number(const std::string& text) {
  const auto number = ParseNumber<T>(text);
  CHECK(number.has_value());
  return *number;
}

// Enums and texts have no presence: their first values stand for "left out".
bool IsLeftOut(const Message& message, const Reflection& access, const FieldDescriptor& field) {
  if (const auto* choice = field.real_containing_oneof()) return !access.HasOneof(message, choice);
  return !access.HasField(message, &field);
}

void SetStandard(Message& message, const Reflection& access, const FieldDescriptor& field) {
  const std::string& text = AboutOf(field).standard();
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_DOUBLE: return access.SetDouble(&message, &field, Number<double>(text));
    case FieldDescriptor::CPPTYPE_FLOAT: return access.SetFloat(&message, &field, Number<float>(text));
    case FieldDescriptor::CPPTYPE_UINT32: return access.SetUInt32(&message, &field, Number<std::uint32_t>(text));
    case FieldDescriptor::CPPTYPE_STRING: return access.SetString(&message, &field, text);
    case FieldDescriptor::CPPTYPE_ENUM: {
      const std::vector<std::string> words = WordsOf(*field.enum_type());
      const auto word = std::ranges::find(words, text);
      CHECK(word != words.end());
      return access.SetEnumValue(&message, &field, int(word - words.begin()) + 1);
    }
    default: CHECK(false);
  }
}

}  // namespace

std::string WordOf(const EnumValueDescriptor& value) {
  constexpr std::string_view kFirst = "UNSPECIFIED";
  std::string word = value.name().substr(value.type()->value(0)->name().size() - kFirst.size());
  for (char& c : word) c = c == '_' ? '-' : char(std::tolower(static_cast<unsigned char>(c)));
  return word;
}

std::vector<std::string> WordsOf(const EnumDescriptor& choices) {
  std::vector<std::string> words;
  for (int i = 1; i < choices.value_count(); ++i) words.push_back(WordOf(*choices.value(i)));
  return words;
}

void FillAbsent(Message& message) {
  const Reflection& access = *message.GetReflection();
  for (int i = 0; i < message.GetDescriptor()->field_count(); ++i) {
    const FieldDescriptor& field = *message.GetDescriptor()->field(i);
    const v1::About& about = AboutOf(field);
    if (field.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) {
      if (field.is_repeated()) {
        for (int item = 0; item < access.FieldSize(message, &field); ++item)
          FillAbsent(*access.MutableRepeatedMessage(&message, &field, item));
      } else if (about.always() || access.HasField(message, &field)) {
        FillAbsent(*access.MutableMessage(&message, &field));
      }
    } else if (field.has_presence() || field.cpp_type() == FieldDescriptor::CPPTYPE_STRING ||
               field.cpp_type() == FieldDescriptor::CPPTYPE_ENUM) {
      if (!about.standard().empty() && IsLeftOut(message, access, field)) SetStandard(message, access, field);
    }
  }
}

}  // namespace slabstream
