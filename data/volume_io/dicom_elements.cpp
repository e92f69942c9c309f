#include "data/volume_io/dicom_elements.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <string_view>

#include "common/text/parse_number.h"
#include "data/volume_io/binary_header.h"
#include "data/volume_io/dicom_bytes.h"

namespace slabstream {
namespace {

constexpr std::uint32_t kUndefined = 0xffffffff;  // a length

constexpr DicomTag kItem = 0xfffee000, kItemEnd = 0xfffee00d, kSequenceEnd = 0xfffee0dd;
constexpr DicomTag kFloatPixelData = 0x7fe00008, kDoublePixelData = 0x7fe00009, kPixelData = 0x7fe00010;
constexpr DicomTag kMediaClass = 0x00020002, kTransferSyntax = 0x00020010;

struct Encoding {
  bool explicit_types = true;
  bool big_endian = false;
};

std::string TagText(DicomTag tag) { return fmt::format("({:04x},{:04x})", tag >> 16, tag & 0xffff); }

bool IsOneOf(std::string_view type, std::string_view list) {
  for (std::size_t at = 0; at + 2 <= list.size(); at += 3) {
    if (list.substr(at, 2) == type) return true;
  }
  return false;
}
// Value representations, by how long their lengths are in the file.
bool HasLongLength(std::string_view type) { return IsOneOf(type, "OB OD OF OL OV OW SQ SV UC UN UR UT UV"); }
bool HasShortLength(std::string_view type) { return IsOneOf(type, "AE AS AT CS DA DS DT FD FL IS LO LT PN SH SL SS ST TM UI UL US"); }

std::string_view WithoutBlanks(std::string_view text) {
  constexpr std::string_view kBlanks{" \t\r\n\0", 5};
  const std::size_t begin = text.find_first_not_of(kBlanks);
  return begin == std::string_view::npos ? std::string_view() : text.substr(begin, text.find_last_not_of(kBlanks) - begin + 1);
}

struct ElementHeader {
  DicomTag tag = 0;
  std::uint32_t length = 0;   // bytes of the value
  std::int64_t value = 0;     // its offset
  bool is_sequence = false;   // its type says so
  bool unknown_type = false;  // UN, or no type stated
  bool words = false;         // OW
};

}  // namespace

class DicomWalk {
 public:
  DicomWalk(const std::string& path, DicomBytes& file, std::span<const WantedElement> wanted) : path_(path), file_(file), wanted_(wanted) {}

  // How the elements from `at` on are written, by the first one. None: no data set begins there, as far as its first elements tell.
  std::optional<Encoding> FindEncoding(std::int64_t at) {
    constexpr std::int64_t kShort = 8;  // bytes
    constexpr int kElements = 3;
    const std::byte* const bytes = file_.At(at, kShort);
    if (bytes == nullptr) return std::nullopt;
    const std::string_view first(reinterpret_cast<const char*>(bytes), kShort), type = first.substr(4, 2);
    const Encoding encoding{.explicit_types = HasShortLength(type) || HasLongLength(type), .big_endian = first.starts_with('\0')};
    DicomTag last = 0;
    for (int i = 0; i < kElements && (i == 0 || at < file_.size()); ++i) {
      const Result<ElementHeader> header = ReadHeader(at, file_.size(), encoding);
      const DicomTag group = header.ok() ? header->tag >> 16 : 0;
      const bool sound = group >= 0x0002 && group <= (i == 0 ? 0x0008 : 0x7fe0) && header->tag > last;
      if (!sound || (header->length != kUndefined && !CheckLength(*header, file_.size()).ok())) return std::nullopt;
      if (header->length == kUndefined) break;
      last = header->tag;
      at = header->value + header->length;
    }
    return encoding;
  }

