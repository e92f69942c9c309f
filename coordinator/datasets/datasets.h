// DatasetTable: the catalogue as it is now, and how far each dataset has been loaded. A dataset is loaded at its first use; a failed load
// is tried again at the next request. Every load has a number, so that results of an earlier load are recognised. Loaded datasets that
// nobody uses may be unloaded, the least recently used one first; they are loaded again when they are asked for.
//
// Beside a dataset stand entries of its parts, which are loaded at their first use like a dataset, and go with it: a field at a time
// (PartName) other than what the dataset's own source shows, and each level (LevelName) of what has several. What has several levels holds
// no voxels itself.
//
// Names come and go, and files change. Voxels that have left the table, but that frames are still rendered from, are retired:
// they stay until no frame uses them.
#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <stop_token>
#include <string>
#include <vector>

#include "common/base/read_share.h"
#include "common/base/status.h"
#include "common/base/time.h"
#include "common/planning/frame_plan.h"
#include "common/planning/levels.h"
#include "common/view/clip.h"
#include "common/wire/client_messages.h"
#include "coordinator/datasets/check_counter.h"
#include "data/catalogue/data_source.h"

namespace slabstream {

using LoadId = std::uint32_t;

// Entries of parts. No dataset of a catalogue has such a name.
inline std::string LevelName(const std::string& name, int level) { return name + '\n' + std::to_string(level); }
inline std::string PartName(const std::string& dataset, int field, int time) {
  return fmt::format("{}\nfield {} time {}", dataset, field, time);
}
// What is shown of an owned dataset while owners are gone.
inline std::string PartWithout(const std::string& dataset, Missing missing) {
  return dataset + (missing == Missing::kSkip ? "\nwhat is there" : "\nlast time");
}
inline std::string PlaneName(const std::string& through, const ClipSlab& slab) {
  const Vec3 at = slab.through.value_or(Vec3{});
  return fmt::format("{}\nplane {},{},{} at {},{},{}", through, slab.normal.x, slab.normal.y, slab.normal.z, at.x, at.y, at.z);
}
inline bool IsPart(const std::string& name) { return name.find('\n') != std::string::npos; }
inline bool IsLevelName(const std::string& name) { return IsPart(name) && name.find(' ', name.rfind('\n')) == std::string::npos; }
inline std::string DatasetOfPart(const std::string& name) { return name.substr(0, name.find('\n')); }

inline constexpr std::size_t kMostParts = 1024;  // of all datasets; more only while requests need them: a source that is open takes memory

inline std::string InQuotes(const std::string& name) { return '"' + name + '"'; }

// An entry of the table, named for messages: dataset "scan", or level 2 of field 1 time 0 of dataset "scan".
inline std::string Named(const std::string& entry) {
  const std::size_t last = entry.rfind('\n');
  if (last == std::string::npos) return "dataset " + InQuotes(entry);
  return (IsLevelName(entry) ? "level " : "") + entry.substr(last + 1) + " of " + Named(entry.substr(0, last));
}

// Work that is told to stop when nobody waits for it any more: when the last holder of this drops it.
struct Wanted {
  Wanted() = default;
  ~Wanted() { stop.request_stop(); }
  void End() { stop = std::stop_source(std::nostopstate); }  // it is done
  Wanted(const Wanted&) = delete;
  Wanted& operator=(const Wanted&) = delete;
  std::stop_source stop;
};

class DatasetTable {
 public:
  struct Entry {
    DataSource source;
    DatasetState state = DatasetState::kUnloaded;
    Time since;                                    // in this state
    LoadId load = 0;                               // the last one begun; 0: none
    std::shared_ptr<Wanted> loading = {};          // kLoading only
    std::optional<Time> left;                      // kLoading only: since when nobody waits for it
    bool goes_on = false;                          // kLoading only: whether anybody waits or not
    ReadShare read;                                // kLoading only: of its samples, as far as is known
    DatasetId id = 0;                              // kReady only
    std::shared_ptr<const VolumeSummary> summary;  // kReady only
    std::shared_ptr<const VolumeLevels> levels;    // kReady only, of a dataset with several: it has neither an id nor a summary
    std::shared_ptr<const DatasetFields> fields;   // of a dataset, once it was ready; null: it has one field, of which nothing is known
    std::shared_ptr<VolumeSource> opened;  // gives other times and channels (DataSource::beside); null: nothing is open, or it holds voxels
    std::map<int, std::shared_ptr<const VolumeSummary>> statistics;  // of a dataset with several times: of its fields, as far as known
    std::shared_ptr<const FileStamp> stamp;                          // kReady only: of its files as they were read; null: they never change
    std::string error;                                               // kFailed only
    std::uint64_t bytes = 0;                                         // kReady only: memory of its voxels beside what the source holds
    std::uint64_t last_use = 0;                                      // greater: later
    CheckCounter checks;                                             // at its files, while it is ready
    // Not in the catalogue: somebody asks for it, and this check of the folders will tell whether it is there. 0: it is in the catalogue.
    CheckId awaited = 0;
    // Of a dataset that processes hold: as it was when it was ready last; null: it never was. It is told until there is another time, and
    // pictures while owners are gone have its statistics.
    std::shared_ptr<const Entry> before = {};

