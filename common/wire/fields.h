// Structs to Protobuf messages and back, from one list of fields a message. Private to common/wire, like all generated code.
//
//   void Fields(auto& io, Is<Welcome> auto& m) {
//     using P = v1::Welcome;
//     io.Any(m.epoch, &P::epoch, &P::set_epoch);
//     io.Range("worker", m.worker, &P::worker, &P::set_worker, 1, kMaxWorkerId);
//   }
//
// A Writer takes the struct's members to the message. It trusts them, but makes texts fit to travel (wire_text.h). A Reader takes the
// message's fields to the struct, in the order of the list, so that limits can depend on members before. It checks everything that the
// comments of the struct promise: faults go to the Checker, whose scope names the message, and if there is none the struct is valid.
//
// A struct that is not simply its fields has overloads of Write and Read beside its list, or instead of it.
#pragma once

#include <google/protobuf/repeated_field.h>
#include <google/protobuf/repeated_ptr_field.h>

#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

#include "common/frame/frame_request.h"
#include "common/wire/checker.h"
#include "common/wire/wire_text.h"

namespace slabstream {

// T is Struct (of a Reader) or const Struct (of a Writer).
template <class T, class Struct>
concept Is = std::same_as<std::remove_const_t<T>, Struct>;

template <class Struct, class P>
void Write(const Struct& in, P& out);
template <class Struct, class P>
void Read(const P& in, Struct& out, Checker& check);

template <class T>
using Repeated = google::protobuf::RepeatedField<T>;
template <class P>
using RepeatedMessage = google::protobuf::RepeatedPtrField<P>;

// Writer and Reader have the same functions. Each takes a struct's member with the message's accessors of the same field.
template <class P>
class Writer {
 public:
  explicit Writer(P& out) : out_(out) {}

  template <class T>
  void Any(T value, T (P::*)() const, void (P::*set)(T)) {
    (out_.*set)(value);
  }
  template <class T>
  void Any(std::string_view, T value, T (P::*get)() const, void (P::*set)(T)) {
    Any(value, get, set);
  }
  template <class T, class Wire>
  void Range(std::string_view, T value, Wire (P::*)() const, void (P::*set)(Wire), std::uint64_t, std::uint64_t) {
    (out_.*set)(static_cast<Wire>(value));
  }
  template <class Enum, class Wire>
  void OneOf(std::string_view, Enum value, Wire (P::*)() const, void (P::*set)(Wire), Enum first, Enum) {
    (out_.*set)(static_cast<Wire>(static_cast<int>(value) - static_cast<int>(first) + 1));
  }
  template <class T>
  void Finite(std::string_view, T value, T (P::*)() const, void (P::*set)(T)) {
    (out_.*set)(value);
  }
  void Between(std::string_view, double value, double (P::*)() const, void (P::*set)(double), double, double) { (out_.*set)(value); }
  void Text(std::string_view, const std::string& value, const std::string& (P::*)() const, std::string* (P::*edit)(), std::size_t,
            std::size_t max_bytes) {
    *(out_.*edit)() = WireText(value, max_bytes);
  }
  void Bytes(std::string_view, const std::string& value, const std::string& (P::*)() const, std::string* (P::*edit)(), std::size_t,
             std::size_t) {
    *(out_.*edit)() = value;
  }
  void ByteStrings(std::string_view, const std::vector<std::string>& items, const RepeatedMessage<std::string>& (P::*)() const,
                   RepeatedMessage<std::string>* (P::*edit)(), std::size_t, std::size_t) {
    (out_.*edit)()->Add(items.begin(), items.end());
  }
  template <class T>
  void Numbers(std::string_view, const std::vector<T>& values, const Repeated<T>& (P::*)() const, Repeated<T>* (P::*edit)(), std::size_t) {
    (out_.*edit)()->Add(values.begin(), values.end());
  }
  template <class T, std::size_t size>
  void Row(std::string_view, const std::array<T, size>& values, const Repeated<T>& (P::*)() const, Repeated<T>* (P::*edit)()) {
    (out_.*edit)()->Add(values.begin(), values.end());
  }
  template <class Struct, class Inner>
  void Message(std::string_view, const Struct& value, const Inner& (P::*)() const, Inner* (P::*edit)()) {
    Write(value, *(out_.*edit)());
  }
  // An optional or rare struct.
  template <class Inner>
  void Optional(std::string_view, const auto& value, bool (P::*)() const, const Inner& (P::*)() const, Inner* (P::*edit)()) {
    if (value) Write(*value, *(out_.*edit)());
  }
  // An optional number.
  template <class T>
  void Optional(std::string_view, const std::optional<T>& value, bool (P::*)() const, T (P::*)() const, void (P::*set)(T)) {
    if (value) (out_.*set)(*value);
  }
  template <class Struct, class Inner>
  void Messages(std::string_view, const std::vector<Struct>& items, const RepeatedMessage<Inner>& (P::*)() const,
                RepeatedMessage<Inner>* (P::*edit)(), std::size_t) {
    (out_.*edit)()->Reserve(static_cast<int>(items.size()));
    for (const Struct& item : items) Write(item, *(out_.*edit)()->Add());
  }
  // Texts by names.
  template <class Inner>
  void TextMap(std::string_view, const auto& texts, const RepeatedMessage<Inner>& (P::*)() const, RepeatedMessage<Inner>* (P::*edit)(),
               std::size_t) {
    for (const auto& [name, text] : texts) {
      Inner& item = *(out_.*edit)()->Add();
      item.set_name(WireText(name, kMaxNameBytes));
      item.set_text(WireText(text, kMaxNameBytes));
    }
  }
  // A oneof of a text and a struct.
  template <class Struct, class Inner>
  void Either(std::string_view, const std::variant<std::string, Struct>& value, const std::string& (P::*)() const,
              std::string* (P::*edit_text)(), std::string_view, bool (P::*)() const, const Inner& (P::*)() const, Inner* (P::*edit)()) {
    if (const auto* text = std::get_if<std::string>(&value)) {
      *(out_.*edit_text)() = WireText(*text, kMaxNameBytes);
    } else {
      Write(std::get<Struct>(value), *(out_.*edit)());
    }
  }
  void Check(const auto&) {}

