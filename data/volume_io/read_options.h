// How a volume file is to be read, where its format leaves that open: which of several volumes, or what raw samples are. And a source, as
// users name it: a path, and behind it such options.
//
//   head.nii.gz?time=3      ct.raw?dims=512,512,300,type=int16,spacing=0.7,0.7,1.25
//
// ReadOptionList() is the only list. Commands that read files have the same options: --time 3 says what ?time=3 says.
//
// Pure, but for ParseSourceText, which looks for the file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "common/math/vec.h"
#include "data/volume_io/read_progress.h"
#include "data/volume_io/sample_type.h"

namespace slabstream {

class Store;

inline constexpr std::int64_t kMaxVolumes = 1 << 20;    // in one file
inline constexpr int kLuminance = -1, kMagnitude = -2;  // ReadOptions::channel
inline constexpr int kMostVectorComponents = 3;         // of which there is a magnitude; at least 2
// Whether a channel of this name is made of several ones of a file, by whoever reads it.
constexpr bool IsMixedChannel(std::string_view name) { return name == "luminance" || name == "magnitude"; }
inline constexpr std::size_t kMaxDatasetBytes = 4096;

// Volumes of a file that holds several, both included.
struct TimeRange {
  int first = 0, last = 0;  // 0 <= first <= last < kMaxVolumes
  int count() const { return last - first + 1; }
  friend bool operator==(const TimeRange&, const TimeRange&) = default;
};
// "T" or "FIRST:LAST". InvalidArgument: the message begins with `option` and names the text.
Result<TimeRange> ParseTimeRange(std::string_view option, std::string_view text);

struct ReadOptions {
  std::string series;             // in a DICOM folder a number or UID; "": the only series. In an OME-TIFF an image; "": the first
  std::optional<TimeRange> time;  // the volume of a file that holds several. Readers take one, a catalogue takes several
  std::optional<int> channel;     // the component of a voxel, from 0; or kLuminance or kMagnitude
  std::optional<Vec3> spacing;    // each > 0, finite
  std::string matrix;             // the matrix of a NIfTI file that states both: "sform" or "qform"; "": by its codes
  // For VTK files. In a Zarr hierarchy `array` is the path of an array or a group, "" its root.
  std::string array;                    // the array; "": the active scalars, else the only one with one component
  std::optional<std::int32_t> lattice;  // voxels along the longest side of the lattice, in [1, kMaxLatticeSide]
  // For rectilinear grids: voxels along each uneven axis, in [2, kMaxVolumeSide], or 0: as many as its shortest distance needs
  // (data/sources/even_source.h).
  std::optional<std::int32_t> resample;
  // For HDF5 files.
  std::string dataset;  // the path of one in the file, at most kMaxDatasetBytes; "": the image that its layout says, or the only volume
  // For raw samples.
  std::optional<Index3> dims;  // voxels along x, y and z, each in [1, kMaxVolumeSide]
  std::optional<SampleType> type;
  std::optional<bool> big_endian;
  std::optional<std::int64_t> offset;  // bytes of the file before the samples, >= 0
  bool labels = false;                 // samples are labels, which are kept as they are (data/sources/label_source.h)
  bool hollow = false;                 // values are not read (data/sources/hollow_source.h)
  bool follow_links = false;           // in folders of objects: links that lead out of the folder, such as those of git-annex, are followed
  // For addresses.
  std::vector<std::string> headers;  // headers that go with each request: "NAME:VALUE", or "NAME:@FILE" with the value in a file
  std::string query;                 // the query of the address itself, such as a signature: goes with each request. Not to be shown
  // What users cannot say.
  std::shared_ptr<Store> store;      // the store at the address, opened with these options; null: the path tells
  bool describe = false;             // without `time`, a source of several volumes opens the first one
  bool keep_cells = false;           // of a grid: its cells go to a cell store, even if they fit the memory
  bool headers_only = false;         // check everything that can be checked without the samples, and take no memory for them
  ReadProgress* progress = nullptr;  // counts what is read of the samples; null: nobody asks. Few formats count nothing
};

struct ReadOption {
  std::string_view name;     // "time"
  std::string_view value;    // how its values are written, for help texts: "T"; "": yes or no, and of commands a flag without a value
  std::string_view purpose;  // for help texts
  // InvalidArgument: the message begins with `option` and names the text.
  Status (*set)(ReadOptions& options, std::string_view option, std::string_view text);
  bool (*given)(const ReadOptions& options);
  bool of_addresses = false;  // every volume behind an address takes it, and no other; it may be given several times
  bool of_all = false;        // every volume takes it
};
const std::vector<ReadOption>& ReadOptionList();

struct SourceText {
  std::string path;  // of a file, or an address (IsUrl, common/text/url.h) without a query, but for the endpoint of a bucket
  ReadOptions options;
  std::string options_text;  // "?time=3,channel=1": those that say which volume it is, as they are written; empty: there are none
};

// PATH or PATH?NAME=VALUE,NAME=VALUE... A text that is a file's name as a whole is its path. Does not check that the file exists.
// What begins with a scheme, such as "https://", may have a query of its own, with the options behind it after a comma or another question
// mark; and may be spelled as other programs spell it (source_text.cpp).
// InvalidArgument, naming `text`: no such option, one that is given twice, or a value that it does not take; another scheme.
Result<SourceText> ParseSourceText(const std::string& text);

// Whether something is at its path. What an address holds is not known before it is asked: true.
bool MayBeThere(const SourceText& source);

// The source with one more option.
std::string WithReadOption(const std::string& source, std::string_view name, std::string_view value);
// The source without the option, wherever it gives it. `source` is right (ParseSourceText).
std::string WithoutReadOption(const std::string& source, std::string_view name);
// The source at one time, or at all that its file has; times that it names are replaced. `source` is right (ParseSourceText).
std::string AtTime(const std::string& source, std::optional<int> time);

// The source for a user to see: without the query of its own, and without the values of headers.
std::string ShownSource(const std::string& source);

}  // namespace slabstream
