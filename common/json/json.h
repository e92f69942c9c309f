// Json: a value of JSON, which is null, a truth value, a number, a text, a list or an object. An object keeps the order in which its
// members were added. The library that parses and writes it is known to json.cpp alone.
//
// Braces make values: a list, or an object if each entry is a pair that begins with a text.
//   Json json = {{"name", "head"}, {"size", {64, 64, 32}}, {"missing", nullptr}};
//   json["levels"].push_back({{"level", 2}});
//
// Two ways to read. What others wrote is asked for its type first, or by find(). What this program wrote itself is read by at(), [] and
// get(), which throw std::runtime_error where the value is not there, or not of that type.
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <iosfwd>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "common/base/status.h"

namespace slabstream {

struct JsonLimits {
  int depth = 64;             // of lists and objects in each other
  bool names_differ = false;  // a name that an object has twice is an error; else the last one counts
};

class Json {
 public:
  struct Item;
  using Members = std::vector<std::pair<std::string, Json>>;

  // InvalidArgument in one line of any bytes: "not JSON: ..." with the place, or the limit that is exceeded.
  static Result<Json> Parse(std::string_view text, const JsonLimits& limits = {});

  // NOLINTBEGIN(google-explicit-constructor): what stands in braces becomes a value
  Json() = default;  // null
  Json(std::nullptr_t) {}
  template <class T>
  requires std::is_arithmetic_v<T> Json(T value) {
    if constexpr (std::is_same_v<T, bool>) {
      value_ = value;
    } else if constexpr (std::is_floating_point_v<T>) {
      value_ = double(value);
    } else if constexpr (std::is_signed_v<T>) {
      value_ = std::int64_t(value);
    } else {
      value_ = std::uint64_t(value);
    }
  }
  Json(std::string text) : value_(std::move(text)) {}
  Json(std::string_view text) : value_(std::string(text)) {}
  Json(const char* text) : value_(std::string(text)) {}
  Json(std::initializer_list<Item> items);
  // The list of a container's values, or the object of a map with names.
  template <class T>
  requires requires(const T& values) {
    typename T::value_type;
    values.begin();
    values.end();
  } &&(!std::is_convertible_v<const T&, std::string_view>)Json(const T& values) {
    if constexpr (requires { typename T::mapped_type; }) {
      Members& members = value_.emplace<Members>();
      for (const auto& [name, value] : values) members.emplace_back(name, value);
    } else {
      List& list = value_.emplace<List>();
      for (const auto& value : values) list.emplace_back(value);
    }
  }
  // NOLINTEND(google-explicit-constructor)

  static Json array(std::initializer_list<Item> items = {});
  static Json object() { return Json(Value(Members())); }

  bool is_null() const { return std::holds_alternative<std::monostate>(value_); }
  bool is_boolean() const { return std::holds_alternative<bool>(value_); }
  bool is_number() const { return is_number_integer() || std::holds_alternative<double>(value_); }
  bool is_number_integer() const { return is_number_unsigned() || std::holds_alternative<std::int64_t>(value_); }
  bool is_number_unsigned() const { return std::holds_alternative<std::uint64_t>(value_); }  // read from digits without a sign
  bool is_string() const { return std::holds_alternative<std::string>(value_); }
  bool is_array() const { return std::holds_alternative<List>(value_); }
  bool is_object() const { return std::holds_alternative<Members>(value_); }

  // Values of a list or members of an object; of null 0, of anything else 1.
  std::size_t size() const;
  bool empty() const { return size() == 0; }
  // The values of a list; none if this is no list.
  const Json* begin() const { return is_array() ? std::get<List>(value_).data() : nullptr; }
  const Json* end() const { return is_array() ? begin() + size() : nullptr; }
  Json* begin() { return const_cast<Json*>(std::as_const(*this).begin()); }
  Json* end() { return const_cast<Json*>(std::as_const(*this).end()); }
  // The members of an object; none if this is no object.
  const Members& items() const;

