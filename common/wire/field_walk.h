// FieldWalk: visits the members of a struct with what the schema says of each. It reads the lists of fields that also make the codecs
// (fields.h). Private to those who include generated code.
#pragma once

#include <google/protobuf/descriptor.h>

#include <cstddef>
#include <string_view>
#include <type_traits>
#include <utility>

#include "common/base/check.h"
#include "common/wire/request_fields.h"

namespace slabstream {

using Field = google::protobuf::FieldDescriptor;

// An enumerator of a struct, as the schema numbers it.
template <class T>
struct EnumMember {
  T& value;
  int first;  // the struct's number of the schema's 1

  int number() const { return int(value) - first + 1; }
  void set(int number) const { value = T(number - 1 + first); }
};

// visit(const Field&, member, most items): the last one of lists, else 0. Enumerators come as EnumMember.
template <class Visit>
class FieldWalk {
 public:
  explicit FieldWalk(Visit visit) : visit_(std::move(visit)) {}

  template <class P, class T, class... Rest>
  void Any(std::string_view name, T& value, std::remove_const_t<T> (P::*)() const, Rest...) {
    See<P>(name, value);
  }
  template <class P, class T, class Wire, class... Rest>
  void Range(std::string_view name, T& value, Wire (P::*)() const, Rest...) {
    See<P>(name, value);
  }
  template <class P, class T, class Wire, class Set, class Enum>
  void OneOf(std::string_view name, T& value, Wire (P::*)() const, Set, Enum first, Enum) {
    EnumMember<T> member{value, int(first)};
    See<P>(name, member);
  }
  template <class P, class T, class Wire, class... Rest>
  void Finite(std::string_view name, T& value, Wire (P::*)() const, Rest...) {
    See<P>(name, value);
  }
  template <class P, class T, class Wire, class... Rest>
  void Text(std::string_view name, T& value, const Wire& (P::*)() const, Rest...) {
    See<P>(name, value);
  }
  template <class P, class T, class Inner, class... Rest>
  void Message(std::string_view name, T& value, const Inner& (P::*)() const, Rest...) {
    See<P>(name, value);
  }
  template <class P, class T, class... Rest>
  void Optional(std::string_view name, T& value, bool (P::*)() const, Rest...) {
    See<P>(name, value);
  }
  template <class P, class T, class Inner>
  void Messages(std::string_view name, T& items, const RepeatedMessage<Inner>& (P::*)() const, RepeatedMessage<Inner>* (P::*)(),
                std::size_t most) {
    See<P>(name, items, most);
  }
  template <class P, class T, class Inner>
  void TextMap(std::string_view name, T& items, const RepeatedMessage<Inner>& (P::*)() const, RepeatedMessage<Inner>* (P::*)(),
               std::size_t most) {
    See<P>(name, items, most);
  }
  template <class P, class T, class... Rest>
  void Either(std::string_view name, T& value, const std::string& (P::*)() const, Rest...) {
    See<P>(name, value);
  }
  void Check(const auto&) {}

 private:
  template <class P>
  void See(std::string_view name, auto& value, std::size_t most = 0) {
    const Field* const field = P::descriptor()->FindFieldByName(std::string(name));
    CHECK(field != nullptr);
    visit_(*field, value, most);
  }

  Visit visit_;
};

// The struct, const or not, must have a list of fields.
template <class Struct, class Visit>
void Walk(Struct& value, Visit visit) {
  FieldWalk<Visit> io(std::move(visit));
  Fields(io, value);
}

}  // namespace slabstream
