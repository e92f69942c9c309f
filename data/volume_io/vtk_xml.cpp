#include "data/volume_io/vtk_xml.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <filesystem>
#include <iterator>
#include <limits>
#include <optional>
#include <span>
#include <sstream>
#include <utility>

#include "common/base/find_named.h"
#include "common/base/second_of.h"
#include "common/files/files.h"
#include "common/text/base64.h"
#include "common/text/parse_number.h"
#include "common/text/trimmed.h"
#include "common/volume/memory_budget.h"
#include "data/codecs/codecs.h"
#include "data/volume_io/packed_samples.h"
#include "data/volume_io/raw_volume.h"
#include "data/volume_io/stated_field.h"
#include "data/volume_io/text_cursor.h"

namespace slabstream {
namespace {

struct Compressor {
  std::string_view name;
  SharedCodec codec;
  std::int64_t most_ratio = 1;  // of the bytes of a block to those that are stored, at most
};

const std::vector<Compressor>& Compressors() {
  // LZ4: a byte of a length stands for 255. xz packs zeros about 7000:1.
  static const std::vector<Compressor> compressors = {{"vtkZLibDataCompressor", ZlibCodec(), kMaxDeflateRatio},
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
  ByteSource(const std::string& path, std::int64_t begin, std::int64_t end, bool base64)
      : cursor_(path, begin, end), end_(end), base64_(base64) {}

  std::int64_t left() const { return std::max<std::int64_t>(end_ - cursor_.offset(), 0); }  // bytes of the file, at most
  // Says where the bytes that are read next lie: in base64, if there are no blanks among the letters. How far back that is.
  std::int64_t SetPlace(PackedSamples& samples) const {
    const std::int64_t back = group_.empty() ? 0 : kGroup;
    samples.base64 = base64_;
    samples.begin = std::uint64_t(cursor_.offset() - back);
    samples.before = group_.empty() ? 0 : decoded_.size() - group_.size();
    return back;
  }

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
  // Four letters stand for three bytes. Each = at the end of the four stands for one byte less. A header is encoded by itself, so such an
  // end may come before more letters.
  bool NextGroup() {
    unsigned bits = 0;
    std::size_t padding = 0;
    std::int64_t letters = 0;
    while (letters < kGroup) {
      const std::optional<char> c = cursor_.Next();
      if (!c) return false;
      if (*c == ' ' || *c == '\n' || *c == '\r' || *c == '\t') continue;
      const int digit = *c == '=' ? 0 : Base64Digit(*c);
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

  static constexpr std::int64_t kGroup = 4;  // letters

  TextCursor cursor_;
  std::int64_t end_;
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

// The number of blocks, the size of all but the last, the size of the last if it is less (else 0), and the size of each when compressed.
Status ReadBlockSizes(ByteSource& source, const HeaderFormat& format, PackedSamples& samples) {
  std::array<std::uint64_t, 3> header{};
  for (std::uint64_t& number : header) {
    const Result<std::uint64_t> read = ReadCount(source, format);
    if (!read.ok()) return read.status();
    number = *read;
  }
  const auto [blocks, block_bytes, last_bytes] = header;
  const std::uint64_t wanted = samples.bytes, full = last_bytes == 0 ? blocks : blocks - 1;
  // Compare without multiplying what may be huge.
  const bool fits = blocks > 0 && block_bytes > 0 && last_bytes <= block_bytes && full <= wanted / block_bytes &&
                    full * block_bytes + last_bytes == wanted;
  if (!fits) {
    return Status::DataLoss(
        fmt::format("has {} blocks of {} bytes and {} in the last one, must have {} in all", blocks, block_bytes, last_bytes, wanted));
  }
  if (const auto most = std::uint64_t(source.left() / format.bytes()); blocks > most) {
    return Status::DataLoss(fmt::format("truncated: speaks of {} blocks, has the sizes of {} at most", blocks, most));
  }
  if (Status status = CheckFitsMemory(std::int64_t(blocks * sizeof(std::uint64_t)), "the sizes of its blocks"); !status.ok()) return status;
  samples.block_bytes = std::min(block_bytes, wanted);
  samples.block_ends.reserve(blocks);
  std::uint64_t end = 0;
  for (std::uint64_t i = 0; i < blocks; ++i) {
    constexpr std::uint64_t kFrame = 256;  // compressors add checksums and headers to what does not shrink
    const Result<std::uint64_t> bytes = ReadCount(source, format);
    if (!bytes.ok()) return bytes.status();
    const std::uint64_t most = 2 * std::min(samples.block_bytes, wanted - i * samples.block_bytes) + kFrame;
    if (*bytes > most) return Status::DataLoss(fmt::format("block {} has {} compressed bytes, must have at most {}", i, *bytes, most));
    samples.block_ends.push_back(end += *bytes);
  }
  return Status::Ok();
}

// Reads the header in front of `bytes` of samples. `codec`: null if they are not compressed.
Result<PackedSamples> ReadHeader(ByteSource& source, const HeaderFormat& format, SharedCodec codec, std::uint64_t bytes) {
  PackedSamples samples{.bytes = bytes, .codec = std::move(codec), .big_endian = format.big_endian};
  if (samples.codec != nullptr) {
    if (Status status = ReadBlockSizes(source, format, samples); !status.ok()) return status;
  } else {
    const Result<std::uint64_t> stated = ReadCount(source, format);
    if (!stated.ok()) return stated.status();
    if (*stated != bytes) return Status::DataLoss(fmt::format("has {} bytes, must have {}", *stated, bytes));
  }
  const std::int64_t left = source.left() + source.SetPlace(samples);
  if (const std::uint64_t needed = samples.Stored({0, bytes}).bytes; needed > std::uint64_t(left)) {
    return Status::DataLoss(fmt::format("truncated: needs {} bytes of the file, has {}", needed, left));
  }
  return samples;
}

Status ReadBytes(ByteSource& source, const PackedSamples& samples, std::span<std::byte> out) {
  if (samples.codec == nullptr) {
    const std::size_t found = source.Read(out);
    return found == out.size() ? Status::Ok() : Status::DataLoss(fmt::format("truncated: has {} of {} bytes", found, out.size()));
  }
  for (std::size_t i = 0; i < samples.block_ends.size(); ++i) {
    std::vector<std::byte> packed(samples.PlaceOf(i).bytes);
    if (source.Read(packed) != packed.size()) return Status::DataLoss(fmt::format("block {} is truncated", i));
    const Result<Bytes> block = samples.DecodeBlock(i, Bytes(std::move(packed)));
    if (!block.ok()) return block.status();
    std::ranges::copy(block->span(), out.begin());
    out = out.subspan(block->size());
  }
  return Status::Ok();
}

// That the samples can be read in parts: blocks are neither so large that one is a burden, nor so small that most of what is read may be
// frames, and letters of base64 follow each other, as far as their ends tell. `end`: where the samples must end in the file; none: not
// known.
Status CheckParts(const PackedSamples& samples, const std::string& path, std::optional<std::int64_t> end) {
  constexpr std::uint64_t kLeastBlock = 64, kMostBlock = std::uint64_t{64} << 20, kLetters = 4096;
  if (samples.block_bytes > kMostBlock || samples.block_ends.size() > samples.bytes / kLeastBlock + 1) {
    return Status::InvalidArgument(
        fmt::format("has blocks of {} bytes, must have {} to {} to be read in parts", samples.block_bytes, kLeastBlock, kMostBlock));
  }
  if (!samples.base64) return Status::Ok();
  const auto [begin, bytes] = samples.Stored({0, samples.bytes});
  std::vector<std::byte> letters(std::min(bytes, kLetters)), decoded(letters.size());
  bool follow = true;
  for (const std::uint64_t from : {begin, begin + bytes - letters.size()}) {
    TextCursor cursor(path, std::int64_t(from));
    follow = follow && cursor.Read(letters) == letters.size() && DecodeBase64(letters, decoded);
  }
  // Blanks anywhere would move the last letters behind their place.
  if (end) follow = follow && Base64Digit(TextCursor(path, std::int64_t(begin + bytes), *end).Next().value_or(' ')) < 0;
  return follow ? Status::Ok() : Status::InvalidArgument("has letters of base64 with blanks among them");
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
  const bool of_dataset = grandparent == type && (parallel() || parent == "FieldData");
  if ((name == "DataArray" && (grandparent == "Piece" || of_dataset)) || (name == "Array" && of_dataset)) {
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
  const auto on_start = [&](XmlTag tag) {
    for (auto& [name, value] : tag.attributes) value = std::string(Trimmed(value));
    return OnStart(tag, type);
  };
  const XmlEvents events{on_start, [&](const XmlTag& tag) { OnEnd(tag); }};
  if (Status status = ReadXmlFile(path_, fmt::format("not a VTK file of type {}: ", type), events); !status.ok()) return status;
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
  return {.name = array.name(),
          .at = of_points ? ValuesAt::kPoints : ValuesAt::kCells,
          .type = SecondOf(kTypes, type_name),
          .type_name = type_name,
          .components = components.empty() ? 1 : ParseNumber<int>(components).value_or(0),
          .active = !active.empty() && active == array.name()};
}

Result<std::string> VtkXmlFile::SourceOf(std::size_t piece) const {
  const std::string source = pieces_[piece].Attribute("Source");
  if (source.empty()) return Wrong(fmt::format("piece {} names no file: Source is missing", piece));
  const std::filesystem::path file = std::filesystem::path(path_).parent_path() / source;
  if (CheckIsFile(file.string()).ok()) return file.string();
  return Wrong(fmt::format("piece {} names {}, which is not a file that can be read", piece, source));
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
  Place place = {.text = format == "ascii", .appended = appended, .begin = array.begin, .end = array.end};
  if (!place.text && !compressor.empty()) {
    const auto* const found = FindNamed(Compressors(), compressor);
    if (found == nullptr) {
      return Wrong(fmt::format("compressor {} is not supported; supported: {}", compressor, NamesOf(Compressors())));
    }
    place.codec = found->codec;
    place.most_ratio = found->most_ratio;
  }
  if (!place.text && !appended && format != "binary") {
    return Wrong(fmt::format("array {}: format '{}', must be ascii, binary or appended", name, format));
  }
  place.base64 = !appended || appended_encoding_ != "raw";
  if (appended && place.base64 && appended_encoding_ != "base64" && !appended_encoding_.empty()) {
    return Wrong(fmt::format("its appended samples have encoding '{}', must be raw or base64", appended_encoding_));
  }
  if (!appended) return place;
  std::error_code error;
  const auto file_bytes = std::int64_t(std::filesystem::file_size(path_, error));
  if (error) return Status::NotFound(path_ + ": cannot be opened for reading");
  const std::string offset = array.tag.Attribute("offset");
  const std::optional<std::int64_t> bytes = ParseNumber<std::int64_t>(offset);
  if (!bytes || *bytes < 0 || appended_ == 0) return Wrong(fmt::format("array {}: offset '{}' of appended samples", name, offset));
  place.begin = std::min(*bytes, file_bytes) + appended_;
  place.end = std::max(place.begin, file_bytes);
  return place;
}

Status VtkXmlFile::CheckHolds(const VtkArray& array, SampleType type, std::int64_t samples) const {
  const Result<Place> place = PlaceOf(array);
  if (!place.ok()) return place.status();
  // A text has a digit and a blank for each sample, at least.
  const std::int64_t bytes = samples * std::int64_t(BytesPerSample(type));
  const std::int64_t least = place->text ? 2 * samples - 1 : bytes / place->most_ratio;
  if (place->end - place->begin >= least) return Status::Ok();
  return Damaged(fmt::format("truncated: array {} has {} bytes, its {} samples need at least {}", array.name(),
                             std::max<std::int64_t>(place->end - place->begin, 0), samples, least));
}

Status VtkXmlFile::InArray(const VtkArray& array, const Status& status) const {
  return status.ok() ? status : Status(status.code(), fmt::format("{}: array {}: {}", path_, array.name(), status.message()));
}

Result<LocatedSamples> VtkXmlFile::Locate(const VtkArray& array, SampleType type, std::int64_t samples) const {
  if (Status status = CheckHolds(array, type, samples); !status.ok()) return status;
  const Result<Place> place = PlaceOf(array);
  if (!place.ok()) return place.status();
  if (place->text) return Wrong(fmt::format("array {}: its samples are text", array.name()));
  ByteSource source(path_, place->begin, place->end, place->base64);
  Result<PackedSamples> found = ReadHeader(source, HeaderOf(file_), place->codec, std::uint64_t(samples) * BytesPerSample(type));
  if (!found.ok()) return InArray(array, found.status());
  LocatedSamples located{{}, {.file = path_, .offset = std::int64_t(found->begin), .big_endian = found->big_endian}};
  if (!place->base64 && place->codec == nullptr) return located;
  if (Status status = InArray(array, CheckParts(*found, path_, place->appended ? std::nullopt : std::optional(place->end))); !status.ok())
    return status;
  found->name = fmt::format("{}: array {}", path_, array.name());
  located.packed = std::make_shared<const PackedSamples>(*std::move(found));
  return located;
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
    const Result<PackedSamples> found = ReadHeader(source, HeaderOf(file_), place->codec, out.size());
    status = found.ok() ? ReadBytes(source, *found, out) : found.status();
    if (status.ok() && found->big_endian) SwapByteOrder(type, out);
  }
  return InArray(array, status);
}

}  // namespace slabstream
