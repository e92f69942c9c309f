// A legacy VTK file, ASCII or binary (VTK's "Simple Legacy Formats", versions 1 to 5): its keywords, and where its arrays lie. Binary
// numbers are big-endian. Errors name the path. One thread at a time.
#pragma once

#include <fmt/format.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "common/math/vec.h"
#include "common/memory/aligned_buffer.h"
#include "common/volume/memory_budget.h"
#include "data/volume_io/converted_samples.h"
#include "data/volume_io/grid_arrays.h"
#include "data/volume_io/sample_type.h"
#include "data/volume_io/text_cursor.h"

namespace slabstream {

// Numbers in the file: `tuples` of `components` each, from byte `offset` on.
struct VtkLegacyArray {
  std::string section;  // "POINT_DATA" or "CELL_DATA"; "": the dataset's own
  // One of the dataset's own arrays has its keyword here: "POINTS", "CELLS", "OFFSETS", "CONNECTIVITY", "CELL_TYPES" or
  // "X_COORDINATES". Cells of polydata: "LINES", or "LINES OFFSETS" and "LINES CONNECTIVITY".
  std::string name;
  std::string type_name = {};  // as the file calls it
  SampleType type = SampleType::kUint8;
  bool supported = true;  // the type; else the array is only listed
  int components = 1;
  std::int64_t tuples = 0, offset = 0;
  bool scalars = false;  // by the keyword SCALARS, or COLOR_SCALARS of one component
  bool colors = false;   // COLOR_SCALARS: bytes, which in a text are shares of 255

  std::int64_t samples() const { return tuples * components; }
};

inline constexpr std::array<std::string_view, 4> kPolydataCells = {"VERTICES", "LINES", "POLYGONS", "TRIANGLE_STRIPS"};

class VtkLegacyFile {
 public:
  // Reads the keywords. Their letters may be small ones. `kinds`: of datasets, "STRUCTURED_POINTS". NotFound: no such file.
  // InvalidArgument: another kind, or what is not supported. DataLoss: truncated.
  static Result<VtkLegacyFile> Open(const std::string& path, const std::vector<std::string_view>& kinds);
  const std::string& kind() const { return kind_; }
  // The kind of the dataset in a file; nothing: it is no such file.
  static std::optional<std::string> KindOf(const std::string& path);

  // DIMENSIONS, SPACING (which older files call ASPECT_RATIO) or ORIGIN.
  Vec3 Three(const std::string& keyword, const Vec3& if_absent) const;
  std::int64_t cells() const { return cells_; }  // by CELLS; 0: there are none
  // In the file's order. Arrays of fields are left out unless they have a tuple for each element of their section.
  const std::vector<VtkLegacyArray>& arrays() const { return arrays_; }
  // Those of points and cells, and their numbers in arrays(). The first scalars of both are active.
  OfferedArrays Offered() const;
  // The dataset's own of this name. InvalidArgument: there is none.
  Result<VtkLegacyArray> Own(const std::string& name) const;

  // Whether the file can hold the array, before memory is taken for it. DataLoss: it is too short.
  Status CheckHolds(const VtkLegacyArray& array) const;
  // Fills `out`, the samples of the array, in this machine's byte order. The array was checked (CheckHolds). DataLoss: truncated, damaged.
  Status ReadSamples(const VtkLegacyArray& array, AlignedVector<std::byte>& out);
  // The same, as numbers. ResourceExhausted: they do not fit the memory.
  template <class T>
  Result<AlignedVector<T>> ReadNumbers(const VtkLegacyArray& array);

  Status Wrong(const std::string& why) const { return Status::InvalidArgument(path_ + ": " + why); }
  Status Damaged(const std::string& why) const { return Status::DataLoss(path_ + ": " + why); }

 private:
  explicit VtkLegacyFile(const std::string& path) : path_(path), cursor_(path) {}
  Status Ended() const { return Damaged("truncated: the header ends early"); }
  std::optional<std::string> Keyword();  // the next word, in capital letters
  // Reads the lines in front of the keywords, and the kind of the dataset.
  Status ReadStart();
  Status ReadKeywords();
  Status OnKeyword(const std::string& keyword);
  Status ReadThree(const std::string& keyword);
  Status ReadSection(const std::string& keyword);
  // "KEYWORD n type" and the numbers of n tuples.
  Status ReadPlaces(const std::string& keyword, int components);
  Status ReadCells(const std::string& keyword);
  // "NAME type" and `tuples` numbers; of the cells that follow this keyword.
  Status ReadPartOfCells(const std::string& cells, const std::string& name, std::int64_t tuples);
  Status ReadScalars();
  Status ReadField();
  // The attribute that a keyword states: "KEYWORD name type", and its numbers.
  Status ReadAttribute(const std::string& keyword);
  Status SkipLookupTable();
  Status SkipMetadata();
  Result<std::int64_t> ReadCount(const std::string& keyword, std::int64_t most);
  // Reads the type of numbers, and sets it in the array.
  Status ReadType(VtkLegacyArray& array, const std::string& what);
  // An array whose numbers are next: passes by them.
  Status Add(VtkLegacyArray array);
  Status Skip(const VtkLegacyArray& array);
  Status SkipTexts(const VtkLegacyArray& array);

  std::string path_;
  TextCursor cursor_;
  std::string kind_;
  int version_ = 0;  // the number in front of the point
  bool binary_ = false;
  std::map<std::string, Vec3> threes_;
  std::int64_t cells_ = 0;
  std::string section_;        // that is being read
  std::int64_t elements_ = 0;  // elements of that section
  std::vector<VtkLegacyArray> arrays_;
};

template <class T>
Result<AlignedVector<T>> VtkLegacyFile::ReadNumbers(const VtkLegacyArray& array) {
  if (Status status = CheckHolds(array); !status.ok()) return status;
  const std::int64_t bytes = array.samples() * std::int64_t(BytesPerSample(array.type));
  const Status fits = CheckFitsMemory(bytes + array.samples() * std::int64_t(sizeof(T)), fmt::format("{}: array {}", path_, array.name));
  if (!fits.ok()) return fits;
  AlignedVector<std::byte> read(static_cast<std::size_t>(bytes));
  if (Status status = ReadSamples(array, read); !status.ok()) return status;
  return Converted<T>(array.type, read);
}

}  // namespace slabstream
