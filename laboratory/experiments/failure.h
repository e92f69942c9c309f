// Failure: how the functions of experiments fail. An experiment is a script, and every failure ends it; so they return values and
// throw the Status, which RunExperiment catches. Everywhere else a function returns Result<T>: OrThrow takes what is in it.
#pragma once

#include <exception>
#include <utility>

#include "common/base/status.h"

namespace slabstream {

class Failure : public std::exception {
 public:
  explicit Failure(Status status) : status_(std::move(status)) {}
  const Status& status() const { return status_; }
  const char* what() const noexcept override { return status_.message().c_str(); }

 private:
  Status status_;
};

inline void OrThrow(Status status) {
  if (!status.ok()) throw Failure(std::move(status));
}

template <class T>
T OrThrow(Result<T> result) {
  OrThrow(result.status());
  return *std::move(result);
}

}  // namespace slabstream