 private:
  P& out_;
};

template <class P>
class Reader {
 public:
  Reader(const P& in, Checker& check) : in_(in), check_(check) {}

  // The same type in the struct and in the message, and no limit.
  template <class T>
  void Any(T& value, T (P::*get)() const, void (P::*)(T)) {
    value = (in_.*get)();
  }
  template <class T>
  void Any(std::string_view, T& value, T (P::*get)() const, void (P::*set)(T)) {
    Any(value, get, set);
  }
  // In [min, max].
  template <class T, class Wire>
  void Range(std::string_view field, T& value, Wire (P::*get)() const, void (P::*)(Wire), std::uint64_t min, std::uint64_t max) {
    value = static_cast<T>(check_.Range(field, (in_.*get)(), min, max));
  }
  // In [first, last]: see Checker::OneOf.
  template <class Enum, class Wire>
  void OneOf(std::string_view field, Enum& value, Wire (P::*get)() const, void (P::*)(Wire), Enum first, Enum last) {
    value = check_.OneOf(field, (in_.*get)(), first, last);
  }
  template <class T>
  void Finite(std::string_view field, T& value, T (P::*get)() const, void (P::*)(T)) {
    value = check_.Finite(field, (in_.*get)());
  }
  void Between(std::string_view field, double& value, double (P::*get)() const, void (P::*)(double), double min, double max) {
    value = check_.Between(field, (in_.*get)(), min, max);
  }
  void Text(std::string_view field, std::string& value, const std::string& (P::*get)() const, std::string* (P::*)(), std::size_t min_bytes,
            std::size_t max_bytes) {
    value = check_.Text(field, (in_.*get)(), min_bytes, max_bytes);
  }
  // A text that need not be UTF-8.
  void Bytes(std::string_view field, std::string& value, const std::string& (P::*get)() const, std::string* (P::*)(), std::size_t min_bytes,
             std::size_t max_bytes) {
    value = check_.Text(field, (in_.*get)(), min_bytes, max_bytes);
  }
  // At most `max` of them, each of 1 to max_bytes bytes.
  void ByteStrings(std::string_view field, std::vector<std::string>& items, const RepeatedMessage<std::string>& (P::*get)() const,
                   RepeatedMessage<std::string>* (P::*)(), std::size_t max, std::size_t max_bytes) {
    const RepeatedMessage<std::string>& in = (in_.*get)();
    items.resize(static_cast<std::size_t>(check_.Count(field, in.size(), max)));
    for (std::size_t i = 0; i < items.size(); ++i) {
      const auto scope = check_.In(field, i);
      items[i] = check_.Text("", in[static_cast<int>(i)], 1, max_bytes);
    }
  }
  // At most `max` values.
  template <class T>
  void Numbers(std::string_view field, std::vector<T>& values, const Repeated<T>& (P::*get)() const, Repeated<T>* (P::*)(),
               std::size_t max) {
    const Repeated<T>& in = (in_.*get)();
    values.assign(in.begin(), in.begin() + check_.Count(field, in.size(), max));
  }
  // As many values as the array has, and finite ones.
  template <class T, std::size_t size>
  void Row(std::string_view field, std::array<T, size>& values, const Repeated<T>& (P::*get)() const, Repeated<T>* (P::*)()) {
    const Repeated<T>& in = (in_.*get)();
    if (in.size() != static_cast<int>(size)) {
      return check_.Fail(field, std::to_string(in.size()) + " values, expected " + std::to_string(size));
    }
    std::copy(in.begin(), in.end(), values.begin());
    if constexpr (std::floating_point<T>) {
      for (std::size_t i = 0; i < size; ++i) {
        const auto scope = check_.In(field, i);
        values[i] = check_.Finite("", values[i]);
      }
    }
  }
  template <class Struct, class Inner>
  void Message(std::string_view field, Struct& value, const Inner& (P::*get)() const, Inner* (P::*)()) {
    const auto scope = check_.In(field);
    Read((in_.*get)(), value, check_);
  }
  template <class Inner>
  void Optional(std::string_view field, auto& value, bool (P::*has)() const, const Inner& (P::*get)() const, Inner* (P::*edit)()) {
    if ((in_.*has)()) Message(field, value.emplace(), get, edit);
  }
  template <class T>
  void Optional(std::string_view field, std::optional<T>& value, bool (P::*has)() const, T (P::*get)() const, void (P::*)(T)) {
    value.reset();
    if (!(in_.*has)()) return;
    if constexpr (std::is_floating_point_v<T>) {
      value = check_.Finite(field, (in_.*get)());
    } else {
      value = (in_.*get)();
    }
  }
  // At most `max` items.
  template <class Struct, class Inner>
  void Messages(std::string_view field, std::vector<Struct>& items, const RepeatedMessage<Inner>& (P::*get)() const,
                RepeatedMessage<Inner>* (P::*)(), std::size_t max) {
    const RepeatedMessage<Inner>& in = (in_.*get)();
    items.resize(static_cast<std::size_t>(check_.Count(field, in.size(), max)));
    for (std::size_t i = 0; i < items.size(); ++i) {
      const auto scope = check_.In(field, i);
      Read(in[static_cast<int>(i)], items[i], check_);
    }
  }
  template <class Inner>
  void TextMap(std::string_view field, auto& texts, const RepeatedMessage<Inner>& (P::*get)() const, RepeatedMessage<Inner>* (P::*)(),
               std::size_t max) {
    const RepeatedMessage<Inner>& in = (in_.*get)();
    const int count = check_.Count(field, in.size(), max);
    for (int i = 0; i < count; ++i) {
      const auto scope = check_.In(field, std::size_t(i));
      const std::string name = check_.Text("name", in[i].name(), 1, kMaxNameBytes);
      check_.That(texts.emplace(name, check_.Text("text", in[i].text(), 1, kMaxNameBytes)).second, "name", "given twice");
    }
  }
  template <class Struct, class Inner>
  void Either(std::string_view text_field, std::variant<std::string, Struct>& value, const std::string& (P::*get_text)() const,
              std::string* (P::*)(), std::string_view field, bool (P::*has)() const, const Inner& (P::*get)() const, Inner* (P::*edit)()) {
    if ((in_.*has)()) {
      Message(field, value.template emplace<Struct>(), get, edit);
    } else {
      value = check_.Text(text_field, (in_.*get_text)(), 1, kMaxNameBytes);
    }
  }
  // What holds between members.
  void Check(const auto& rule) { rule(check_); }

 private:
  const P& in_;
  Checker& check_;
};

template <class Struct, class P>
void WriteFields(const Struct& in, P& out) {
  Writer<P> io(out);
  Fields(io, in);
}
template <class Struct, class P>
void ReadFields(const P& in, Struct& out, Checker& check) {
  Reader<P> io(in, check);
  Fields(io, out);
}

template <class Struct, class P>
void Write(const Struct& in, P& out) {
  WriteFields(in, out);
}
template <class Struct, class P>
void Read(const P& in, Struct& out, Checker& check) {
  ReadFields(in, out, check);
}

}  // namespace slabstream
