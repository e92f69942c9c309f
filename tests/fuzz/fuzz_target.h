// Fuzz targets: for each decoder of bytes from outside, what must hold for every input, and inputs to begin with.
//
// The same targets run in three ways: in the ordinary suite over their seeds and over altered seeds (seeds_test.cpp); under libFuzzer,
// which looks for inputs that reach new code (fuzz_main.cpp, deploy/check fuzz); and alone over one input that libFuzzer found.
#pragma once

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <cstring>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/check.h"
#include "common/base/status.h"

namespace slabstream {

using FuzzBytes = std::vector<std::byte>;

struct FuzzTarget {
  std::string_view name;
  std::string_view decoders;  // what it runs, for people
  // CHECKs what must hold. Whether the decoders took the input.
  bool (*run)(std::span<const std::byte> input);
  // Inputs that the decoders take.
  std::vector<FuzzBytes> (*seeds)();
};

// The only list.
const std::vector<FuzzTarget>& FuzzTargets();
// Null: no target has this name.
const FuzzTarget* FindFuzzTarget(std::string_view name);

// Reads the numbers in front of an input and then the rest of it. Bytes that are missing are zeros.
class FuzzInput {
 public:
  explicit FuzzInput(std::span<const std::byte> bytes) : rest_(bytes) {}

  template <std::unsigned_integral T>
  T Take() {
    T value = 0;
    const std::size_t count = std::min(sizeof(T), rest_.size());
    std::memcpy(&value, rest_.data(), count);
    rest_ = rest_.subspan(count);
    return value;
  }
  // Up to the next line feed, which is left out; the rest if there is none.
  std::string TakeLine() {
    const std::string_view text = Text();
    const std::size_t end = text.find('\n');
    std::string line(text.substr(0, end));
    rest_ = rest_.subspan(end == std::string_view::npos ? rest_.size() : end + 1);
    return line;
  }
  std::span<const std::byte> rest() const { return rest_; }
  std::string_view Text() const { return {reinterpret_cast<const char*>(rest_.data()), rest_.size()}; }

 private:
  std::span<const std::byte> rest_;
};

// The inverse, for seeds.
class FuzzSeed {
 public:
  template <std::unsigned_integral T>
  FuzzSeed& Put(T value) {
    return Put(std::as_bytes(std::span(&value, 1)));
  }
  FuzzSeed& Put(std::span<const std::byte> bytes);
  FuzzSeed& Put(std::string_view text) { return Put(std::as_bytes(std::span(text))); }
  FuzzBytes bytes() const { return bytes_; }

 private:
  FuzzBytes bytes_;
};
inline FuzzBytes SeedOf(std::string_view text) { return FuzzSeed().Put(text).bytes(); }

// Where targets make the files that their decoders read: in memory, if this machine has a place for that.
std::filesystem::path PlaceOfFuzzFiles();

// CHECKs that a refusal is what a user can be shown: one line of bounded length.
void CheckRefusal(const Status& status);

}  // namespace slabstream
