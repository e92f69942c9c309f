// What every call of libhdf5 needs: the lock, identifiers that are given back, and why a call failed.
#pragma once

#include <hdf5.h>

#include <mutex>
#include <string>
#include <utility>

namespace slabstream {

// libhdf5 is used by one thread at a time. The first lock sets the library up: it prints nothing, loads no plugins and follows no links to
// other files.
class Hdf5Lock {
 public:
  Hdf5Lock();

 private:
  std::lock_guard<std::mutex> lock_;
};

// Closes what it owns; under the lock.
class Hdf5Id {
 public:
  using Close = herr_t (*)(hid_t);
  Hdf5Id(hid_t id, Close close) : id_(id), close_(close) {}
  Hdf5Id(Hdf5Id&& other) noexcept : id_(other.Release()), close_(other.close_) {}
  Hdf5Id& operator=(Hdf5Id&&) = delete;
  ~Hdf5Id() {
    if (id_ >= 0) (void)close_(id_);
  }

  bool ok() const { return id_ >= 0; }
  hid_t id() const { return id_; }
  hid_t Release() { return std::exchange(id_, hid_t{-1}); }

 private:
  hid_t id_;
  const Close close_;
};

// What libhdf5 says of the call that failed last: "object 'x' doesn't exist". Under the lock.
std::string Hdf5Complaint();
// Whether what failed first in it is of this kind.
bool Hdf5FailedFirst(hid_t major, hid_t minor);

}  // namespace slabstream
