#include "data/volume_io/grid_store.h"

#include <fmt/format.h>
#include <xxhash.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <functional>
#include <optional>
#include <utility>

#include "common/base/log.h"
#include "common/base/printable.h"
#include "common/files/file_stamp.h"
#include "common/files/store_folder.h"
#include "common/volume/memory_budget.h"
#include "data/cell_store/store_cells.h"

namespace slabstream {
namespace {

namespace fs = std::filesystem;

// The store of one state of a grid's files.
class GridStore {
 public:
  // `files`: FilesOfMesh. Errors of CacheFolder and StampFiles.
  static Result<GridStore> Of(const std::string& path, const std::vector<std::string>& files, const ReadOptions& options);
  GridStore(GridStore&&) noexcept = default;
  GridStore& operator=(GridStore&&) = delete;
  ~GridStore();  // removes what was begun and is no store

  // Waits while another process makes it. Null: there is none, or it is damaged.
  Result<std::shared_ptr<StoredCells>> Find() const;
  // Begins a new one, and waits if another process makes it: null: that one has made it.
  Result<std::unique_ptr<CellSpool>> Begin();
  // `loaded` is in the spool. `made`: called with the share of the work that is done.
  Status Make(LoadedMesh loaded, const VolumeGeometry& lattice, const std::function<void(double share)>& made);

 private:
  GridStore(StoreFolder folder, std::string name, std::vector<std::string> files, std::uint64_t stamp)
      : folder_(std::move(folder)), name_(std::move(name)), files_(std::move(files)), stamp_(stamp) {}

