// Volume files with a text header, NRRD, MetaImage and BOV: lines "key: value" or "key = value", then the samples, or the name of their
// file.
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
  std::vector<std::string> list;              // the names of the samples' files that follow a field of one of the data_keys with LIST

  // The value of the first of these keys that the header has.
  std::optional<std::string> Find(std::initializer_list<const char*> keys) const;
  std::optional<std::string> Find(const char* key) const { return Find({key}); }
  // Its numbers; `if_absent` if the header has none of the keys. Numbers may be nan, and grouped as "(1,0,0) (0,1,0)".
  // InvalidArgument unless the value is exactly `count` numbers.
  Result<std::vector<double>> Numbers(std::initializer_list<const char*> keys, std::size_t count, std::vector<double> if_absent) const;
  // The numbers of the field `sizes`. InvalidArgument unless there are as many as the field `dimension` says.
  Result<std::vector<double>> Sizes(const char* dimension, const char* sizes) const;

  // InvalidArgument. The message names the path, and that of NotAVolume also the format.
  Status Refused(const std::string& why) const { return Status::InvalidArgument(path + ": " + why); }
  Status NotAVolume(const std::string& why) const { return Refused("not a " + format + " volume: " + why); }
};

// The three of `numbers` from number `first` on.
inline Vec3 Triple(const std::vector<double>& numbers, std::size_t first = 0) {
  return {numbers[first], numbers[first + 1], numbers[first + 2]};
}

// What the header's fields say of the samples.
struct TextPayload {
  // The value of a data key: a file's name, where a relative one begins at the header's folder; LIST, and behind it anything; or a pattern
  // with %d for the numbers FIRST to LAST, as in "slice%03d.raw FIRST LAST STEP". Without numbers they begin with 1, and there are as many
  // as `slices`. None: the samples are behind the header.
  std::optional<std::string> file;
  std::int64_t slices = 1;
  Compression compression = Compression::kNone;
  bool big_endian = false;
  // Fields that say how much to skip in front of the samples in each file. Lines come first, in compressed files, too; then bytes, those of
  // the decompressed stream. -1: all but the bytes of the samples at the end of the file.
  const char* lines_key = "";
  std::string lines = "0";
  const char* bytes_key = "";
  std::string bytes = "0";
};

struct TextFormat {
  std::string name;
  std::string first_line;              // how it begins
  const char* separators;              // each may stand between key and value
  std::string key_value;               // separates what is no field: it is found by its key with this behind it; "": all are fields
  bool ignores_case;                   // whether keys are found by their lower case
  std::vector<const char*> data_keys;  // fields that name the samples' files
  bool data_ends_header;               // such a field is the last one; else an empty line ends the header
  bool header_alone;                   // the header is all of the file: only its end ends it
  std::vector<const char*> required;   // keys of fields that must not be empty
  Result<RawHeader> (*read_header)(const TextHeader& text, const ReadOptions& options);
  Result<TextPayload> (*read_payload)(const TextHeader& text);
};

// Skips lines of the header that begin with # and lines without the separator. Errors as of VolumeFormat::locate.
Result<LocatedSamples> LocateInTextVolume(const std::string& path, const TextFormat& format, const ReadOptions& options);

std::string ToLower(std::string text);

}  // namespace slabstream
