// Metadata of stores: JSON from anywhere, read field by field. Every field knows its place, so that a message names store, object and
// field.
#pragma once

#include <cstdint>
#include <future>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "common/json/json.h"
#include "data/stores/store.h"

namespace slabstream::metadata {

inline constexpr std::uint64_t kMostElements = std::uint64_t{1} << 53;  // along an axis: whole numbers that every writer of JSON keeps

// The numbers that Python writes although JSON has none of them become texts: "NaN", "Infinity", "-Infinity". DataLoss: no JSON, or values
// that nest deeper than any metadata do. `object` names it in messages.
Result<Json> ParseJson(const std::string& object, std::string_view text);

// An object that is being read. Several may be at a time: a server answers them in the time of one.
class JsonReading {
 public:
  JsonReading(Store& store, const std::string& key) : object_(store.name() + "/" + key), bytes_(BeginRead(store, key)) {}
  // Once. nullopt: there is no such object. Errors of Store::Read and ParseJson. Waits.
  Result<std::optional<Json>> Get();

 private:
  std::string object_;
  std::future<Result<Bytes>> bytes_;
};
inline Result<std::optional<Json>> ReadJson(Store& store, const std::string& key) { return JsonReading(store, key).Get(); }

// "path/name"; a path may be empty.
std::string Join(std::string_view path, std::string_view name);

// A value of the metadata, or that there is none. Lives no longer than the JSON. Errors are InvalidArgument.
class Field {
 public:
  Field(std::string object, const Json& value) : object_(std::move(object)), value_(&value) {}

  bool given() const { return value_ != nullptr && !value_->is_null(); }
  bool stated() const { return value_ != nullptr; }  // given, or null
  bool is_object() const { return given() && value_->is_object(); }
  bool is_array() const { return given() && value_->is_array(); }
  bool is_text() const { return given() && value_->is_string(); }
  std::size_t size() const { return given() ? value_->size() : 0; }
  const Json& value() const { return *value_; }          // the value; the field must be stated
  const std::string& object() const { return object_; }  // "/data/scan.zarr/zarr.json"

  Field operator[](std::string_view name) const;  // not stated if this is no object
  Field operator[](std::size_t number) const;     // not stated if this is no array, or too short

  Result<std::string> Text() const;
  Result<double> Number() const;                                               // finite
  Result<std::uint64_t> Whole(std::uint64_t least, std::uint64_t most) const;  // in [least, most]
  // So many numbers, each in [1, kMostElements]. 0: at least one and at most kMaxArrayAxes.
  Result<std::vector<std::uint64_t>> Counts(std::size_t axes) const;

  // "/data/scan.zarr/.zarray: chunks[1] is 0, must be ..."
  Status Wrong(std::string_view must_be) const;

 private:
  Field(std::string object, std::string place, const Json* value) : object_(std::move(object)), place_(std::move(place)), value_(value) {}

  std::string object_;
  std::string place_;  // "codecs[0].name"; "": the whole
  const Json* value_;  // null: there is none
};

}  // namespace slabstream::metadata
