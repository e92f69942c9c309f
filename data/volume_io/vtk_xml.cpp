#include "data/volume_io/vtk_xml.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <optional>
#include <span>
#include <sstream>
#include <utility>

#include "common/base/find_named.h"
#include "common/text/parse_number.h"
#include "common/text/trimmed.h"
#include "data/codecs/codecs.h"
#include "data/volume_io/payload.h"
#include "data/volume_io/raw_volume.h"
#include "data/volume_io/stated_field.h"
#include "data/volume_io/text_cursor.h"

namespace slabstream {

struct VtkCompressor {
  std::string_view name;
  SharedCodec codec;
  std::int64_t most_ratio = 1;  // of the bytes of a block to those that are stored, at most
};

namespace {

const std::vector<VtkCompressor>& Compressors() {
  // LZ4: a byte of a length stands for 255. xz packs zeros about 7000:1.
  static const std::vector<VtkCompressor> compressors = {{"vtkZLibDataCompressor", ZlibCodec(), kMaxDeflateRatio},
                                                         {"vtkLZ4DataCompressor", Lz4BlockCodec(), 256},
                                                         {"vtkLZMADataCompressor", XzCodec(), 16384}};
  return compressors;
}

constexpr std::array<std::pair<std::string_view, SampleType>, 10> kTypes = {{{"Int8", SampleType::kInt8},
                                                                             {"UInt8", SampleType::kUint8},
                                                                             {"Int16", SampleType::kInt16},
                                                                             {"UInt16", SampleType::kUint16},
                                                                             {"Int32", SampleType::kInt32},
                                                                             {"UInt32", SampleType::kUint32},
                                                                             {"Int64", SampleType::kInt64},
                                                                             {"UInt64", SampleType::kUint64},
                                                                             {"Float32", SampleType::kFloat32},
                                                                             {"Float64", SampleType::kFloat64}}};

// The bytes of the file [begin, end), decoded or not.
class ByteSource {
 public:
  ByteSource(const std::string& path, std::int64_t begin, std::int64_t end, bool base64) : cursor_(path, begin, end), base64_(base64) {}

  // How many bytes there were, at most out.size().
  std::size_t Read(std::span<std::byte> out) {
    if (!base64_) return cursor_.Read(out);
    std::size_t done = 0;
    while (done < out.size() && (!group_.empty() || NextGroup())) {
      const std::size_t count = std::min(group_.size(), out.size() - done);
      std::ranges::copy(group_.first(count), out.begin() + std::ptrdiff_t(done));
      group_ = group_.subspan(count);
      done += count;
    }
    return done;
  }

 private:
  static int Digit(char c) {
    if (c >= 'A' && c <= 'Z') return c - 'A';
    if (c >= 'a' && c <= 'z') return c - 'a' + 26;
    if (c >= '0' && c <= '9') return c - '0' + 52;
    return c == '+' ? 62 : c == '/' ? 63 : -1;
  }

  // Four letters stand for three bytes. Each = at the end of the four stands for one byte less. A header is encoded by itself, so such an
  // end may come before more letters.
  bool NextGroup() {
    unsigned bits = 0;
    std::size_t letters = 0, padding = 0;
    while (letters < 4) {
      const std::optional<char> c = cursor_.Next();
      if (!c) return false;
      if (*c == ' ' || *c == '\n' || *c == '\r' || *c == '\t') continue;
      const int digit = *c == '=' ? 0 : Digit(*c);
      if (digit < 0) return false;
      padding += *c == '=' ? 1 : 0;
      bits = bits << 6 | unsigned(digit);
      ++letters;
    }
    if (padding > 2) return false;
    decoded_ = {std::byte(bits >> 16), std::byte(bits >> 8 & 0xff), std::byte(bits & 0xff)};
    group_ = std::span(decoded_).first(3 - padding);
    return true;
  }

  TextCursor cursor_;
  bool base64_;
  std::array<std::byte, 3> decoded_{};
  std::span<std::byte> group_;
};

// Numbers of the header in front of binary samples.
struct HeaderFormat {
  bool wide = false;  // 8 bytes, else 4
  bool big_endian = false;

