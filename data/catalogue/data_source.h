// Where the voxels of datasets come from. The machine keeps sources and hands them to the executor; it opens nothing itself.
#pragma once

#include <concepts>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/base/status.h"
#include "common/files/file_stamp.h"
#include "common/frame/dataset_id.h"
#include "common/view/clip.h"
#include "common/volume/labels.h"
#include "common/volume/missing.h"
#include "common/volume/stored_at.h"
#include "common/volume/summary.h"
#include "data/layers/layer_files.h"
#include "data/sources/volume_source.h"
#include "data/volume_io/exact_samples.h"
#include "data/volume_io/read_progress.h"

namespace slabstream {

struct BrickIndex;
class ClientFile;

// A level of a source that is open.
struct SourceAtLevel {
  std::shared_ptr<VolumeSource> source;           // never null
  std::shared_ptr<const VolumeSummary> surveyed;  // Survey::summary
  std::optional<int> surveyed_level = {};         // the survey's level, if that is it and all of it was read
  StoredAt stored;                                // where workers find it
  std::shared_ptr<const FileStamp> stamp;         // the state of its files
  std::shared_ptr<const BrickIndex> index = {};   // the source's brick index; null: there is none
  int times = 1;                                  // of its dataset
};

// A plane through voxels that are loaded.
struct PlaneOfVoxels {
  ClipSlab slab;  // of thickness 0, with `through`
  DatasetId voxels = 0;
  std::shared_ptr<const VolumeSummary> summary;  // of them
};

using VolumeLoader = std::function<Result<std::shared_ptr<const Volume>>()>;
struct LoadedData {
  std::shared_ptr<const Volume> volume;
  std::shared_ptr<const LabelTable> labels = nullptr;   // of labels
  std::shared_ptr<const ExactSamples> exact = nullptr;  // the whole numbers that the volume rounds
  std::shared_ptr<const ShapeInfo> shape = nullptr;     // it is a shape, and the volume is its bytes (DataOfShape)
};
using DataLoader = std::function<Result<LoadedData>(const TellRead&)>;

// Paths, or a function whose volume never changes.
struct DataSource {
  DataSource() = default;
  DataSource(std::string from_path, std::string of_folder, const LayerFiles& layers = {});  // looks at the file (NamesShape)
  template <std::convertible_to<DataLoader> Loader>
  DataSource(Loader loader) : load(std::move(loader)) {}  // NOLINT(google-explicit-constructor): a function is a source
  template <std::convertible_to<VolumeLoader> Loader>
  DataSource(Loader loader)  // NOLINT(google-explicit-constructor): so is one of a volume alone
      : load([loader = VolumeLoader(std::move(loader))](const TellRead&) -> Result<LoadedData> {
          Result<std::shared_ptr<const Volume>> volume = loader();
          if (!volume.ok()) return volume.status();
          return LoadedData{.volume = *std::move(volume)};
        }) {}

  std::string path;    // a file, or a folder of slices; a named one may have options for reading it behind a question mark
  std::string folder;  // the watched folder that it was found in; empty: it was named
  // Fields with a grid of their own; null: there is none. Only a named dataset has them. A source that names labels of 32 or 64 bits, and
  // no values, is a dataset of labels alone: its volume is hollow (hollow_source.h), and its labels are those of the same files.
  std::shared_ptr<const DataSource> overlay = {}, labels = {};
  bool is_shape = false;          // by the look of its file: a mesh, lines or points (NamesShape)
  bool is_field = false;          // of a dataset: labels are labels, and make no hollow volume
  std::string label_colors = {};  // of labels: the table of their colours (label_table.h)
  // Range and histogram of its field over the times of its dataset. Set: this is another time than the one that the dataset shows itself,
  // and is not surveyed. Null: they are those that a survey finds.
  std::shared_ptr<const VolumeSummary> statistics = {};
  // What is open of the same place, at another time or channel (OpenSource); null: nothing.
  std::shared_ptr<VolumeSource> beside = {};
  // Set: this is one level of a source with several, and is loaded as a dataset of its own.
  std::shared_ptr<const SourceAtLevel> at_level = {};
  // Set: this is a shape, that plane (coordinator/probe/plane_shape.h), and `path` is not used.
  std::shared_ptr<const PlaneOfVoxels> plane = {};
  // Set: `path` is not used, and voxels stay with the processes that hold them now (SourceInfo::owned). Unavailable: some are not there,
  // and `missing` wants more, or nobody has it.
  std::function<Result<std::shared_ptr<VolumeSource>>(Missing)> open = {};
  Missing missing = Missing::kFail;
  DataLoader load;                         // set: `path` is not used
  std::shared_ptr<const ClientFile> sent;  // `path` is this file, which is deleted with the last source of it
  std::uint64_t held_bytes = 0;            // memory that the source itself takes, loaded or not, since a client has sent it
};

// The field of labels of a dataset whose volume comes from `source`.
DataSource LabelsAt(DataSource source);

// By name.
using Catalogue = std::map<std::string, DataSource>;

// What arguments of --data mean, or what lies in a folder.
struct FoundData {
  Catalogue datasets;
  std::vector<std::string> folders;     // folders that are to be watched
  std::vector<Status> errors;           // why an argument or a named file is wrong
  std::vector<std::string> complaints;  // about files in folders, a line each: left out, or not to be read so far
};

}  // namespace slabstream