  // Reads from `at` on, which moves behind what was read, until `end`.
  Status ReadFileMeta(std::int64_t& at, DicomElements& out) {
    while (at < file_.size()) {
      const Result<ElementHeader> header = ReadHeader(at, file_.size(), {});
      if (!header.ok()) return header.status();
      if (header->tag >> 16 != 0x0002) break;
      if (Status status = ReadElement(*header, file_.size(), {}, 0, at, out); !status.ok()) return status;
    }
    return Status::Ok();
  }

  // Until the pixels or the end of the file.
  Status ReadDataSet(std::int64_t at, const Encoding& encoding, DicomFile& out) {
    out.elements.big_endian_ = encoding.big_endian;
    while (at < file_.size()) {
      const Result<ElementHeader> header = ReadHeader(at, file_.size(), encoding);
      if (!header.ok()) return header.status();
      if (header->tag == kPixelData || header->tag == kFloatPixelData || header->tag == kDoublePixelData) {
        const std::int64_t left = file_.size() - header->value;
        out.pixels.offset = header->value;
        out.pixels.bytes = header->length == kUndefined ? left : std::min<std::int64_t>(header->length, left);
        out.pixels.encapsulated = header->length == kUndefined;
        out.pixels.words = header->words;
        out.pixels.floats = header->tag != kPixelData;
        return Status::Ok();
      }
      if (Status status = ReadElement(*header, file_.size(), encoding, 0, at, out.elements); !status.ok()) return status;
    }
    return Status::Ok();
  }

  // The items of encapsulated pixels.
  Result<std::vector<DicomFragment>> ReadFragments(std::int64_t at) {
    std::vector<DicomFragment> fragments;
    while (true) {
      const Result<ElementHeader> header = ReadHeader(at, file_.size(), {});
      if (!header.ok()) return header.status();
      if (header->tag == kSequenceEnd) return fragments;
      if (header->tag != kItem) return Damaged(at, "a fragment of the pixels must begin there, found " + TagText(header->tag));
      if (Status status = CheckLength(*header, file_.size()); !status.ok()) return status;
      if (++kept_ > kMaxDicomKept) return Damaged(at, fmt::format("more than {} fragments", kMaxDicomKept));
      fragments.emplace_back(header->value, header->length);
      at = header->value + header->length;
    }
  }

 private:
  Status Damaged(std::int64_t at, const std::string& what) const {
    return Status::DataLoss(fmt::format("{}: truncated or damaged at byte {}: {}", path_, at, what));
  }

  Status CheckLength(const ElementHeader& header, std::int64_t end) const {
    if (header.length <= end - header.value) return Status::Ok();
    return Damaged(header.value, fmt::format("{} claims {} bytes, there are {}", TagText(header.tag), header.length, end - header.value));
  }

  Status Keep(const ElementHeader& header, DicomElements& out) {
    if (++kept_ > kMaxDicomKept) return Damaged(header.value, fmt::format("more than {} elements", kMaxDicomKept));
    out.elements_.push_back({.tag = header.tag});
    return Status::Ok();
  }

  Result<ElementHeader> ReadHeader(std::int64_t at, std::int64_t end, const Encoding& encoding) {
    constexpr std::int64_t kShort = 8, kLong = 12;  // bytes
    const std::byte* bytes = end - at < kShort ? nullptr : file_.At(at, kShort);
    if (bytes == nullptr) return Damaged(at, fmt::format("an element begins there, and {} bytes are left", end - at));
    const BinaryHeader fields({bytes, std::size_t{kShort}}, encoding.big_endian);
    ElementHeader header;
    header.tag = DicomTag{fields.At<std::uint16_t>(0)} << 16 | fields.At<std::uint16_t>(2);
    header.value = at + kShort;
    const std::string_view type(reinterpret_cast<const char*>(bytes) + 4, 2);
    if (encoding.explicit_types && header.tag >> 16 != kItem >> 16 && HasShortLength(type)) {
      header.length = fields.At<std::uint16_t>(6);
      return header;
    }
    if (encoding.explicit_types && header.tag >> 16 != kItem >> 16 && HasLongLength(type)) {
      header.is_sequence = type == "SQ";
      header.unknown_type = type == "UN";
      header.words = type == "OW";
      bytes = end - at < kLong ? nullptr : file_.At(at, kLong);
      if (bytes == nullptr) return Damaged(at, fmt::format("an element begins there, and {} bytes are left", end - at));
      header.value = at + kLong;
      header.length = BinaryHeader({bytes, std::size_t{kLong}}, encoding.big_endian).At<std::uint32_t>(8);
      return header;
    }
    // Items have no type, and some writers leave types out within private sequences.
    header.unknown_type = true;
    header.length = fields.At<std::uint32_t>(4);
    return header;
  }