  StoreFolder folder_;
  std::string name_;
  std::vector<std::string> files_;
  std::uint64_t stamp_;                                 // of the files
  std::unique_ptr<StoreFolder::Lock> alone_ = nullptr;  // while it is made
};

Result<GridStore> GridStore::Of(const std::string& path, const std::vector<std::string>& files, const ReadOptions& options) {
  constexpr int kLayout = 1;  // to be raised when stores are made otherwise
  constexpr std::size_t kMostOfStem = 40;
  Result<StoreFolder> folder = StoreFolder::Usual();
  if (!folder.ok()) return folder.status();
  std::error_code error;
  std::vector<std::string> places;  // the same from every folder
  for (const std::string& file : files) places.push_back(fs::weakly_canonical(file, error).string());
  const Result<FileStamp> stamp = StampFiles(places);
  if (!stamp.ok()) return stamp.status();
  const std::string identity = fmt::format("cells {} {:x} array {} {} channel {} lattice {} time {} {}", kLayout, stamp->digest,
                                           options.array, options.dataset, MeshOptionsOf(options).channel.value_or(0),
                                           options.lattice.value_or(0), options.time ? options.time->first : 0, places.front());
  std::string stem = fs::path(path).stem().string().substr(0, kMostOfStem);
  std::ranges::replace_if(
      stem, [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
  return GridStore(*std::move(folder), fmt::format("{}-{:016x}", stem, XXH3_64bits(identity.data(), identity.size())), std::move(places),
                   stamp->digest);
}

GridStore::~GridStore() {
  if (alone_ != nullptr) folder_.Remove(name_);
}

Result<std::shared_ptr<StoredCells>> GridStore::Find() const {
  std::error_code error;
  if (!fs::exists(folder_.PathOf(name_), error)) return std::shared_ptr<StoredCells>();
  Result<StoreFolder::Lock> lock = folder_.LockShared(name_);
  if (!lock.ok()) return lock.status();
  if (!folder_.IsWhole(name_)) return std::shared_ptr<StoredCells>();
  Result<std::shared_ptr<StoredCells>> cells =
      StoredCells::Open(folder_.PathOf(name_), std::make_shared<StoreFolder::Lock>(*std::move(lock)));
  if (cells.status().code() != StatusCode::kDataLoss) return cells;
  LogWarning(cells.status().message() + "; it is made again");
  return std::shared_ptr<StoredCells>();
}

Result<std::unique_ptr<CellSpool>> GridStore::Begin() {
  Result<StoreFolder::Lock> alone = folder_.LockAlone(name_);
  if (!alone.ok()) return alone.status();
  if (folder_.IsWhole(name_) && StoredCells::Open(folder_.PathOf(name_)).ok()) return std::unique_ptr<CellSpool>();
  std::error_code error;
  fs::remove_all(folder_.PathOf(name_), error);  // what a process that was stopped has left
  if (Status begun = folder_.Begin(name_); !begun.ok()) return begun;
  alone_ = std::make_unique<StoreFolder::Lock>(*std::move(alone));
  std::uint64_t bytes = 0;
  for (const std::string& file : files_) bytes += std::uint64_t(fs::file_size(file, error));
  folder_.MakeRoom(name_, bytes);  // Make knows better
  LogInfo(fmt::format("keeps the cells of a grid in '{}'", folder_.PathOf(name_)));
  Result<CellSpool> spool = CellSpool::Create(folder_.PathOf(name_));
  return spool.ok() ? Result(std::make_unique<CellSpool>(*std::move(spool))) : spool.status();
}

Status GridStore::Make(LoadedMesh loaded, const VolumeGeometry& lattice, const std::function<void(double share)>& made) {
  constexpr std::uint64_t kLeastMemory = std::uint64_t{32} << 20, kMostMemory = std::uint64_t{2} << 30;
  // The most that is there at a time: the spool beside sorted cells.
  constexpr std::uint64_t kBytesAPoint = sizeof(MeshPoint) + sizeof(PointNumber),
                          kBytesACell = 2 * (sizeof(Tetrahedron) + 2 * sizeof(float));
  const std::uint64_t needed = loaded.spool->points.size() * kBytesAPoint + loaded.spool->cells.size() * kBytesACell;
  folder_.MakeRoom(name_, needed);
  if (const std::uint64_t room = folder_.RoomFor(name_); room < needed) {
    return Status::Unavailable(
        Printable(fmt::format("'{}' cannot hold the cells of a grid: they need {}, {} are available; "
                              "$XDG_CACHE_HOME names another place",
                              folder_.path(), MemoryText(needed), MemoryText(room))));
  }
  CellStoring storing = {
      .at = loaded.mesh.at,
      .bounds = loaded.bounds,
      .lattice = lattice,
      .notes = loaded.info.notes,
      .memory = std::clamp(std::uint64_t(std::max<std::int64_t>(AvailableMemoryBytes(), 0)) / 4, kLeastMemory, kMostMemory)};
  for (const MeshFileInfo::CellCount& kind : loaded.info.kinds) {
    storing.kinds[std::size_t(kind.kind - CellKinds().data())] = std::uint64_t(kind.count);
  }
  // Of the same mesh at another time, perhaps.
  std::vector<StoreFolder::Lock> in_use;
  std::error_code error;
  for (fs::directory_iterator each(folder_.path(), error), end; !error && each != end; each.increment(error)) {
    const std::string name = each->path().filename().string();
    std::error_code none;
    if (name == name_ || !fs::exists(each->path() / "header", none)) continue;
    Result<StoreFolder::Lock> lock = TryLockFile(each->path().string() + ".lock", LockMode::kShared);
    if (!lock.ok() || !folder_.IsWhole(name)) continue;
    in_use.push_back(*std::move(lock));
    storing.others.push_back(each->path().string());
  }
  storing.progress = [&](double share) {
    TouchLock(*alone_);
    made(share);
    return Status::Ok();
  };
  if (Status stored = StoreCells(std::move(*loaded.spool), storing); !stored.ok()) return stored;
  const Result<FileStamp> stamp = StampFiles(files_);
  if (!stamp.ok() || stamp->digest != stamp_) return Status::Unavailable(files_.front() + ": changes while it is read");
  if (Status sealed = folder_.Seal(name_); !sealed.ok()) return sealed;
  alone_.reset();
  return Status::Ok();
}

// Counts bytes of files that are read, and as many for what is made of them.
class GridProgress {
 public:
  GridProgress(const std::vector<std::string>& files, ReadProgress* progress) : progress_(progress) {
    std::error_code error;
    for (const std::string& file : files) bytes_ += std::int64_t(fs::file_size(file, error));
    if (progress_ != nullptr) progress_->Begin(2 * bytes_);
  }

  void Read(std::int64_t bytes) {
    if (progress_ != nullptr) progress_->Add(bytes);
  }
  void Make(double share) {
    const auto made = std::int64_t(share * double(bytes_));
    Read(made - made_);
    made_ = made;
  }

 private:
  ReadProgress* const progress_;
  std::int64_t bytes_ = 0, made_ = 0;
};

// Nothing: the store is there now.
Result<std::optional<LoadedMesh>> ReadOnce(const std::string& path, const ReadOptions& options, const std::vector<std::string>& files,
                                           GridStore* store, const GridFormat& format) {
  constexpr std::uint64_t kShare = 4;  // of the available memory: to sort cells takes more than twice as much as they do
  GridProgress progress(files, options.progress);
  bool there = false;
  MeshSpill spill;
  if (!options.keep_cells) spill.most_bytes = std::uint64_t(std::max<std::int64_t>(AvailableMemoryBytes(), 0)) / kShare;
  spill.begin = [&]() -> Result<CellSpool> {
    Result<std::unique_ptr<CellSpool>> spool = store->Begin();
    if (!spool.ok()) return Status(spool.status().code(), path + ": " + spool.status().message());
    there = *spool == nullptr;
    return there ? Result<CellSpool>(Status::Cancelled("there is a store")) : Result(std::move(**spool));
  };
  MeshOptions of_mesh = MeshOptionsOf(options);
  if (store != nullptr) of_mesh.spill = &spill;
  of_mesh.read = [&](std::int64_t bytes) { progress.Read(bytes); };
  Result<LoadedMesh> loaded = format.read(of_mesh);
  if (there) return std::optional<LoadedMesh>();
  if (!loaded.ok()) return loaded.status();
  if (loaded->spool == nullptr) return std::optional(*std::move(loaded));
  const VolumeGeometry lattice = LatticeOf(loaded->bounds, std::int64_t(loaded->spool->cells.size()), options.lattice);
  const Status made = store->Make(*std::move(loaded), lattice, [&](double share) { progress.Make(share); });
  return made.ok() ? Result(std::optional<LoadedMesh>()) : Status(made.code(), path + ": " + made.message());
}

}  // namespace

GridFormat VtkGrid(const std::string& path) {
  return {[path] { return FilesOfMesh(path); }, [path](const MeshOptions& options) { return ReadMesh(path, options); }};
}

MeshOptions MeshOptionsOf(const ReadOptions& options) {
  const std::optional<int> channel = options.channel || !options.describe ? options.channel : std::optional(0);
  return {.array = options.array, .time = options.time, .channel = channel, .headers_only = options.headers_only};
}

Result<Grid> ReadGrid(const std::string& path, const ReadOptions& options, const GridFormat& format) {
  const Result<std::vector<std::string>> found = format.files();
  const std::vector<std::string> files = found.ok() ? *found : std::vector{path};  // the reader says what is wrong
  constexpr int kAttempts = 3;
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    Result<GridStore> store = GridStore::Of(path, files, options);
    if (store.ok()) {
      Result<std::shared_ptr<StoredCells>> cells = store->Find();
      if (!cells.ok()) return Status(cells.status().code(), path + ": " + cells.status().message());
      if (*cells != nullptr) return Grid(StoredGrid{*std::move(cells), {files.begin() + 1, files.end()}});
    }
    Result<std::optional<LoadedMesh>> loaded = ReadOnce(path, options, files, store.ok() ? &*store : nullptr, format);
    if (!loaded.ok()) return loaded.status();
    if (*loaded) return Grid(**std::move(loaded));
  }
  return Status::Unavailable(path + ": the store of its cells is removed or damaged as soon as it is made");
}

}  // namespace slabstream
