// StoreFolder: a folder of brick stores and cell stores, as the processes of one host share it. Each store is a folder beside a lock file:
//
//   NAME        complete, or what a process has written of it so far. A complete one is sealed: a file in it tells how many files there are
//               and how many bytes, so that a store of which somebody has removed a part is not used
//   NAME.lock   whoever uses the store holds it shared, whoever writes or removes it holds it alone; its time is that of the last use
//
// Locks are those of common/files/file_lock.h. The folder and all in it are for this user alone (cache_folder.h). Any thread.
#pragma once

#include <cstdint>
#include <stop_token>
#include <string>

#include "common/base/status.h"
#include "common/files/file_descriptor.h"
#include "common/files/file_lock.h"

namespace slabstream {

class StoreFolder {
 public:
  // `budget`: bytes that all stores in it may take together. `patience`: as of LockFile.
  StoreFolder(std::string path, std::uint64_t budget, Duration patience = kLockPatience)
      : path_(std::move(path)), budget_(budget), patience_(patience) {}

  // Stores in the cache folder, which take at most a quarter of its disk.
  static Result<StoreFolder> Usual();

  const std::string& path() const { return path_; }
  std::string PathOf(const std::string& name) const { return path_ + "/" + name; }

  // A lock of a store, held until it is destroyed.
  using Lock = FileDescriptor;
  // Waits until nobody writes the store, and notes that it is used. Errors of MakeOwnFolder and LockFile.
  Result<Lock> LockShared(const std::string& name, const std::stop_token& stop = {}) const;
  // Waits until nobody else uses or writes it. Whoever writes for long touches the lock.
  Result<Lock> LockAlone(const std::string& name, const std::stop_token& stop = {}) const;

  // Bytes that one more store may take: what the budget and the disk leave, beside stores that are in use.
  std::uint64_t RoomFor(const std::string& name) const;
  // Removes others that nobody uses, those first whose last use is longest ago, until there is room for a store of so many bytes.
  void MakeRoom(const std::string& name, std::uint64_t bytes) const;
  // What it takes now.
  std::uint64_t BytesOf(const std::string& name) const;
  bool IsWhole(const std::string& name) const;
  // Whoever calls these holds it alone. Begin makes its folder. Unavailable: the folder cannot be made, the seal cannot be written.
  Status Begin(const std::string& name) const;
  Status Seal(const std::string& name) const;
  void Remove(const std::string& name) const;

 private:
  std::string LockOf(const std::string& name) const;
  Result<Lock> Wait(const std::string& name, LockMode mode, const std::stop_token& stop) const;
  std::uint64_t Room(std::uint64_t own, std::uint64_t others) const;

  std::string path_;
  std::uint64_t budget_;
  Duration patience_;
};

}  // namespace slabstream