  const WantedElement* FindWanted(DicomTag tag) const {
    const auto found = std::ranges::find(wanted_, tag, &WantedElement::tag);
    return found == wanted_.end() ? nullptr : &*found;
  }

  // Reads the element whose header was read at `at`, which moves behind it.
  Status ReadElement(const ElementHeader& header, std::int64_t end, const Encoding& encoding, int depth, std::int64_t& at,
                     DicomElements& out) {
    const WantedElement* const wanted = FindWanted(header.tag);
    const bool known_sequence = header.is_sequence || (header.unknown_type && wanted != nullptr && wanted->sequence);
    if (header.length == kUndefined || (known_sequence && wanted != nullptr)) {
      // Within a sequence of type UN there are no types (PS3.5 section 6.2.2).
      const Encoding inner = header.unknown_type ? Encoding{.explicit_types = false, .big_endian = false} : encoding;
      return ReadSequence(header, end, encoding.explicit_types ? inner : encoding, depth, wanted != nullptr, at, out);
    }
    if (Status status = CheckLength(header, end); !status.ok()) return status;
    at = header.value + header.length;
    if (wanted == nullptr || wanted->sequence || header.length > kMaxDicomValue) return Status::Ok();
    if (Status status = Keep(header, out); !status.ok() || header.length == 0) return status;
    const std::byte* const bytes = file_.At(header.value, header.length);
    if (bytes == nullptr) return Damaged(header.value, "cannot be read");
    out.elements_.back().value.assign(reinterpret_cast<const char*>(bytes), header.length);
    return Status::Ok();
  }

  Status ReadSequence(const ElementHeader& header, std::int64_t end, const Encoding& encoding, int depth, bool keep, std::int64_t& at,
                      DicomElements& out) {
    if (depth >= kMaxDicomDepth) return Damaged(header.value, fmt::format("sequences nest more than {} deep", kMaxDicomDepth));
    const bool delimited = header.length == kUndefined;
    if (Status status = delimited ? Status::Ok() : CheckLength(header, end); !status.ok()) return status;
    const std::int64_t sequence_end = delimited ? end : header.value + header.length;
    std::vector<DicomElements> items;
    at = header.value;
    while (delimited || at < sequence_end) {
      const Result<ElementHeader> item = ReadHeader(at, sequence_end, encoding);
      if (!item.ok()) return item.status();
      if (item->tag == kSequenceEnd) {
        at = item->value;
        break;
      }
      if (item->tag != kItem) {
        return Damaged(at, fmt::format("an item of {} must begin there, found {}", TagText(header.tag), TagText(item->tag)));
      }
      if (++kept_ > kMaxDicomKept) return Damaged(at, fmt::format("more than {} elements", kMaxDicomKept));
      if (!keep && item->length != kUndefined) {  // perhaps a fragment of compressed pixels, such as those of an icon
        if (Status status = CheckLength(*item, sequence_end); !status.ok()) return status;
        at = item->value + item->length;
        continue;
      }
      DicomElements elements;
      if (Status status = ReadItem(*item, sequence_end, encoding, depth + 1, at, elements); !status.ok()) return status;
      if (keep) items.push_back(std::move(elements));
    }
    if (!keep) return Status::Ok();
    if (Status status = Keep(header, out); !status.ok()) return status;
    out.elements_.back().items = std::move(items);
    return Status::Ok();
  }