  int bytes() const { return wide ? 8 : 4; }  // of a number
};

HeaderFormat HeaderOf(const XmlTag& file) {
  return {file.Attribute("header_type") == "UInt64", file.Attribute("byte_order") == "BigEndian"};
}

Result<std::uint64_t> ReadCount(ByteSource& source, const HeaderFormat& header) {
  std::array<std::byte, 8> bytes{};
  const std::span word = std::span(bytes).first(std::size_t(header.bytes()));
  if (source.Read(word) != word.size()) return Status::DataLoss("truncated in the header of its samples");
  if (header.big_endian) std::ranges::reverse(word);
  return std::bit_cast<std::uint64_t>(bytes);
}

// Of samples that are not compressed: they must have that many bytes.
Status CheckCount(ByteSource& source, const HeaderFormat& header, std::uint64_t wanted) {
  const Result<std::uint64_t> bytes = ReadCount(source, header);
  if (!bytes.ok()) return bytes.status();
  return *bytes == wanted ? Status::Ok() : Status::DataLoss(fmt::format("has {} bytes, must have {}", *bytes, wanted));
}

Status ReadPlain(ByteSource& source, const HeaderFormat& header, std::span<std::byte> out) {
  if (Status status = CheckCount(source, header, out.size()); !status.ok()) return status;
  const std::size_t found = source.Read(out);
  return found == out.size() ? Status::Ok() : Status::DataLoss(fmt::format("truncated: has {} of {} bytes", found, out.size()));
}

// The number of blocks, the size of all but the last, the size of the last if it is less (else 0), and the size of each when compressed.
Status ReadBlocks(ByteSource& source, const HeaderFormat& format, const ChunkCodec& codec, std::int64_t file_bytes,
                  std::span<std::byte> out) {
  std::array<std::uint64_t, 3> header{};
  for (std::uint64_t& number : header) {
    const Result<std::uint64_t> read = ReadCount(source, format);
    if (!read.ok()) return read.status();
    number = *read;
  }
  const auto [blocks, block_bytes, last_bytes] = header;
  const std::uint64_t wanted = out.size(), full = last_bytes == 0 ? blocks : blocks - 1;
  // Compare without multiplying what may be huge.
  const bool fits = blocks > 0 && block_bytes > 0 && last_bytes <= block_bytes && full <= wanted / block_bytes &&
                    full * block_bytes + last_bytes == wanted;
  if (!fits) {
    return Status::DataLoss(
        fmt::format("has {} blocks of {} bytes and {} in the last one, must have {} in all", blocks, block_bytes, last_bytes, wanted));
  }
  std::vector<std::uint64_t> packed_bytes;
  for (std::uint64_t i = 0; i < blocks; ++i) {  // no more than the samples have bytes
    const Result<std::uint64_t> bytes = ReadCount(source, format);
    if (!bytes.ok()) return bytes.status();
    if (*bytes > std::uint64_t(file_bytes))
      return Status::DataLoss(fmt::format("block {} has {} bytes, the file {}", i, *bytes, file_bytes));
    packed_bytes.push_back(*bytes);
  }
  for (std::uint64_t i = 0; i < blocks; ++i) {
    std::vector<std::byte> packed(packed_bytes[i]);
    const std::size_t bytes = std::min<std::size_t>(block_bytes, out.size());
    if (source.Read(packed) != packed.size()) return Status::DataLoss(fmt::format("block {} is truncated", i));
    const Result<Bytes> unpacked = codec.Decode(Bytes(std::move(packed)), bytes);
    if (!unpacked.ok() || unpacked->size() != bytes) return Status::DataLoss(fmt::format("block {} is damaged", i));
    std::ranges::copy(unpacked->span(), out.begin());
    out = out.subspan(bytes);
  }
  return Status::Ok();
}

}  // namespace

std::string_view VtkTypeName(SampleType type) {
  return std::ranges::find(kTypes, type, [](const auto& entry) { return entry.second; })->first;
}

Result<VtkXmlFile> VtkXmlFile::Open(const std::string& path, std::string_view type, const ReadOptions& options) {
  VtkXmlFile file(path);
  if (Status status = file.ReadElements(type); !status.ok()) return status;
  if (Status status = file.TakeTime(options); !status.ok()) return status;
  return file;
}

bool VtkXmlFile::OnStart(const XmlTag& tag, std::string_view type) {
  if (std::exchange(in_array_, false)) arrays_.back().end = tag.begin;
  // Parallel files have the same elements with a P before them, and no samples: PPointData, PDataArray.
  const auto plain = [](const std::string& name) {
    return name.size() > 1 && name[0] == 'P' && std::isupper(name[1]) != 0 ? name.substr(1) : name;
  };
  const std::string name = plain(tag.name), parent = open_.empty() ? "" : plain(open_.back()),
                    grandparent = open_.size() < 2 ? "" : open_[open_.size() - 2];
  open_.push_back(tag.name);
  if (name == "VTKFile") file_ = tag;
  if (tag.name == type) dataset_ = tag;
  if (name == "Piece") pieces_.push_back(tag);
  if (name == "PointData") point_scalars_ = tag.Attribute("Scalars");
  if (name == "CellData") cell_scalars_ = tag.Attribute("Scalars");
  if (name == "DataArray" && (grandparent == "Piece" || (grandparent == type && parallel()))) {
    constexpr std::size_t kMostArrays = 65536;
    in_array_ = arrays_.size() < kMostArrays;
    if (in_array_) arrays_.push_back({tag, parent, grandparent == "Piece" ? pieces_.size() - 1 : 0, tag.end, tag.end});
  }
  if (name != "AppendedData") return true;
  appended_ = tag.end;
  appended_encoding_ = tag.Attribute("encoding");
  return false;
}

void VtkXmlFile::OnEnd(const XmlTag& tag) {
  open_.pop_back();
  // An empty element has one tag, which begins and ends it.
  if (std::exchange(in_array_, false)) arrays_.back().end = std::max(arrays_.back().begin, tag.begin);
}

Status VtkXmlFile::ReadElements(std::string_view type) {
  std::ifstream file(path_, std::ios::binary);
  if (!file) return Status::NotFound(path_ + ": cannot be opened for reading");
  const auto read = [&](std::span<char> out) {
    file.read(out.data(), std::streamsize(out.size()));
    return std::size_t(file.gcount());
  };
  const auto on_start = [&](XmlTag tag) {
    for (auto& [name, value] : tag.attributes) value = std::string(Trimmed(value));
    return OnStart(tag, type);
  };
  const XmlEvents events{on_start, [&](const XmlTag& tag) { OnEnd(tag); }};
  if (Status status = ReadXml(read, events); !status.ok()) {
    return Status(status.code(), fmt::format("{}: not a VTK file of type {}: {}", path_, type, status.message()));
  }
  if (file_.Attribute("type") != type || dataset_.name.empty()) {
    return Wrong(fmt::format("a VTK file of type '{}', must be {}", file_.Attribute("type"), type));
  }
  if (pieces_.empty() || pieces_.size() > kMostVtkPieces) {
    return Wrong(fmt::format("has {} pieces, must have 1 to {}", pieces_.size(), kMostVtkPieces));
  }
  return appended_ > 0 ? FindAppended() : Status::Ok();
}

// An array without the attribute TimeStep is that of all times.
Status VtkXmlFile::TakeTime(const ReadOptions& options) {
  const auto words = [](const std::string& text) {
    std::istringstream stream(text);
    return std::vector<std::string>(std::istream_iterator<std::string>(stream), {});
  };
  std::vector<double> values;
  for (const std::string& word : words(dataset_.Attribute("TimeValues"))) {
    values.push_back(ParseNumber<double>(word).value_or(std::numeric_limits<double>::quiet_NaN()));
  }
  times_ = StatedTimes(std::max<std::int64_t>(1, std::int64_t(values.size())), values, "");
  const Result<std::int64_t> time = ChosenVolume(path_, times_.count, options);
  if (!time.ok()) return time.status();
  time_ = *time;
  std::erase_if(arrays_, [&](const VtkArray& array) {
    const std::vector<std::string> steps = words(array.tag.Attribute("TimeStep"));
    return !steps.empty() && std::ranges::find(steps, std::to_string(time_)) == steps.end();
  });
  return Status::Ok();
}

GridArray VtkXmlFile::Described(const VtkArray& array) const {
  const bool of_points = array.section == "PointData";
  const std::string& active = ActiveScalars(array.section);
  const std::string type_name = array.tag.Attribute("type"), components = array.tag.Attribute("NumberOfComponents");
  const auto* const type = std::ranges::find(kTypes, type_name, [](const auto& entry) { return entry.first; });
  return {.name = array.name(),
          .at = of_points ? ValuesAt::kPoints : ValuesAt::kCells,
          .type = type == kTypes.end() ? std::nullopt : std::optional(type->second),
          .type_name = type_name,
          .components = components.empty() ? 1 : ParseNumber<int>(components).value_or(0),
          .active = !active.empty() && active == array.name()};
}

Result<std::string> VtkXmlFile::SourceOf(std::size_t piece) const {
  const std::string source = pieces_[piece].Attribute("Source");
  if (source.empty()) return Wrong(fmt::format("piece {} names no file: Source is missing", piece));
  return (std::filesystem::path(path_).parent_path() / source).string();
}

OfferedArrays VtkXmlFile::Offered() const {
  OfferedArrays offered;
  for (std::size_t i = 0; i < arrays_.size(); ++i) {
    const VtkArray& array = arrays_[i];
    if (array.piece != 0 || (array.section != "PointData" && array.section != "CellData")) continue;
    offered.arrays.push_back(Described(array));
    offered.numbers.push_back(i);
  }
  return offered;
}

Result<const VtkArray*> VtkXmlFile::Find(std::size_t piece, std::string_view section, const std::string& name) const {
  for (const VtkArray& array : arrays_) {
    if (array.piece == piece && array.section == section && (name.empty() || array.name() == name)) return &array;
  }
  return Wrong(fmt::format("has no array {} in {}{}", name, section, pieces_.size() > 1 ? fmt::format(" of piece {}", piece) : ""));
}

Status VtkXmlFile::FindAppended() {
  TextCursor cursor(path_, appended_);
  std::optional<char> c = cursor.Next();
  while (c && *c != '_' && *c <= ' ') c = cursor.Next();
  if (c != '_') return Damaged("no underscore begins its appended samples");
  appended_ = cursor.offset();
  return Status::Ok();
}

Result<const VtkArray*> VtkXmlFile::FindLike(std::size_t piece, const VtkArray& array) const {
  const Result<const VtkArray*> found = Find(piece, array.section, array.name());
  if (!found.ok()) return found;
  const GridArray wanted = Described(array), described = Described(**found);
  if (described.type == wanted.type && described.components == wanted.components) return found;
  return Wrong(fmt::format("array {} has {} components of {} in piece {}, must have {} of {}", array.name(), described.components,
                           described.type_name, piece, wanted.components, wanted.type_name));
}

Result<std::vector<double>> VtkXmlFile::Numbers(const XmlTag& tag, const std::string& key, std::size_t count,
                                                std::vector<double> if_absent) const {
  const std::string text = tag.Attribute(key);
  if (text.empty() && !if_absent.empty()) return if_absent;
  std::istringstream words(text);
  std::vector<double> numbers;
  for (std::string word; words >> word;) {
    const std::optional<double> number = ParseNumber<double>(word);
    if (!number) break;
    numbers.push_back(*number);
  }
  if (numbers.size() == count && words.eof()) return numbers;
  return Wrong(fmt::format("{} of {} is '{}', must be {} numbers", key, tag.name, text, count));
}

Result<VtkArrayType> VtkXmlFile::TypeOf(const VtkArray& array, int most_components) const {
  const GridArray described = Described(array);
  if (!described.type) return Wrong(fmt::format("array {}: type '{}' is not supported", array.name(), described.type_name));
  if (described.components >= 1 && described.components <= most_components) return VtkArrayType{*described.type, described.components};
  return Wrong(fmt::format("array {}: NumberOfComponents is '{}', must be in [1, {}]", array.name(),
                           array.tag.Attribute("NumberOfComponents"), most_components));
}

Result<VtkXmlFile::Place> VtkXmlFile::PlaceOf(const VtkArray& array) const {
  const std::string name = array.name(), format = array.tag.Attribute("format"), compressor = file_.Attribute("compressor");
  const bool appended = format == "appended";
  Place place = {.text = format == "ascii", .begin = array.begin, .end = array.end};
  if (!place.text && !compressor.empty()) {
    place.compressor = FindNamed(Compressors(), compressor);
    if (place.compressor == nullptr) {
      return Wrong(fmt::format("compressor {} is not supported; supported: {}", compressor, NamesOf(Compressors())));
    }
  }
  if (!place.text && !appended && format != "binary") {
    return Wrong(fmt::format("array {}: format '{}', must be ascii, binary or appended", name, format));
  }
  place.base64 = !appended || appended_encoding_ != "raw";
  if (appended && place.base64 && appended_encoding_ != "base64" && !appended_encoding_.empty()) {
    return Wrong(fmt::format("its appended samples have encoding '{}', must be raw or base64", appended_encoding_));
  }
  std::error_code error;
  place.file_bytes = std::int64_t(std::filesystem::file_size(path_, error));
  if (error) return Status::NotFound(path_ + ": cannot be opened for reading");
  if (!appended) return place;
  const std::string offset = array.tag.Attribute("offset");
  const std::optional<std::int64_t> bytes = ParseNumber<std::int64_t>(offset);
  if (!bytes || *bytes < 0 || appended_ == 0) return Wrong(fmt::format("array {}: offset '{}' of appended samples", name, offset));
  place.begin = std::min(*bytes, place.file_bytes) + appended_;
  place.end = std::max(place.begin, place.file_bytes);
  return place;
}

Status VtkXmlFile::CheckHolds(const VtkArray& array, SampleType type, std::int64_t samples) const {
  const Result<Place> place = PlaceOf(array);
  if (!place.ok()) return place.status();
  // A text has a digit and a blank for each sample, at least.
  const std::int64_t bytes = samples * std::int64_t(BytesPerSample(type));
  const std::int64_t least = place->text ? 2 * samples - 1 : place->compressor != nullptr ? bytes / place->compressor->most_ratio : bytes;
  if (place->end - place->begin >= least) return Status::Ok();
  return Damaged(fmt::format("truncated: array {} has {} bytes, its {} samples need at least {}", array.name(),
                             std::max<std::int64_t>(place->end - place->begin, 0), samples, least));
}

Status VtkXmlFile::InArray(const VtkArray& array, const Status& status) const {
  return status.ok() ? status : Status(status.code(), fmt::format("{}: array {}: {}", path_, array.name(), status.message()));
}

Result<VtkXmlFile::PlainSamples> VtkXmlFile::FindPlainSamples(const VtkArray& array, SampleType type, std::int64_t samples) const {
  if (Status status = CheckHolds(array, type, samples); !status.ok()) return status;
  const Result<Place> place = PlaceOf(array);
  if (!place.ok()) return place.status();
  if (place->text || place->base64 || place->compressor != nullptr) {
    return Wrong(fmt::format("array {}: its samples are text, base64 or compressed", array.name()));
  }
  ByteSource source(path_, place->begin, place->end, false);
  const HeaderFormat header = HeaderOf(file_);
  const std::uint64_t bytes = std::uint64_t(samples) * BytesPerSample(type);
  if (Status status = InArray(array, CheckCount(source, header, bytes)); !status.ok()) return status;
  return PlainSamples{place->begin + header.bytes(), header.big_endian};
}

Status VtkXmlFile::ReadSamples(const VtkArray& array, SampleType type, AlignedVector<std::byte>& out) const {
  const Result<Place> place = PlaceOf(array);
  if (!place.ok()) return place.status();
  Status status;
  if (place->text) {
    TextCursor cursor(path_, place->begin, place->end);
    status = ReadTextSamples(cursor, type, out);
  } else {
    ByteSource source(path_, place->begin, place->end, place->base64);
    const HeaderFormat header = HeaderOf(file_);
    status = place->compressor != nullptr ? ReadBlocks(source, header, *place->compressor->codec, place->file_bytes, out)
                                          : ReadPlain(source, header, out);
    if (header.big_endian) SwapByteOrder(type, out);
  }
  return InArray(array, status);
}

}  // namespace slabstream
