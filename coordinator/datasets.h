// DatasetTable: the catalogue's names and how far each has been loaded. A dataset is loaded at its first use; a failed load is tried again
// at the next request. Every load has its own id, so that results of an earlier load are recognised.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/planning/frame_plan.h"
#include "common/wire/client_messages.h"

namespace slabstream {

class DatasetTable {
 public:
  struct Entry {
    DatasetState state = DatasetState::kUnloaded;
    DatasetId id = 0;                              // of the last load begun; 0: none
    std::shared_ptr<const VolumeSummary> summary;  // kReady only
    std::string error;                             // kFailed only
  };

  explicit DatasetTable(const std::vector<std::string>& names);

  const Entry* Find(const std::string& name) const;     // null: not in the catalogue
  Status NoSuchDataset(const std::string& name) const;  // NotFound, naming what there is
  DatasetId BeginLoad(const std::string& name);         // of an unloaded or failed one; its new id

  // The end of the load `id`. False: another load was begun since, or none; nothing changes.
  bool Loaded(const std::string& name, DatasetId id, std::shared_ptr<const VolumeSummary> summary);
  // The end of the load that is under way. False: none is.
  bool Failed(const std::string& name, const Status& status);

  std::vector<DatasetStatus> Report() const;  // by name

 private:
  std::map<std::string, Entry> entries_;
  DatasetId last_id_ = 0;
};

}  // namespace slabstream
