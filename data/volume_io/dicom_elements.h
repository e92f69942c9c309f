// The data elements of a DICOM file (PS3.10 section 7, PS3.5 section 7): those that the caller wants, with the sequences that they are in,
// up to the pixels. The rest is passed over.
//
// A length is believed only if what holds the element has that many bytes, sequences nest at most kMaxDicomDepth deep, and values longer
// than kMaxDicomValue are not kept: so damaged bytes lead to a Status and never to much memory. This is why neither GDCM nor DCMTK does it:
// both overflow the stack where sequences nest deeply, and take far more memory than the file has bytes; GDCM, as Debian compiles it, also
// ends the process where a file is damaged.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/base/status.h"

namespace slabstream {

using DicomTag = std::uint32_t;  // group << 16 | element

inline constexpr int kMaxDicomDepth = 16;
inline constexpr std::size_t kMaxDicomValue = std::size_t{1} << 16;  // bytes of a value
inline constexpr int kMaxDicomKept = 1 << 22;                        // elements and items of a file that are kept

// Some elements: of a file, or of an item of a sequence.
class DicomElements {
 public:
  struct Element {
    DicomTag tag = 0;
    std::string value;                 // the value as the file has it
    std::vector<DicomElements> items;  // the items of a sequence
  };

  // The caller of these functions knows the value representation of a tag. Absent, empty and broken values are left out.
  bool Has(DicomTag tag) const { return Find(tag) != nullptr; }
  std::string Text(DicomTag tag) const;                // without blanks around it
  std::vector<std::string> Texts(DicomTag tag) const;  // values between backslashes
  std::vector<double> Decimals(DicomTag tag) const;    // DS, IS; one that is no number is NaN
  std::optional<double> Decimal(DicomTag tag) const;   // the first of them
  std::optional<std::uint16_t> Short(DicomTag tag) const;
  std::vector<std::uint16_t> Shorts(DicomTag tag) const;
  std::optional<std::uint32_t> Long(DicomTag tag) const;
  std::vector<std::uint32_t> Longs(DicomTag tag) const;
  std::optional<double> Double(DicomTag tag) const;
  const std::vector<DicomElements>& Items(DicomTag tag) const;
  // The first item of a sequence; an empty one if there is none.
  const DicomElements& FirstItem(DicomTag tag) const;

 private:
  friend class DicomWalk;
  const Element* Find(DicomTag tag) const;
  template <class T>
  std::vector<T> AllOf(DicomTag tag) const;
  template <class T>
  std::optional<T> FirstOf(DicomTag tag) const;

  std::vector<Element> elements_;
  bool big_endian_ = false;
};

// Where the pixels of a file are.
struct DicomPixelData {
  std::int64_t offset = 0;       // where the first byte behind the element's header is; 0: the file has no pixels
  std::int64_t bytes = 0;        // as many as the element claims, or as the file has, if these are fewer
  bool encapsulated = false;     // in fragments, which are items
  bool words = false;            // words of 16 bits, whose bytes big endian swaps, for any bits of a pixel
  bool floats = false;           // floats of 32 or 64 bits, instead of integers
  std::int64_t deflated_at = 0;  // not 0: where the data set is deflated in the file; `offset` and `bytes` are of the decompressed one
};

struct DicomFile {
  std::string path;
  std::string media_class;      // MediaStorageSOPClassUID
  std::string transfer_syntax;  // its UID; if none is stated, that of the elements as they are
  DicomElements elements;
  DicomPixelData pixels;
};

struct WantedElement {
  DicomTag tag;
  bool sequence = false;
};

// Whether a file begins like one of DICOM: with DICM at byte 128 or, as some are exported, with the first elements themselves. False also
// if it cannot be read.
bool BeginsLikeDicom(const std::string& path);

// Keeps the elements `wanted`, wherever they are. NotFound: cannot be opened. InvalidArgument: no DICOM file, a deflated data set of
// kMaxInflated bytes or more (dicom_bytes.h), or compressed pixels whose transfer syntax is not stated. DataLoss: damaged. Messages name
// the path.
Result<DicomFile> ReadDicomFile(const std::string& path, std::span<const WantedElement> wanted);

// The transfer syntaxes whose pixels are not compressed.
inline constexpr const char* kImplicitLittleEndian = "1.2.840.10008.1.2";
inline constexpr const char* kExplicitLittleEndian = "1.2.840.10008.1.2.1";
inline constexpr const char* kExplicitBigEndian = "1.2.840.10008.1.2.2";
inline constexpr const char* kDeflatedLittleEndian = "1.2.840.10008.1.2.1.99";

// The bytes of the fragments of encapsulated pixels, (offset, bytes) in the file. The first is the offset table. DataLoss: damaged.
using DicomFragment = std::pair<std::int64_t, std::int64_t>;
Result<std::vector<DicomFragment>> ListFragments(const std::string& path, const DicomPixelData& pixels);

}  // namespace slabstream