  Status ReadItem(const ElementHeader& item, std::int64_t end, const Encoding& encoding, int depth, std::int64_t& at, DicomElements& out) {
    const bool delimited = item.length == kUndefined;
    if (Status status = delimited ? Status::Ok() : CheckLength(item, end); !status.ok()) return status;
    const std::int64_t item_end = delimited ? end : item.value + item.length;
    out.big_endian_ = encoding.big_endian;
    at = item.value;
    while (delimited || at < item_end) {
      const Result<ElementHeader> header = ReadHeader(at, item_end, encoding);
      if (!header.ok()) return header.status();
      if (delimited && header->tag == kItemEnd) {
        at = header->value;
        break;
      }
      if (Status status = ReadElement(*header, item_end, encoding, depth, at, out); !status.ok()) return status;
    }
    return Status::Ok();
  }

  const std::string& path_;
  DicomBytes& file_;
  std::span<const WantedElement> wanted_;
  int kept_ = 0;
};

const DicomElements::Element* DicomElements::Find(DicomTag tag) const {
  const auto found = std::ranges::find(elements_, tag, &Element::tag);
  return found == elements_.end() ? nullptr : &*found;
}

std::string DicomElements::Text(DicomTag tag) const {
  const Element* const element = Find(tag);
  return element == nullptr ? "" : std::string(WithoutBlanks(element->value));
}

std::vector<std::string> DicomElements::Texts(DicomTag tag) const {
  std::vector<std::string> texts;
  const std::string whole = Text(tag);
  for (std::size_t begin = 0; !whole.empty() && begin <= whole.size();) {
    const std::size_t end = std::min(whole.find('\\', begin), whole.size());
    texts.emplace_back(WithoutBlanks(std::string_view(whole).substr(begin, end - begin)));
    begin = end + 1;
  }
  return texts;
}

std::vector<double> DicomElements::Decimals(DicomTag tag) const {
  std::vector<double> numbers;
  for (const std::string& text : Texts(tag)) {
    const std::size_t plus = text.starts_with('+') ? 1 : 0;
    numbers.push_back(ParseNumber<double>(std::string_view(text).substr(plus)).value_or(std::numeric_limits<double>::quiet_NaN()));
  }
  return numbers;
}

std::optional<double> DicomElements::Decimal(DicomTag tag) const {
  const std::vector<double> numbers = Decimals(tag);
  return numbers.empty() ? std::nullopt : std::optional(numbers.front());
}

template <class T>
std::vector<T> DicomElements::AllOf(DicomTag tag) const {
  const Element* const element = Find(tag);
  std::vector<T> values(element == nullptr ? 0 : element->value.size() / sizeof(T));
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] = BinaryHeader(std::as_bytes(std::span(element->value)), big_endian_).At<T>(i * sizeof(T));
  }
  return values;
}

template <class T>
std::optional<T> DicomElements::FirstOf(DicomTag tag) const {
  const std::vector<T> values = AllOf<T>(tag);
  return values.empty() ? std::nullopt : std::optional(values.front());
}

std::vector<std::uint16_t> DicomElements::Shorts(DicomTag tag) const { return AllOf<std::uint16_t>(tag); }
std::vector<std::uint32_t> DicomElements::Longs(DicomTag tag) const { return AllOf<std::uint32_t>(tag); }
std::optional<std::uint16_t> DicomElements::Short(DicomTag tag) const { return FirstOf<std::uint16_t>(tag); }
std::optional<std::uint32_t> DicomElements::Long(DicomTag tag) const { return FirstOf<std::uint32_t>(tag); }
std::optional<double> DicomElements::Double(DicomTag tag) const { return FirstOf<double>(tag); }

