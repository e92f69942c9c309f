#include "common/json/json.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <ostream>
#include <set>
#include <stdexcept>

#include "common/base/overloaded.h"
#include "common/base/printable.h"

namespace slabstream {

// Makes a value of the parser's events, and the writer's value of a value.
class JsonText {
 public:
  using Writer = nlohmann::ordered_json;

  explicit JsonText(const JsonLimits& limits) : limits_(limits) {}
  Json& whole() { return whole_; }
  const std::string& mistake() const { return mistake_; }

  bool null() { return Take(Json()); }
  bool boolean(bool value) { return Take(value); }
  bool number_integer(std::int64_t value) { return Take(value); }
  bool number_unsigned(std::uint64_t value) { return Take(value); }
  bool number_float(double value, const std::string&) { return Take(value); }
  bool string(std::string& value) { return Take(std::move(value)); }
  bool binary(Writer::binary_t&) { return false; }  // no text has any
  bool start_array(std::size_t) { return Open(Json::array()); }
  bool start_object(std::size_t) {
    names_.emplace_back();
    return Open(Json::object());
  }
  bool key(std::string& name) {
    if (limits_.names_differ && !names_.back().insert(name).second)
      return Fail(fmt::format("field '{}' is given twice", name.substr(0, 64)));
    std::get<Json::Members>(open_.back()->value_).emplace_back(std::move(name), Json());
    return true;
  }
  bool end_array() {
    open_.pop_back();
    return true;
  }
  bool end_object() {
    names_.pop_back();
    return end_array();
  }
  // Behind its name in brackets, the text of the exception says what is wrong and where.
  bool parse_error(std::size_t, const std::string&, const std::exception& error) {
    const std::string_view what = error.what();
    return Fail(fmt::format("not JSON: {}", what.substr(what.find("] ") + 2)));
  }

  static Writer ToWrite(const Json& json) {
    const auto list = [](const Json::List& values) {
      Writer written = Writer::array();
      for (const Json& value : values) written.push_back(ToWrite(value));
      return written;
    };
    const auto object = [](const Json::Members& members) {
      Writer written = Writer::object();
      // As a vector: its own insertion compares a name with all before it.
      auto& all = static_cast<Writer::object_t::Container&>(written.get_ref<Writer::object_t&>());
      for (const auto& [name, value] : members) all.emplace_back(name, ToWrite(value));
      return written;
    };
    return std::visit(Overloaded{[](std::monostate) { return Writer(); }, list, object, [](const auto& value) { return Writer(value); }},
                      json.value_);
  }

 private:
  bool Fail(std::string why) {
    if (mistake_.empty()) mistake_ = std::move(why);
    return false;
  }
  // Where the next value belongs: what is open is a list, or an object whose last member waits for it.
  Json& Place() {
    if (open_.empty()) return whole_;
    if (auto* list = std::get_if<Json::List>(&open_.back()->value_)) return list->emplace_back();
    return std::get<Json::Members>(open_.back()->value_).back().second;
  }
  bool Take(Json value) {
    Place() = std::move(value);
    return true;
  }
  bool Open(Json value) {
    if (int(open_.size()) == limits_.depth) return Fail(fmt::format("values nest more than {} deep", limits_.depth));
    Json& place = Place();
    place = std::move(value);
    open_.push_back(&place);
    return true;
  }

