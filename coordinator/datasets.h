// DatasetTable: the catalogue's names and how far each has been loaded. A dataset is loaded at its first use; a failed load is tried again
// at the next request. Every load has a number, so that results of an earlier load are recognised. Loaded datasets that nobody uses may be
// unloaded, the least recently used one first; they are loaded again when they are asked for.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/planning/frame_plan.h"
#include "common/wire/client_messages.h"

namespace slabstream {

using LoadId = std::uint32_t;

class DatasetTable {
 public:
  struct Entry {
    DatasetState state = DatasetState::kUnloaded;
    LoadId load = 0;                               // the last one begun; 0: none
    DatasetId id = 0;                              // kReady only
    std::shared_ptr<const VolumeSummary> summary;  // kReady only
    std::string error;                             // kFailed only
    std::uint64_t bytes = 0;                       // kReady only: memory of its voxels
    std::uint64_t last_use = 0;                    // greater: later
  };

  explicit DatasetTable(const std::vector<std::string>& names);

  const Entry* Find(const std::string& name) const;     // null: not in the catalogue
  Status NoSuchDataset(const std::string& name) const;  // NotFound, naming what there is
  LoadId BeginLoad(const std::string& name);            // of an unloaded or failed one
  void Use(const std::string& name);                    // a request asks for it

  // The end of a load. False: another one was begun since, or none; nothing changes.
  bool Loaded(const std::string& name, LoadId load, DatasetId id, std::shared_ptr<const VolumeSummary> summary, std::uint64_t bytes);
  // The end of the load that is under way. False: none is.
  bool Failed(const std::string& name, const Status& status);

  std::uint64_t bytes() const;  // of all loaded ones
  // Unloads the least recently used one of those that are not `in_use`. nullopt: there is none.
  std::optional<DatasetId> UnloadOne(const std::function<bool(DatasetId)>& in_use);

  std::vector<DatasetStatus> Report() const;  // by name

 private:
  std::map<std::string, Entry> entries_;
  LoadId last_load_ = 0;
  std::uint64_t uses_ = 0;
};

}  // namespace slabstream
