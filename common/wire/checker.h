// Checker: reads fields of a received message, each with its check, and keeps the first failure.
//
//   Checker check("Register");
//   out.threads = check.Range("threads", in.threads(), 1, 1024);   // fails as "Register.threads: 0 is not in [1, 1024]"
// A check that fails returns a harmless value and reading goes on, so that a codec is a plain list of its fields; its caller asks ok() at
// the end. Nothing here takes more memory than the message.
#pragma once

#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "common/base/status.h"

namespace slabstream {

class Checker {
 public:
  explicit Checker(std::string_view message) : path_(message) {}

  bool ok() const { return status_.ok(); }
  const Status& status() const { return status_; }

  // While the scope lives, field names are those of the message in `field`, or in item `index` of `field`.
  class [[nodiscard]] Scope {
   public:
    Scope(std::string& path, std::size_t length) : path_(path), length_(length) {}
    ~Scope() { path_.resize(length_); }
    Scope(const Scope&) = delete;
    Scope& operator=(const Scope&) = delete;

   private:
    std::string& path_;
    std::size_t length_;
  };
  Scope In(std::string_view field, std::optional<std::size_t> index = std::nullopt);

  // While the object lives, fields that are left out have their standard values (proto/slabstream/v1/about.proto).
  class [[nodiscard]] Standards {
   public:
    explicit Standards(bool& fills) : fills_(fills) { fills_ = true; }
    ~Standards() { fills_ = false; }
    Standards(const Standards&) = delete;
    Standards& operator=(const Standards&) = delete;

   private:
    bool& fills_;
  };
  Standards Fill() { return Standards(fills_); }
  bool fills() const { return fills_; }

  // InvalidArgument "path.field: what"; an empty field means the message itself. Only the first failure counts.
  void Fail(std::string_view field, std::string_view what);

  // Records what a Validate function returned.
  void Adopt(const Status& status);

  void That(bool condition, std::string_view field, std::string_view what) {
    if (!condition) Fail(field, what);
  }

  // The value if it lies in [min, max], else min.
  template <std::unsigned_integral T>
  T Range(std::string_view field, T value, std::uint64_t min, std::uint64_t max) {
    if (value >= min && value <= max) return value;
    FailRange(field, value, min, max);
    return static_cast<T>(min);
  }

  // Neither NaN nor infinite; else 0. A field of an item or a scalar item: enter In() with its index and leave the name empty.
  template <std::floating_point T>
  T Finite(std::string_view field, T value) {
    if (std::isfinite(value)) return value;
    FailNumber(field, value, "a finite number");
    return 0;
  }

  // In [min, max] and not NaN; else min.
  double Between(std::string_view field, double value, double min, double max);

  // Finite and above 0; else 1.
  double Positive(std::string_view field, double value);

  // A text of min_bytes to max_bytes; else "".
  std::string Text(std::string_view field, const std::string& value, std::size_t min_bytes, std::size_t max_bytes);

  // How many items of a repeated field to read: `size` if it is at most `max`, else 0.
  int Count(std::string_view field, int size, std::size_t max);

  // Enums: 0 stands for "not set" on the wire, so that the wire number of the first enumerator is 1 and the others follow.
  template <class Enum>
  Enum OneOf(std::string_view field, int wire, Enum first, Enum last) {
    const int count = static_cast<int>(last) - static_cast<int>(first) + 1;
    if (wire >= 1 && wire <= count) return static_cast<Enum>(static_cast<int>(first) + wire - 1);
    FailEnum(field, wire);
    return first;
  }

 private:
  void FailRange(std::string_view field, std::uint64_t value, std::uint64_t min, std::uint64_t max);
  void FailNumber(std::string_view field, double value, std::string_view expected);
  void FailEnum(std::string_view field, int wire);

  std::string path_;
  Status status_;
  bool fills_ = false;
};

}  // namespace slabstream
