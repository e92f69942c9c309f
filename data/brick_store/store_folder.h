// StoreFolder: a folder of brick stores, as the processes of one host share it. Each store is a folder beside a lock file:
//
//   NAME        complete, or what a process has written of it so far. A complete one is sealed: a file in it tells how many files there are
//               and how many bytes, so that a store of which somebody has removed a part is not used
//   NAME.lock   whoever uses the store holds it shared, whoever writes or removes it holds it alone; its time is that of the last use
//
// Locks are the kernel's (flock), so they end with the process that holds them. Any thread.
#pragma once

#include <cstdint>
#include <string>

#include "common/base/file_descriptor.h"
#include "common/base/status.h"

namespace slabstream {

class StoreFolder {
 public:
  // `budget`: bytes that all stores in it may take together.
  StoreFolder(std::string path, std::uint64_t budget) : path_(std::move(path)), budget_(budget) {}

  // Stores in the cache folder, which take at most a quarter of its disk.
  static Result<StoreFolder> Usual();

  const std::string& path() const { return path_; }
  std::string PathOf(const std::string& name) const { return path_ + "/" + name; }

  // Of a store, until it is destroyed.
  using Lock = FileDescriptor;
  // Waits until nobody writes the store, and notes that it is used. Unavailable: the lock cannot be made.
  Result<Lock> LockShared(const std::string& name) const;
  // Waits until nobody else uses or writes it.
  Result<Lock> LockAlone(const std::string& name) const;

  // Bytes that one more store may take: what the budget and the disk leave, beside stores that are in use.
  std::uint64_t RoomFor(const std::string& name) const;
  // Removes others that nobody uses, those first whose last use is longest ago, until there is room for a store of so many bytes.
  void MakeRoom(const std::string& name, std::uint64_t bytes) const;
  // What it takes now.
  std::uint64_t BytesOf(const std::string& name) const;
  bool IsWhole(const std::string& name) const;
  // Whoever calls these holds it alone. Unavailable: the seal cannot be written.
  Status Seal(const std::string& name) const;
  void Remove(const std::string& name) const;

 private:
  Result<Lock> Wait(const std::string& name, int mode) const;
  std::uint64_t Room(std::uint64_t own, std::uint64_t others) const;

  std::string path_;
  std::uint64_t budget_;
};

}  // namespace slabstream
