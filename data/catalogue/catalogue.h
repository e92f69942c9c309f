// The catalogue of a coordinator: which volumes --data and orders of admins mean, and how they are read. Clients name datasets; no request
// of theirs carries a path.
//
// What --data takes, any number of times:
//   NAME=PATH   one volume: a file, or a folder of slices; with options for reading it behind a question mark (read_options.h)
//   NAME=PATH?time=FIRST:LAST
//               a volume for each time of a file that holds several: NAME@FIRST ... NAME@LAST (NameAtTime)
//   PATH        the same, named after its file (NameOfSource, data/open/source_name.h), for anything but a folder to watch
//   NAME=PATH,labels=FILE[:COLOURS],overlay=FILE
//               the same with labels and an overlay (data/layers/layer_files.h); either one may be left out
//   DIR         a watched folder: every volume file in it, named after the file, also those that come later, and every folder in it that
//               is a volume; a watched folder of nothing but slices, or DICOM, is one volume and has its name; in one of nothing but
//               folders each may be a volume. What has a name that begins with a dot is left out
//
// Everything here may take as long as the file system does. Any thread.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "common/base/status.h"
#include "data/catalogue/data_source.h"
#include "data/sources/volume_source.h"
#include "data/survey/index_file.h"
#include "data/survey/survey.h"
#include "data/volume_io/read_progress.h"

namespace slabstream {

inline constexpr std::size_t kMaxPathBytes = 4096;
inline constexpr int kMaxTimes = 10'000;  // times that one argument names

// Help of --data.
inline constexpr char kDataHelp[] =
    "A volume to serve, as FILE or NAME=FILE, or a folder of volumes. Without a name it is named after its file: head.nii.gz is head. A "
    "folder is watched: files may come, change and go. Options for reading follow, as FILE?OPTION=VALUE,..., and layers, as "
    "FILE,labels=FILE[:COLOURS],overlay=FILE. NAME=FILE?time=FIRST:LAST names several volumes of one file: NAME@FIRST to NAME@LAST";

struct DataArgument {
  std::string name;  // empty: none is given
  std::string path;  // with its options
  LayerFiles layers = {};

  // The first path that is not absolute, of the volume or of a layer. Null: all are.
  const std::string* RelativePath() const;
};
// Looks at no file. InvalidArgument: a name that is empty, too long (kMaxNameBytes) or has other characters than letters, digits and
// "._-"; a path that is empty or longer than kMaxPathBytes, of the volume or of a layer; a layer that is given twice.
// Messages begin with the argument.
Result<DataArgument> ParseDataArgument(const std::string& argument);

// A folder as it is watched: absolute, without a slash at its end.
std::string WatchedFolder(const std::string& path);

// Reads folders, opens no volume. Errors, one for each wrong argument, which begins the message, behind the prefix. InvalidArgument: of
// ParseDataArgument, a repeated name, a file without a name, options that are wrong; NotFound: a path that does not exist. Files of folders
// whose names are taken are left out.
FoundData FindData(const std::vector<std::string>& arguments, const std::string& prefix = "--data ");

// What lies in a watched folder. NotFound, Unavailable: it cannot be read.
Result<FoundData> ListFolder(const std::string& folder);

// Reads the headers of all files. Adds an error for each named one that cannot be read. One in a folder may still be on its way: it gets
// a complaint and stays.
void CheckFiles(FoundData& found);

// The same of the overlay and the labels of one dataset: the first error, behind the name of the field.
Status CheckFields(const DataSource& source);

// A volume that is read in parts.
struct OpenedSource {
  std::shared_ptr<VolumeSource> source;
  Survey survey;
  std::string text;                              // where workers find it
  std::shared_ptr<const FileStamp> stamp;        // the state of its files when they were surveyed
  std::shared_ptr<const BrickIndex> index = {};  // null: there is none, or none that can be used; a line of the log says why
};

// A volume that was read as a whole.
struct LoadedSource {
  SourceInfo file;  // its finest level is the volume; nothing if a function has loaded it
  std::shared_ptr<const Volume> volume;
  std::shared_ptr<const VolumeSummary> summary = {};  // LevelInMemory::summary
  std::shared_ptr<const LabelTable> labels = {};      // of labels
  std::shared_ptr<const FileStamp> stamp;             // the state of its files when they were read; null: they never change
  std::shared_ptr<const ExactSamples> exact = {};     // the whole numbers that the volume rounds; null: it rounds none
  std::vector<VolumeSummary> other_times = {};        // SurveyOtherTimes
  std::shared_ptr<VolumeSource> source = {};          // null: it can only be read in one order or as a whole, or a function has loaded it
  std::shared_ptr<const GridCells> cells = {};        // LevelInMemory::cells
  std::shared_ptr<const ShapeInfo> shape = {};        // it is a shape, and the volume is its bytes; null: it is a volume

  VolumeSummary Summary() const { return summary != nullptr ? *summary : Summarize(*volume); }  // of the volume alone
};

using ReadableSource = std::variant<OpenedSource, LoadedSource>;

// Opens and surveys a volume that has several levels, or more voxels than `most_bytes` or kExactBytes, if its format can be read in parts;
// a compressed stream of that size becomes so (data/brick_store), unless it is one of labels. Anything else is read as a whole.
//
// Files that change meanwhile are read a second time, so the voxels are never those of two files. `tell`, if any, hears how much of the
// samples has been read, on any thread, one call at a time. Errors: of OpenSource, SurveySource, OpenStored, ReadVolume and
// ReadLabelColors; Unavailable: they change again.
Result<ReadableSource> ReadSource(const DataSource& source, std::uint64_t most_bytes, const TellRead& tell = {});

// Where the index of a source that is read in parts is kept. Errors: of ParseSourceText and IndexFile::Of.
Result<IndexFile> IndexFileOf(const std::string& source);

}  // namespace slabstream
