// Volume files with a text header, NRRD and MetaImage: lines "key: value" or "key = value", then the samples, or the name of their file.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "data/volume_io/raw_volume.h"

namespace slabstream {

struct TextHeader {
  std::string path, format;  // for messages
  std::string first_line;
  std::map<std::string, std::string> fields;  // both sides without blanks around them
  std::int64_t end = 0;                       // bytes of the file up to and including the line that ends the header

  // The value of the first of these keys that the header has.
  std::optional<std::string> Find(std::initializer_list<const char*> keys) const;
  std::optional<std::string> Find(const char* key) const { return Find({key}); }
  // Its numbers; `if_absent` if the header has none of the keys. Numbers may be nan, and grouped as "(1,0,0) (0,1,0) none".
  // InvalidArgument unless the value is exactly `count` numbers.
  Result<std::vector<double>> Numbers(std::initializer_list<const char*> keys, std::size_t count, std::vector<double> if_absent) const;
  // The numbers of the field `sizes`. InvalidArgument unless there are as many as the field `dimension` says.
  Result<std::vector<double>> Sizes(const char* dimension, const char* sizes) const;

  // Where the samples are. A relative `name` of their file begins at the header's folder; without a name they are behind the header.
  // InvalidArgument: the name stands for several files.
  Result<Payload> PayloadIn(const std::optional<std::string>& name) const;
  // How many bytes to skip in front of the samples: the value of the field `key`, where -1 means that the samples are the last
  // `sample_bytes` of the payload's file. InvalidArgument: no number of at least -1. NotFound: no such file.
  Result<std::int64_t> BytesToSkip(const char* key, const std::string& value, const Payload& payload, std::int64_t sample_bytes) const;

  // InvalidArgument. The message names the path, and that of NotAVolume also the format.
  Status Refused(const std::string& why) const { return Status::InvalidArgument(path + ": " + why); }
  Status NotAVolume(const std::string& why) const { return Refused("not a " + format + " volume: " + why); }
};

// The three of `numbers` from number `first` on.
inline Vec3 Triple(const std::vector<double>& numbers, std::size_t first = 0) {
  return {numbers[first], numbers[first + 1], numbers[first + 2]};
}

struct TextFormat {
  std::string name;
  std::string first_line;  // how it begins
  char separator;
  bool ignores_case;                  // of keys: they are found by their lower case
  std::string last_key;               // ends the header, like an empty line; "": none does
  std::vector<const char*> required;  // keys of fields that must not be empty
  Result<RawHeader> (*read_header)(const TextHeader& text, const ReadOptions& options);
  Result<Payload> (*find_payload)(const TextHeader& text, std::int64_t sample_bytes);
};

// Skips lines of the header that begin with # and lines without the separator. Errors as in volume_reader.h.
Result<LocatedSamples> LocateInTextVolume(const std::string& path, const TextFormat& format, const ReadOptions& options);

std::string ToLower(std::string text);

}  // namespace slabstream
