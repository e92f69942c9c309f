// Context: what the sockets of a process share. Thread-safe. One a process; inproc endpoints meet within one context.
#pragma once

#include <memory>

namespace slabstream {

class Authenticator;

class Context {
 public:
  Context();
  ~Context();  // all sockets must be gone
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  // Decides who may connect to encrypted sockets. Made by the first call.
  Authenticator& authenticator();

  struct Impl;  // private to this folder
  Impl& impl() const { return *impl_; }

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace slabstream