  // The member of an object; null: there is none, or this is no object.
  const Json* find(std::string_view name) const;
  bool contains(std::string_view name) const { return find(name) != nullptr; }
  const Json& at(std::string_view name) const;
  const Json& at(std::size_t index) const;
  Json& at(std::string_view name) { return const_cast<Json&>(std::as_const(*this).at(name)); }
  Json& at(std::size_t index) { return const_cast<Json&>(std::as_const(*this).at(index)); }
  const Json& operator[](std::string_view name) const { return at(name); }
  template <std::integral Index>
  const Json& operator[](Index index) const {
    return at(std::size_t(index));
  }
  const Json& front() const { return at(std::size_t{0}); }
  const Json& back() const { return at(size() - 1); }

  // A truth value, a number in a number's type, a text, a list as a vector, or an object as a map.
  template <class T>
  T get() const;
  const std::string& text() const;
  // The member, or `otherwise` if this is an object without it.
  template <class T>
  T value(std::string_view name, T otherwise) const {
    const Json* const found = find(name);
    return found == nullptr ? std::move(otherwise) : found->get<T>();
  }
  std::string value(std::string_view name, const char* otherwise) const { return value(name, std::string(otherwise)); }

  // Adds the member, null, if it is missing. Null becomes an object.
  Json& operator[](std::string_view name);
  template <std::integral Index>
  Json& operator[](Index index) {
    return at(std::size_t(index));
  }
  // Adds a value to a list. Null becomes a list.
  void push_back(Json value);
  // Sets the members that `other`, an object, has. Null becomes an object.
  void update(const Json& other);
  void erase(std::string_view name);

  // One line, or with so many spaces a level. Bytes that are not UTF-8 become U+FFFD, numbers that are not finite null. `ascii`: what is
  // not ASCII is escaped.
  std::string dump(int indent = -1, bool ascii = false) const;

  // Numbers of different types are equal if their values are. Members may have any order.
  friend bool operator==(const Json& a, const Json& b);
  friend std::ostream& operator<<(std::ostream& out, const Json& json);

 private:
  using List = std::vector<Json>;
  using Value = std::variant<std::monostate, bool, std::int64_t, std::uint64_t, double, std::string, List, Members>;
  friend class JsonText;

  explicit Json(Value value) : value_(std::move(value)) {}
  [[noreturn]] void IsNo(const char* type) const;  // throws

  Value value_;
};

// What stands in braces. It is moved from, which the values of a list of initializers otherwise could not be.
struct Json::Item {
  // NOLINTBEGIN(google-explicit-constructor, bugprone-forwarding-reference-overload): see above
  template <class T>
  requires(!std::is_same_v<std::remove_cvref_t<T>, Item> && std::is_convertible_v<T, Json>) Item(T&& from) : value(std::forward<T>(from)) {}
  Item(std::initializer_list<Item> items) : value(items) {}
  // NOLINTEND(google-explicit-constructor, bugprone-forwarding-reference-overload)

  mutable Json value;
};

template <class T>
T Json::get() const {
  if constexpr (std::is_same_v<T, Json>) {
    return *this;
  } else if constexpr (std::is_same_v<T, std::string>) {
    return text();
  } else if constexpr (std::is_same_v<T, bool>) {
    return is_boolean() ? std::get<bool>(value_) : (IsNo("truth value"), false);
  } else if constexpr (std::is_arithmetic_v<T>) {
    if (const auto* number = std::get_if<double>(&value_)) return T(*number);
    if (const auto* number = std::get_if<std::int64_t>(&value_)) return T(*number);
    if (const auto* number = std::get_if<std::uint64_t>(&value_)) return T(*number);
    IsNo("number");
  } else if constexpr (requires { typename T::mapped_type; }) {
    if (!is_object()) IsNo("object");
    T values;
    for (const auto& [name, value] : items()) values.emplace(name, value.template get<typename T::mapped_type>());
    return values;
  } else {
    if (!is_array()) IsNo("list");
    T values;
    values.reserve(size());
    for (const Json& value : *this) values.push_back(value.get<typename T::value_type>());
    return values;
  }
}

}  // namespace slabstream
