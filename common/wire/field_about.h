// What the schema says of a field of a request (proto/slabstream/v1/about.proto), and walks over requests: request_walk.h, which
// proto/write_codecs.cpp makes, has for each message in a FrameRequest, and for that itself,
//   Walk(value, visit)   // visit(const FieldAbout&, member, most items): the last one of lists, else 0. Enumerators come as EnumMember.
// in the order of the schema, which is that of help texts. The value may be const. Any thread.
#pragma once

#include <concepts>
#include <string>
#include <type_traits>
#include <vector>

namespace slabstream {

// Texts are empty and limits are both 0 where the schema says nothing.
struct FieldAbout {
  std::string field;  // its name in the schema; then come the members of About, in its order
  std::string name, help, value, unit, standard;
  double least = 0, most = 0;
  bool above_least = false;
  std::string list, ability;
  std::vector<std::string> excludes, needs;
  std::string group;
  bool always = false;
  std::string apart;
  bool same_picture = false;
  std::vector<std::string> words = {};  // of an enum: those of its values, from 1 on
};

// An enumerator of a struct, as the schema numbers it.
template <class T>
struct EnumMember {
  T& value;
  int first;  // the struct's number of the schema's 1

  int number() const { return int(value) - first + 1; }
  void set(int number) const { value = T(number - 1 + first); }
};

// T is Struct or const Struct.
template <class T, class Struct>
concept Is = std::same_as<std::remove_const_t<T>, Struct>;

}  // namespace slabstream
