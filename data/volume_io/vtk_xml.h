// A file of VTK's XML formats (VTK's "VTK XML Formats"): its elements, and its data arrays, which stand in the elements as text or base64,
// or appended raw or in base64; uncompressed or in blocks of zlib, LZ4 or LZMA. Blanks round the values of attributes do not count:
// programs in Fortran write them. Errors name the path. One thread at a time.
//
// A parallel file ("PImageData") names files with a piece each, and the arrays that each of them has; it has no samples.
#pragma once

#include <fmt/format.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "common/memory/aligned_buffer.h"
#include "common/volume/field_info.h"
#include "common/volume/memory_budget.h"
#include "data/volume_io/converted_samples.h"
#include "data/volume_io/grid_arrays.h"
#include "data/volume_io/raw_volume.h"
#include "data/volume_io/read_options.h"
#include "data/volume_io/sample_type.h"
#include "data/volume_io/xml_events.h"

namespace slabstream {

struct VtkArray {
  XmlTag tag;
  std::string section;              // the element that it is in: "PointData"
  std::size_t piece = 0;            // the number of its piece
  std::int64_t begin = 0, end = 0;  // bytes of the file between its tag and what comes next: its end, or an element that describes it

  std::string name() const { return tag.Attribute("Name"); }
};

inline constexpr std::size_t kMostVtkPieces = 1 << 14;

struct VtkArrayType {
  SampleType type = SampleType::kUint8;
  int components = 1;  // in [1, most]
  friend bool operator==(const VtkArrayType&, const VtkArrayType&) = default;
};

class ChunkCodec;

class VtkXmlFile {
 public:
  // Reads all but the arrays. `type`: the dataset's, "ImageData". If a file has several times, options.time takes the
  // arrays of one. NotFound: no such file. InvalidArgument: no XML, another type, no piece or more than kMostVtkPieces,
  // or no such time.
  static Result<VtkXmlFile> Open(const std::string& path, std::string_view type, const ReadOptions& options);

  const XmlTag& dataset() const { return dataset_; }             // the element of the type's name
  const std::vector<XmlTag>& pieces() const { return pieces_; }  // at least one
  const TimeAxis& times() const { return times_; }               // times that the file holds
  std::int64_t time() const { return time_; }                    // the one whose arrays these are
  // The name of the active scalars of "PointData" or "CellData"; "": none.
  const std::string& ActiveScalars(std::string_view section) const { return section == "PointData" ? point_scalars_ : cell_scalars_; }
  const std::vector<VtkArray>& arrays() const { return arrays_; }
  bool parallel() const { return file_.Attribute("type").starts_with('P'); }
  // The file of a piece of a parallel file. InvalidArgument: it names none, or what is no file.
  Result<std::string> SourceOf(std::size_t piece) const;
  // Those of points and cells in the first piece (of a parallel file: in each), and their numbers in arrays().
  OfferedArrays Offered() const;
  // `name` "": the first one of the section. InvalidArgument: there is none.
  Result<const VtkArray*> Find(std::size_t piece, std::string_view section, const std::string& name) const;
  // That of the same section and name. InvalidArgument: there is none, or it has another type or number of components.
  Result<const VtkArray*> FindLike(std::size_t piece, const VtkArray& array) const;

  // `count` numbers of an attribute; `if_absent` if it is missing. InvalidArgument: it has others.
  Result<std::vector<double>> Numbers(const XmlTag& tag, const std::string& key, std::size_t count, std::vector<double> if_absent) const;

  // InvalidArgument: a type that is no number, or more components than `most`.
  Result<VtkArrayType> TypeOf(const VtkArray& array, int most_components) const;
  // Whether the file can hold that many samples, before memory is taken for them. InvalidArgument: an encoding that is not supported.
  // DataLoss: it is too short.
  Status CheckHolds(const VtkArray& array, SampleType type, std::int64_t samples) const;
  // Where that many samples lie, for which their header is read. InvalidArgument: they cannot be read in parts, since they are text, in
  // blocks of less than 64 bytes or more than 64 MiB, or in base64 with blanks. DataLoss: the file has another number of bytes for them, or
  // is too short.
  Result<LocatedSamples> Locate(const VtkArray& array, SampleType type, std::int64_t samples) const;
  // Fills `out`, whole samples in this machine's byte order. The array was checked for as many (CheckHolds). DataLoss: truncated, damaged.
  Status ReadSamples(const VtkArray& array, SampleType type, AlignedVector<std::byte>& out) const;

  // As many samples as numbers. Errors of CheckHolds and ReadSamples. ResourceExhausted: they do not fit the memory.
  template <class T>
  Result<AlignedVector<T>> ReadNumbers(const VtkArray& array, SampleType type, std::int64_t samples) const;

  Status Wrong(const std::string& why) const { return Status::InvalidArgument(path_ + ": " + why); }
  Status Damaged(const std::string& why) const { return Status::DataLoss(path_ + ": " + why); }

 private:
  // How and where the samples of an array lie.
  struct Place {
    bool text = false, base64 = false, appended = false;
    std::shared_ptr<const ChunkCodec> codec;  // of a block; null: not compressed
    std::int64_t most_ratio = 1;              // of the bytes of samples to those that are stored, at most
    std::int64_t begin = 0, end = 0;
  };

  explicit VtkXmlFile(std::string path) : path_(std::move(path)) {}
  Status ReadElements(std::string_view type);
  Status TakeTime(const ReadOptions& options);
  bool OnStart(const XmlTag& tag, std::string_view type);
  void OnEnd(const XmlTag& tag);
  Status FindAppended();
  Result<Place> PlaceOf(const VtkArray& array) const;
  GridArray Described(const VtkArray& array) const;
  Status InArray(const VtkArray& array, const Status& status) const;

  std::string path_;
  XmlTag file_, dataset_;
  std::vector<XmlTag> pieces_;
  TimeAxis times_;
  std::int64_t time_ = 0;
  std::string point_scalars_, cell_scalars_;
  std::vector<VtkArray> arrays_;
  std::string appended_encoding_;
  std::int64_t appended_ = 0;  // the byte behind the underscore before the samples; 0: there are none
  // While elements are read.
  std::vector<std::string> open_;  // names of the elements that are open
  bool in_array_ = false;          // the last one of arrays_ is open, and no element in it has begun
};

std::string_view VtkTypeName(SampleType type);  // "Float32"

template <class T>
Result<AlignedVector<T>> VtkXmlFile::ReadNumbers(const VtkArray& array, SampleType type, std::int64_t samples) const {
  if (Status status = CheckHolds(array, type, samples); !status.ok()) return status;
  const std::int64_t bytes = samples * std::int64_t(BytesPerSample(type));
  const Status fits = CheckFitsMemory(bytes + samples * std::int64_t(sizeof(T)), fmt::format("{}: array {}", path_, array.name()));
  if (!fits.ok()) return fits;
  AlignedVector<std::byte> read(static_cast<std::size_t>(bytes));
  if (Status status = ReadSamples(array, type, read); !status.ok()) return status;
  return Converted<T>(type, read);
}

}  // namespace slabstream