    // What is known of its voxels before a level is chosen. kReady only.
    const std::shared_ptr<const VolumeSummary>& overview() const { return levels != nullptr ? levels->overview : summary; }
    // People watch for its next time (data/open/file_times.h).
    bool MayGrow() const { return source.path.find('*') != std::string::npos || (fields != nullptr && fields->times.count > 1); }
  };

  DatasetTable(Catalogue catalogue, std::set<std::string> folders);

  bool IsListed(const std::string& name) const;  // in the catalogue
  Entry* Find(const std::string& name);          // null: neither in the catalogue nor awaited
  const Entry* Find(const std::string& name) const;
  // Ready, by this load.
  Entry* FindLoad(const std::string& name, LoadId load);
  Status NoSuchDataset(const std::string& name) const;            // NotFound, naming what there is
  std::size_t size() const;                                       // in the catalogue
  std::vector<std::string> Named(const std::string& name) const;  // in the catalogue: this one, or all times of a series (NameAtTime)
  void ForEach(const std::function<void(const std::string& name, Entry& entry)>& visit);

  // ---- the catalogue
  void Add(const std::string& name, DataSource source, Time now);  // no such name is in it; one that is awaited is there now
  void Await(const std::string& name, CheckId check);
  bool AddPart(const std::string& name, DataSource source, Time now);  // unless it is there: false
  // Forgets the field at a time that was used least recently, with its levels, if there are more than kMostParts parts. False: there are
  // not, or all are wanted.
  bool ClosePart(const std::function<bool(const std::string& name)>& is_wanted);
  // Retires what of a dataset is not wanted, as if it had never been loaded. What is of one time goes together, with fields and levels.
  void Release(const std::string& name, const std::function<bool(const std::string& entry)>& is_wanted, Time now);
  void Remove(const std::string& name);  // retires its voxels
  std::set<std::string> folders;         // folders that are watched

  // ---- voxels
  LoadId BeginLoad(const std::string& name, Time now);  // begins to load a dataset that is unloaded or failed
  void Use(const std::string& name);                    // a request asks for it
  // The end of a load. False: another one was begun since, or none; nothing changes.
  bool Loaded(const std::string& name, LoadId load, DatasetId id, std::shared_ptr<const VolumeSummary> summary, std::uint64_t bytes,
              std::shared_ptr<const FileStamp> stamp, std::shared_ptr<const DatasetFields> fields, Time now);
  // The same of a dataset with several levels, which are entries from then on.
  bool Opened(const std::string& name, LoadId load, std::shared_ptr<const VolumeLevels> levels, std::vector<DataSource> sources,
              std::shared_ptr<const FileStamp> stamp, std::shared_ptr<const DatasetFields> fields, Time now);
  bool IsLoading(const std::string& name, LoadId load) const;
  // Both retire the voxels that it has. The first one as if it had never been loaded.
  void Reset(const std::string& name, Time now);
  void Fail(const std::string& name, const Status& status, Time now);

  // Bytes of all voxels, the retired ones too; or of some of them.
  std::uint64_t bytes(const std::function<bool(DatasetId)>& which = [](DatasetId) { return true; }) const;
  // What is being loaded will take, as far as is known: as much as the largest other part of its kind.
  std::uint64_t LoadingBytes() const;
  bool Holds(DatasetId dataset) const;  // ready or retired
  std::size_t retired() const { return retired_.size(); }
  // Of one that is ready without levels, or is being loaded (0): whose voxels, if any, may go.
  DatasetId Unload(const std::string& name, Time now);
  // The same of the least recently used one of those that are not `in_use`, nor held by their source. nullopt: there is none.
  std::optional<DatasetId> UnloadOne(const std::function<bool(DatasetId)>& in_use, Time now);
  // Takes out those that are retired and not `in_use`. Their voxels may go.
  std::vector<DatasetId> TakeRetired(const std::function<bool(DatasetId)>& in_use);

  std::vector<DatasetStatus> Report(Time now) const;  // by name

 private:
  void Retire(const Entry& entry);
  void RemoveParts(const std::string& name);
  static Entry Forgotten(Entry& entry, Time now);
  template <class Table, class Visit>
  static void VisitAll(Table& table, Visit&& visit) {
    for (auto& [name, entry] : table.entries_) visit(name, entry);
    for (auto& [name, entry] : table.parts_) visit(name, entry);
  }

  std::map<std::string, Entry> entries_;
  std::map<std::string, Entry> parts_;          // by LevelName and PartName
  std::map<DatasetId, std::uint64_t> retired_;  // and the memory of each
  LoadId last_load_ = 0;
  std::uint64_t uses_ = 0;
};

}  // namespace slabstream
