// Zarr hierarchies that tests write, by hand.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "common/json/json.h"
#include "data/volume_io/sample_type.h"
#include "tests/support/whole_file.h"

namespace slabstream {

using Counts = std::vector<std::uint64_t>;

struct ZarrSpec {
  int version = 2;
  Counts shape, chunk;
  Counts shard = {};  // version 3: of which chunks are parts; empty: there are none
  SampleType type = SampleType::kUint16;
  bool big_endian = false;
  char separator = '.';
  bool fortran = false;                           // version 2
  bool old_keys = false;                          // version 3: those of version 2
  std::vector<std::size_t> transpose = {};        // version 3, before shards are made
  std::vector<std::size_t> inner_transpose = {};  // version 3, of chunks in shards
  std::string codec = {};                         // a codec of PackBytes, except crc32c
  bool checked = false;                           // version 3: crc32c behind it
  bool shuffled = false;                          // version 2: the filter
  bool index_at_end = true, index_big_endian = false, index_checked = true;
  Json fill = 0;
  Json names = nullptr;  // version 3: dimension_names
};

// .zarray or zarr.json
Json MetadataOf(const ZarrSpec& spec);

// The value of an element, by its index along each axis.
using ElementAt = std::function<double(std::span<const std::uint64_t>)>;
// Whether a chunk is left out, by its index.
using IsMissing = std::function<bool(std::span<const std::uint64_t>)>;

// Calls `function` with every index in [0, counts), the last axis running fastest.
void ForEachIndex(const Counts& counts, const std::function<void(const Counts&)>& function);

// Every chunk of the array. Elements of chunks beyond the array are 77.
void WriteZarrArray(const std::string& folder, const ZarrSpec& spec, const ElementAt& element, const IsMissing& missing = {});

void WriteJson(const std::string& path, const Json& json);

// A group; of version 2 `attributes` are .zattrs.
void WriteZarrGroup(const std::string& folder, int version, const Json& attributes = nullptr);

// Whether a key or an address is that of a chunk. Metadata are asked for all at a time and the first that is there decides, so a server may
// get requests for the others after a source is open.
bool NamesChunk(const std::string& key);

}  // namespace slabstream