const std::vector<DicomElements>& DicomElements::Items(DicomTag tag) const {
  static const std::vector<DicomElements> none;
  const Element* const element = Find(tag);
  return element == nullptr ? none : element->items;
}

const DicomElements& DicomElements::FirstItem(DicomTag tag) const {
  static const DicomElements none;
  const std::vector<DicomElements>& items = Items(tag);
  return items.empty() ? none : items.front();
}

namespace {

// Where the elements of a file begin: behind the preamble, if it has one.
std::int64_t BeginOfElements(DicomBytes& file) {
  constexpr std::int64_t kPreamble = 128;  // bytes
  constexpr std::string_view kMagic = "DICM";
  const std::byte* const magic = file.At(kPreamble, std::int64_t(kMagic.size()));
  const bool found = magic != nullptr && std::string_view(reinterpret_cast<const char*>(magic), kMagic.size()) == kMagic;
  return found ? kPreamble + std::int64_t(kMagic.size()) : 0;
}

bool BeginsLikeDicom(const std::string& path, DicomBytes& file) {
  return BeginOfElements(file) > 0 || DicomWalk(path, file, {}).FindEncoding(0).has_value();
}

}  // namespace

bool BeginsLikeDicom(const std::string& path) {
  DicomBytes file(path);
  return BeginsLikeDicom(path, file);
}

Result<DicomFile> ReadDicomFile(const std::string& path, std::span<const WantedElement> wanted) {
  DicomBytes file(path);
  if (!file.is_open()) return Status::NotFound(path + ": cannot be opened for reading");
  if (!BeginsLikeDicom(path, file))
    return Status::InvalidArgument(path + ": not a DICOM file: neither DICM at byte 128 nor elements at byte 0");
  DicomFile out{.path = path};
  std::int64_t at = BeginOfElements(file);
  constexpr std::array<WantedElement, 2> kOfFileMeta = {{{kMediaClass}, {kTransferSyntax}}};
  DicomElements meta;
  DicomWalk of_meta(path, file, kOfFileMeta);
  if (Status status = of_meta.ReadFileMeta(at, meta); !status.ok()) return status;
  out.media_class = meta.Text(kMediaClass);
  out.transfer_syntax = meta.Text(kTransferSyntax);
  std::optional<DicomBytes> inflated;
  if (out.transfer_syntax == kDeflatedLittleEndian) {
    inflated.emplace(path, at);
    if (inflated->size() >= kMaxInflated) {
      return Status::InvalidArgument(fmt::format("{}: its deflated data set has {} bytes or more", path, kMaxInflated));
    }
    out.pixels.deflated_at = at;
    at = 0;
  }
  DicomWalk walk(path, inflated ? *inflated : file, wanted);
  // Some writers state no transfer syntax, or leave types out although theirs has them.
  Encoding encoding{.explicit_types = out.transfer_syntax != kImplicitLittleEndian,
                    .big_endian = out.transfer_syntax == kExplicitBigEndian};
  const std::optional<Encoding> found = walk.FindEncoding(at);
  if (found) encoding.explicit_types = found->explicit_types;
  if (found && out.transfer_syntax.empty()) encoding.big_endian = found->big_endian;
  if (Status status = walk.ReadDataSet(at, encoding, out); !status.ok()) return status;
  if (!out.transfer_syntax.empty()) return out;
  if (out.pixels.encapsulated) return Status::InvalidArgument(path + ": has compressed pixels, and no transfer syntax is stated");
  out.transfer_syntax = encoding.big_endian ? kExplicitBigEndian : encoding.explicit_types ? kExplicitLittleEndian : kImplicitLittleEndian;
  return out;
}

Result<std::vector<DicomFragment>> ListFragments(const std::string& path, const DicomPixelData& pixels) {
  DicomBytes file(path);
  if (!file.is_open()) return Status::NotFound(path + ": cannot be opened for reading");
  return DicomWalk(path, file, {}).ReadFragments(pixels.offset);
}

}  // namespace slabstream
