// Values of a JSON file that a user names, each with its position in the file. Errors name the position, the value and what is expected.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/cli/parse.h"
#include "common/json/json.h"
#include "common/math/vec.h"

namespace slabstream {

inline Json VectorJson(const Vec3& v) { return Json::array({v.x, v.y, v.z}); }
// The double with the fewest digits that is this float: 0.2 instead of 0.20000000298023224.
double Decimal(float number);

// The value of a file that a user names: no object has a name twice.
inline Result<Json> ParseJson(std::string_view text) { return Json::Parse(text, {.names_differ = true}); }

// One value. Errors are stored in `mistake`, which all values of a file share. The first mistake stays, and values read after it do not
// matter.
class JsonValue {
 public:
  JsonValue(const Json& json, std::string place, std::optional<std::string>& mistake)
      : json_(&json), place_(std::move(place)), mistake_(&mistake) {}

  const Json& json() const { return *json_; }
  void Complain(const std::string& what) const;
  std::string Shown() const;  // the value's text, cut off if it is long

  using Read = std::function<void(const JsonValue&)>;
  // An object with no other fields than these; in names, '_' stands for '-', too. Calls the function of each field that is present.
  void Fields(const std::vector<std::pair<std::string, Read>>& fields) const;
  // A list of at least `least` values.
  void Each(const Read& read, std::size_t least = 1) const;
  bool Has(const char* field) const { return json_->is_object() && json_->contains(field); }
  JsonValue At(const char* field) const;  // the field must be present

  bool Is(std::string_view text) const { return *json_ == text; }
  std::string Text() const;
  double Number(const NumberRange& range) const;
  int Integer(int min, int max) const;
  bool Boolean() const;
  std::size_t OneOf(std::span<const std::string_view> names) const;  // its index

  // Functions that read a value into `to`.
  static Read Into(std::string& to) {
    return [&to](const JsonValue& value) { to = value.Text(); };
  }
  static Read Into(bool& to) {
    return [&to](const JsonValue& value) { to = value.Boolean(); };
  }
  template <class T>
  static Read Into(T& to, const NumberRange& range) {
    return [&to, range](const JsonValue& value) { to = value.Number(range); };
  }
  template <class T>
  static Read Into(T& to, int min, int max) {
    return [&to, min, max](const JsonValue& value) { to = value.Integer(min, max); };
  }

 private:
  const Json* json_;
  std::string place_;
  std::optional<std::string>* mistake_;
};

}  // namespace slabstream
