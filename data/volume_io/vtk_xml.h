// A file of VTK's XML formats (VTK's "VTK XML Formats"): its elements, and its data arrays, which stand in the elements as text or base64,
// or appended raw or in base64; uncompressed or in blocks of zlib. Errors name the path. One thread at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/aligned_buffer.h"
#include "common/base/status.h"
#include "data/volume_io/sample_type.h"
#include "data/volume_io/xml_events.h"

namespace slabstream {

// A data array of the first piece.
struct VtkArray {
  XmlTag tag;
  std::string section;              // the element that it is in: "PointData"
  std::int64_t begin = 0, end = 0;  // of what stands in the element, bytes of the file

  std::string name() const { return tag.Attribute("Name"); }
};

struct VtkArrayType {
  SampleType type = SampleType::kUint8;
  int components = 1;  // in [1, most]
};

class VtkXmlFile {
 public:
  // Reads all but the arrays. `type`: of the dataset, "ImageData". NotFound: no such file. InvalidArgument: no XML, or another type.
  static Result<VtkXmlFile> Open(const std::string& path, std::string_view type);

  const XmlTag& dataset() const { return dataset_; }  // the element of the type's name
  const XmlTag& piece() const { return piece_; }      // the first one
  int pieces() const { return pieces_; }
  // The name of the active scalars of "PointData" or "CellData"; "": none.
  const std::string& ActiveScalars(std::string_view section) const { return section == "PointData" ? point_scalars_ : cell_scalars_; }
  const std::vector<VtkArray>& arrays() const { return arrays_; }

  // `count` numbers of an attribute; `if_absent` if it is missing. InvalidArgument: it has others.
  Result<std::vector<double>> Numbers(const XmlTag& tag, const std::string& key, std::size_t count, std::vector<double> if_absent) const;

  // InvalidArgument: a type that is no number, or more components than `most`.
  Result<VtkArrayType> TypeOf(const VtkArray& array, int most_components) const;
  // Whether the file can hold that many samples, before memory is taken for them. InvalidArgument: an encoding that is not supported.
  // DataLoss: it is too short.
  Status CheckHolds(const VtkArray& array, SampleType type, std::int64_t samples) const;
  // The byte of the file at which that many samples begin, and whether they are big endian. InvalidArgument: they are text, base64 or
  // compressed. DataLoss: the file has another number of bytes for them, or is too short.
  struct PlainSamples {
    std::int64_t begin = 0;
    bool big_endian = false;
  };
  Result<PlainSamples> FindPlainSamples(const VtkArray& array, SampleType type, std::int64_t samples) const;
  // Fills `out`, whole samples in this machine's byte order. The array was checked for as many (CheckHolds). DataLoss: truncated, damaged.
  Status ReadSamples(const VtkArray& array, SampleType type, AlignedVector<std::byte>& out) const;

  Status Wrong(const std::string& why) const { return Status::InvalidArgument(path_ + ": " + why); }
  Status Damaged(const std::string& why) const { return Status::DataLoss(path_ + ": " + why); }

 private:
  // How and where the samples of an array lie.
  struct Place {
    bool text = false, base64 = false, compressed = false;
    std::int64_t begin = 0, end = 0, file_bytes = 0;
  };

  explicit VtkXmlFile(std::string path) : path_(std::move(path)) {}
  Status ReadElements(std::string_view type);
  bool OnStart(const XmlTag& tag, std::string_view type);
  void OnEnd(const XmlTag& tag);
  Status FindAppended();
  Result<Place> PlaceOf(const VtkArray& array) const;
  Status InArray(const VtkArray& array, const Status& status) const;

  std::string path_;
  XmlTag file_, dataset_, piece_;
  int pieces_ = 0;
  std::string point_scalars_, cell_scalars_;
  std::vector<VtkArray> arrays_;
  std::string appended_encoding_;
  std::int64_t appended_ = 0;  // the byte behind the underscore before the samples; 0: there are none
  // While elements are read.
  std::vector<std::string> open_;  // names of the elements that are open
  bool in_array_ = false;          // the last one of arrays_ is open
};

std::string_view VtkTypeName(SampleType type);  // "Float32"

}  // namespace slabstream