  const JsonLimits limits_;
  Json whole_;
  std::vector<Json*> open_;                   // lists and objects that have begun and not ended; none moves before it ends
  std::vector<std::set<std::string>> names_;  // of each open object
  std::string mistake_;
};

Result<Json> Json::Parse(std::string_view text, const JsonLimits& limits) {
  JsonText reading(limits);
  if (nlohmann::ordered_json::sax_parse(text, &reading)) return std::move(reading.whole());
  return Printable(Status::InvalidArgument(reading.mistake()));
}

// A list of pairs that begin with a text is an object.
Json::Json(std::initializer_list<Item> items) {
  const auto is_member = [](const Item& item) { return item.value.is_array() && item.value.size() == 2 && item.value.front().is_string(); };
  if (!std::ranges::all_of(items, is_member)) {
    *this = array(items);
    return;
  }
  Members& members = value_.emplace<Members>();
  members.reserve(items.size());
  for (const Item& item : items) {
    List& pair = std::get<List>(item.value.value_);
    members.emplace_back(std::move(std::get<std::string>(pair[0].value_)), std::move(pair[1]));
  }
}

Json Json::array(std::initializer_list<Item> items) {
  List list;
  list.reserve(items.size());
  for (const Item& item : items) list.push_back(std::move(item.value));
  return Json(Value(std::move(list)));
}

std::size_t Json::size() const {
  if (const auto* list = std::get_if<List>(&value_)) return list->size();
  if (const auto* members = std::get_if<Members>(&value_)) return members->size();
  return is_null() ? 0 : 1;
}

const Json::Members& Json::items() const {
  static const Members kNone;
  const auto* members = std::get_if<Members>(&value_);
  return members == nullptr ? kNone : *members;
}

// From the end, since the last one of a name counts.
const Json* Json::find(std::string_view name) const {
  const Members& members = items();
  const auto found = std::find_if(members.rbegin(), members.rend(), [&](const auto& member) { return member.first == name; });
  return found == members.rend() ? nullptr : &found->second;
}

const Json& Json::at(std::string_view name) const {
  if (const Json* found = find(name)) return *found;
  throw std::runtime_error(fmt::format("the JSON has no '{}'", Printable(std::string(name))));
}

const Json& Json::at(std::size_t index) const {
  if (!is_array()) IsNo("list");
  if (index < size()) return begin()[index];
  throw std::runtime_error(fmt::format("the JSON has a list of {} values, and none at {}", size(), index));
}

const std::string& Json::text() const {
  if (!is_string()) IsNo("text");
  return std::get<std::string>(value_);
}

Json& Json::operator[](std::string_view name) {
  if (const Json* found = find(name)) return const_cast<Json&>(*found);
  if (is_null()) value_.emplace<Members>();
  if (!is_object()) IsNo("object");
  return std::get<Members>(value_).emplace_back(name, Json()).second;
}

void Json::push_back(Json value) {
  if (is_null()) value_.emplace<List>();
  if (!is_array()) IsNo("list");
  std::get<List>(value_).push_back(std::move(value));
}

void Json::update(const Json& other) {
  if (!other.is_object()) other.IsNo("object");
  for (const auto& [name, value] : other.items()) (*this)[name] = value;
}

void Json::erase(std::string_view name) {
  if (!is_object()) IsNo("object");
  std::erase_if(std::get<Members>(value_), [&](const auto& member) { return member.first == name; });
}

std::string Json::dump(int indent, bool ascii) const {
  return JsonText::ToWrite(*this).dump(indent, ' ', ascii, nlohmann::ordered_json::error_handler_t::replace);
}

bool operator==(const Json& a, const Json& b) {
  if (a.is_object() && b.is_object()) {
    const auto in_b = [&](const auto& member) {
      const Json* const other = b.find(member.first);
      return other != nullptr && member.second == *other;
    };
    return a.size() == b.size() && std::ranges::all_of(a.items(), in_b);
  }
  if (!a.is_number() || !b.is_number()) return a.value_ == b.value_;
  if (a.is_number_integer() && b.is_number_integer()) {
    const auto whole = [](const Json& json) {
      const auto* number = std::get_if<std::int64_t>(&json.value_);
      return std::pair(number != nullptr && *number < 0, json.get<std::uint64_t>());
    };
    return whole(a) == whole(b);
  }
  return a.get<double>() == b.get<double>();
}

std::ostream& operator<<(std::ostream& out, const Json& json) { return out << json.dump(); }

void Json::IsNo(const char* type) const {
  throw std::runtime_error(fmt::format("the JSON has {}, which is no {}", dump().substr(0, 60), type));
}

}  // namespace slabstream
