// A legacy VTK file, ASCII or binary (VTK's "Simple Legacy Formats", versions 1 to 5): its keywords, and where its arrays lie. Binary
// numbers are big-endian. Errors name the path. One thread at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/aligned_buffer.h"
#include "common/base/status.h"
#include "common/math/vec.h"
#include "data/volume_io/sample_type.h"
#include "data/volume_io/text_cursor.h"

namespace slabstream {

// Numbers in the file: `tuples` of `components` each, from byte `offset` on.
struct VtkLegacyArray {
  std::string section;  // "POINT_DATA" or "CELL_DATA"; "": the dataset's own
  std::string name;     // of the dataset's own: its keyword, "POINTS", "CELLS", "OFFSETS", "CONNECTIVITY" or "CELL_TYPES"
  SampleType type = SampleType::kUint8;
  int components = 1;
  std::int64_t tuples = 0, offset = 0;
  bool scalars = false;  // by the keyword SCALARS

  std::int64_t samples() const { return tuples * components; }
};

class VtkLegacyFile {
 public:
  // How far the keywords are read: to the first scalars of points, which need not be complete, or to the file's end.
  enum class Until { kScalarsOfPoints, kEnd };

  // `kind`: of the dataset, "STRUCTURED_POINTS". NotFound: no such file. InvalidArgument: another kind, or what is not supported. DataLoss:
  // truncated.
  static Result<VtkLegacyFile> Open(const std::string& path, std::string_view kind, Until until);
  // The kind of its dataset; nothing: it is no such file.
  static std::optional<std::string> KindOf(const std::string& path);

  // DIMENSIONS, SPACING (which older files call ASPECT_RATIO) or ORIGIN.
  Vec3 Three(const std::string& keyword, const Vec3& if_absent) const;
  std::int64_t cells() const { return cells_; }  // by CELLS; 0: there are none
  // In the file's order. Arrays of fields are left out unless they have a tuple for each element of their section.
  const std::vector<VtkLegacyArray>& arrays() const { return arrays_; }
  // The dataset's own of this name. InvalidArgument: there is none.
  Result<VtkLegacyArray> Own(const std::string& name) const;

  // Whether the file can hold the array, before memory is taken for it. DataLoss: it is too short.
  Status CheckHolds(const VtkLegacyArray& array) const;
  // Fills `out`, the samples of the array, in this machine's byte order. The array was checked (CheckHolds). DataLoss: truncated, damaged.
  Status ReadSamples(const VtkLegacyArray& array, AlignedVector<std::byte>& out);

  Status Wrong(const std::string& why) const { return Status::InvalidArgument(path_ + ": " + why); }
  Status Damaged(const std::string& why) const { return Status::DataLoss(path_ + ": " + why); }

 private:
  VtkLegacyFile(const std::string& path, Until until) : path_(path), until_(until), cursor_(path) {}
  Status Ended() const { return Damaged("truncated: the header ends early"); }
  // Reads the lines in front of the keywords, and the kind of the dataset.
  Result<std::string> ReadStart();
  Status ReadKeywords();
  Status OnKeyword(const std::string& keyword);
  Status ReadThree(const std::string& keyword);
  Status ReadSection(const std::string& keyword);
  Status ReadPoints();
  Status ReadCells();
  // "NAME type" and `tuples` numbers.
  Status ReadPartOfCells(const std::string& name, std::int64_t tuples);
  Status ReadScalars();
  Status ReadField();
  // The attribute that a keyword states: "KEYWORD name type", and its numbers.
  Status ReadAttribute(const std::string& keyword);
  Status SkipLookupTable();
  Status SkipMetadata();
  Result<std::int64_t> ReadCount(const std::string& keyword, std::int64_t most);
  Result<SampleType> ReadType(const std::string& what);
  // An array whose numbers are next: passes by them, unless nothing behind them is asked for.
  Status Add(VtkLegacyArray array);
  Status Skip(const VtkLegacyArray& array);

  std::string path_;
  Until until_;
  TextCursor cursor_;
  bool ended_ = false;  // nothing more is asked for
  int version_ = 0;     // the number in front of the point
  bool binary_ = false;
  std::map<std::string, Vec3> threes_;
  std::int64_t cells_ = 0;
  std::string section_;        // that is being read
  std::int64_t elements_ = 0;  // of it
  std::vector<VtkLegacyArray> arrays_;
};

}  // namespace slabstream
