// What the codecs that proto/write_codecs.cpp makes are made of. Private to common/wire, like all generated code.
//
// Write trusts a struct, but makes texts fit to travel (wire_text.h). Read checks everything that the schema says: faults go to the
// Checker, whose scope names the message. The struct has just been made. What holds between fields is checked by Rules (rules.h), once each
// field alone is right.
#pragma once

#include <google/protobuf/repeated_field.h>
#include <google/protobuf/repeated_ptr_field.h>

#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/rare.h"
#include "common/wire/checker.h"
#include "common/wire/wire_text.h"

namespace slabstream {

template <class T>
using Repeated = google::protobuf::RepeatedField<T>;
template <class P>
using RepeatedMessage = google::protobuf::RepeatedPtrField<P>;
using TextMap = std::map<std::string, std::string, std::less<>>;

// A member, or what it holds; null: nothing.
template <class T>
const T* PartOf(const T& member) {
  return &member;
}
template <class T>
const T* PartOf(const std::optional<T>& member) {
  return member ? &*member : nullptr;
}
template <class T>
const T* PartOf(const Rare<T>& member) {
  return member ? &*member : nullptr;
}

template <class T, class Value>
void Set(T& member, Value value) {
  member = static_cast<T>(value);
}

// ---- enums: 0 stands for "not set" on the wire (Checker::OneOf)

template <class Enum>
int NumberOf(Enum value, Enum first) {
  return static_cast<int>(value) - static_cast<int>(first) + 1;
}
template <class Enum>
int NumberOf(const std::optional<Enum>& value, Enum first) {
  return value ? NumberOf(*value, first) : 0;
}
template <class Enum>
void ReadEnum(std::string_view field, int number, Enum& member, Enum first, Enum last, Checker& check) {
  member = check.OneOf(field, number, first, last);
}
template <class Enum>
void ReadEnum(std::string_view field, int number, std::optional<Enum>& member, Enum first, Enum last, Checker& check) {
  if (number != 0) member = check.OneOf(field, number, first, last);
}

// ---- messages

// A member that is always there is read from an empty message, too.
template <class P, class T>
void ReadPart(std::string_view field, bool has, const P& in, T& member, Checker& check) {
  const auto scope = check.In(field);
  if constexpr (requires { member.emplace(); }) {
    if (has) Read(in, member.emplace(), check);
  } else {
    Read(in, member, check);
  }
}

template <class T, class P>
void WriteItems(const std::vector<T>& items, RepeatedMessage<P>& out) {
  out.Reserve(static_cast<int>(items.size()));
  for (const T& item : items) Write(item, *out.Add());
}
template <class P, class T>
void ReadItems(std::string_view field, const RepeatedMessage<P>& in, std::vector<T>& items, std::size_t most, Checker& check) {
  items.clear();
  items.resize(static_cast<std::size_t>(check.Count(field, in.size(), most)));
  for (std::size_t i = 0; i < items.size(); ++i) {
    const auto scope = check.In(field, i);
    Read(in[static_cast<int>(i)], items[i], check);
  }
}

// Texts by names.
template <class P>
void WriteItems(const TextMap& texts, RepeatedMessage<P>& out) {
  for (const auto& [name, text] : texts) {
    P& item = *out.Add();
    item.set_name(WireText(name, 256));
    item.set_text(WireText(text, 256));
  }
}
template <class P>
void ReadItems(std::string_view field, const RepeatedMessage<P>& in, TextMap& texts, std::size_t most, Checker& check) {
  const int count = check.Count(field, in.size(), most);
  for (int i = 0; i < count; ++i) {
    const auto scope = check.In(field, std::size_t(i));
    const std::string name = check.Text("name", in[i].name(), 1, 256);
    check.That(texts.emplace(name, check.Text("text", in[i].text(), 1, 256)).second, "name", "given twice");
  }
}

// ---- several numbers or texts

template <class T>
void ReadNumbers(std::string_view field, const Repeated<T>& in, std::vector<T>& values, std::size_t most, Checker& check) {
  values.assign(in.begin(), in.begin() + check.Count(field, in.size(), most));
}
// As many as the array has, and finite ones.
template <class T, std::size_t size>
void ReadNumbers(std::string_view field, const Repeated<T>& in, std::array<T, size>& values, std::size_t, Checker& check) {
  if (in.size() != static_cast<int>(size)) {
    return check.Fail(field, std::to_string(in.size()) + " values, expected " + std::to_string(size));
  }
  std::copy(in.begin(), in.end(), values.begin());
  if constexpr (std::floating_point<T>) {
    for (std::size_t i = 0; i < size; ++i) {
      const auto scope = check.In(field, i);
      values[i] = check.Finite("", values[i]);
    }
  }
}
inline void ReadTexts(std::string_view field, const RepeatedMessage<std::string>& in, std::vector<std::string>& texts, std::size_t most,
                      std::size_t min_bytes, std::size_t max_bytes, Checker& check) {
  texts.resize(static_cast<std::size_t>(check.Count(field, in.size(), most)));
  for (std::size_t i = 0; i < texts.size(); ++i) {
    const auto scope = check.In(field, i);
    texts[i] = check.Text("", in[static_cast<int>(i)], min_bytes, max_bytes);
  }
}

}  // namespace slabstream
