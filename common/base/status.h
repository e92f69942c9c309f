// Status and Result<T>: how everything that comes from outside (wire, file, flags, a peer) reports failure.
//
// A message is one line that names the field, the value that was met and the limit or the expected value; it reaches the user as
// it is. Our own mistakes are not Status but CHECK (check.h). Both types are values: cheap to move, free of side effects.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <variant>

#include "common/base/check.h"

namespace slabstream {

enum class StatusCode : std::uint8_t {
  kOk = 0,
  kInvalidArgument = 1,    // the caller's input is wrong: exit status 2
  kNotFound = 2,           // a name, file or dataset does not exist: exit status 2
  kUnavailable = 3,        // nobody answers, no worker, service gone
  kResourceExhausted = 4,  // a memory or size ceiling
  kDataLoss = 5,           // damaged bytes: digest, truncation, undecodable message
  kCancelled = 6,          // the client asked for it
  kDeadlineExceeded = 7,   // time ran out
  kInternal = 8,           // a bug that was caught
};
inline constexpr int kStatusCodeCount = 9;

// Name of a code for logs and messages, such as "unavailable".
std::string_view ToString(StatusCode code);

class [[nodiscard]] Status {
 public:
  Status() = default;  // ok
  Status(StatusCode code, std::string message) : code_(code), message_(std::move(message)) {}

  static Status Ok() { return {}; }
  static Status InvalidArgument(std::string message) { return {StatusCode::kInvalidArgument, std::move(message)}; }
  static Status NotFound(std::string message) { return {StatusCode::kNotFound, std::move(message)}; }
  static Status Unavailable(std::string message) { return {StatusCode::kUnavailable, std::move(message)}; }
  static Status ResourceExhausted(std::string message) { return {StatusCode::kResourceExhausted, std::move(message)}; }
  static Status DataLoss(std::string message) { return {StatusCode::kDataLoss, std::move(message)}; }
  static Status Cancelled(std::string message) { return {StatusCode::kCancelled, std::move(message)}; }
  static Status DeadlineExceeded(std::string message) { return {StatusCode::kDeadlineExceeded, std::move(message)}; }
  static Status Internal(std::string message) { return {StatusCode::kInternal, std::move(message)}; }

  bool ok() const { return code_ == StatusCode::kOk; }
  StatusCode code() const { return code_; }
  const std::string& message() const { return message_; }

  friend bool operator==(const Status&, const Status&) = default;

 private:
  StatusCode code_ = StatusCode::kOk;
  std::string message_;
};

// Either a value or a Status that is not ok. Reading the value of a failed Result is a bug (CHECK).
template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::move(value)) {}        // NOLINT(google-explicit-constructor): `return value;` reads best
  Result(Status status) : state_(std::move(status)) {  // NOLINT(google-explicit-constructor)
    CHECK(!std::get<Status>(state_).ok()) << "a Result needs a value or a failure";
  }

  bool ok() const { return std::holds_alternative<T>(state_); }
  Status status() const { return ok() ? Status() : std::get<Status>(state_); }

  const T& value() const& {
    CHECK(ok()) << std::get<Status>(state_).message();
    return std::get<T>(state_);
  }
  T& value() & {
    CHECK(ok()) << std::get<Status>(state_).message();
    return std::get<T>(state_);
  }
  T&& value() && {
    CHECK(ok()) << std::get<Status>(state_).message();
    return std::get<T>(std::move(state_));
  }
  const T& operator*() const& { return value(); }
  T& operator*() & { return value(); }
  T&& operator*() && { return std::move(*this).value(); }
  const T* operator->() const { return &value(); }
  T* operator->() { return &value(); }

 private:
  std::variant<T, Status> state_;
};

}  // namespace slabstream
