// VTK image data in XML (.vti), by VTK's "VTK XML Formats": one piece, whose samples stand in the elements as text or base64, or appended
// raw or in base64; uncompressed or in blocks of zlib.
#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <fstream>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include "common/base/parse_number.h"
#include "common/volume/memory_budget.h"
#include "common/volume_io/formats.h"
#include "common/volume_io/output.h"
#include "common/volume_io/text_cursor.h"
#include "common/volume_io/xml_events.h"

namespace slabstream {
namespace {

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

  // Four letters are three bytes; each = at their end is one byte less. What was encoded by itself, like a header, ends so, and more
  // follows.
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

struct DataArray {
  XmlTag tag;
  std::int64_t begin = 0, end = 0;  // of what stands in the element
};

// What the XML says, up to the appended samples.
struct ImageFile {
  XmlTag file, image, piece;
  int pieces = 0, cell_arrays = 0;
  std::string scalars;  // the name of the active ones
  std::vector<DataArray> arrays;
  std::string appended_encoding;
  std::int64_t appended = 0;  // the byte behind the underscore before the samples; 0: there are none
};

class Reader {
 public:
  Reader(const std::string& path, const ReadOptions& options) : path_(path), options_(options) {}

  Result<RawVolume> Read() {
    if (Status status = ReadElements(); !status.ok()) return status;
    if (Status status = ReadHeader(); !status.ok()) return status;
    const Result<const DataArray*> array = ChooseArray();
    if (!array.ok()) return array.status();
    return ReadArray(**array);
  }

 private:
  Status Wrong(const std::string& why) const { return Status::InvalidArgument(path_ + ": " + why); }
  Status Damaged(const std::string& why) const { return Status::DataLoss(path_ + ": " + why); }

  Status ReadElements();
  bool OnStart(const XmlTag& tag);
  void OnEnd(const XmlTag& tag);
  Status FindAppended();

  // `count` numbers of an attribute; `if_absent` if it is missing.
  Result<std::vector<double>> Numbers(const XmlTag& tag, const std::string& key, std::size_t count, std::vector<double> if_absent) const;
  Status ReadHeader();
  Result<const DataArray*> ChooseArray() const;
  Result<RawVolume> ReadArray(const DataArray& array);
  // A number of the header in front of binary samples.
  Result<std::uint64_t> ReadCount(ByteSource& source) const;
  Status ReadPlain(ByteSource& source, std::span<std::byte> out) const;
  Status ReadBlocks(ByteSource& source, std::int64_t file_bytes, std::span<std::byte> out) const;

  const std::string& path_;
  const ReadOptions& options_;
  ImageFile file_;
  RawHeader header_;
  // While elements are read.
  std::vector<std::string> open_;  // names of the elements that are open
  DataArray* array_ = nullptr;     // the one that is open
};

bool Reader::OnStart(const XmlTag& tag) {
  const std::string parent = open_.empty() ? "" : open_.back(), grandparent = open_.size() < 2 ? "" : open_[open_.size() - 2];
  open_.push_back(tag.name);
  if (tag.name == "VTKFile") file_.file = tag;
  if (tag.name == "ImageData") file_.image = tag;
  if (tag.name == "Piece" && ++file_.pieces == 1) file_.piece = tag;
  if (tag.name == "PointData") file_.scalars = tag.Attribute("Scalars");
  if (tag.name == "DataArray" && parent == "CellData") ++file_.cell_arrays;
  if (tag.name == "DataArray" && parent == "PointData" && grandparent == "Piece") {
    constexpr std::size_t kMostArrays = 4096;
    if (file_.arrays.size() < kMostArrays) array_ = &file_.arrays.emplace_back(DataArray{tag, tag.end, tag.end});
  }
  if (tag.name != "AppendedData") return true;
  file_.appended = tag.end;
  file_.appended_encoding = tag.Attribute("encoding");
  return false;
}

void Reader::OnEnd(const XmlTag& tag) {
  open_.pop_back();
  if (array_ == nullptr) return;
  if (tag.name == "DataArray") {
    array_->end = std::max(array_->begin, tag.begin);
    array_ = nullptr;
  } else {
    array_->begin = tag.end;  // samples stand behind what else is in the element
  }
}

Status Reader::ReadElements() {
  std::ifstream file(path_, std::ios::binary);
  if (!file) return Status::NotFound(path_ + ": cannot be opened for reading");
  const auto read = [&](std::span<char> out) {
    file.read(out.data(), std::streamsize(out.size()));
    return std::size_t(file.gcount());
  };
  const XmlEvents events{[this](const XmlTag& tag) { return OnStart(tag); }, [this](const XmlTag& tag) { OnEnd(tag); }};
  if (Status status = ReadXml(read, events); !status.ok()) return Status(status.code(), path_ + ": not a VTK image: " + status.message());
  if (file_.file.Attribute("type") != "ImageData" || file_.image.name.empty()) {
    return Wrong(fmt::format("a VTK file of type '{}', must be ImageData", file_.file.Attribute("type")));
  }
  return file_.appended > 0 ? FindAppended() : Status::Ok();
}

Status Reader::FindAppended() {
  TextCursor cursor(path_, file_.appended);
  std::optional<char> c = cursor.Next();
  while (c && *c != '_' && *c <= ' ') c = cursor.Next();
  if (c != '_') return Damaged("no underscore begins its appended samples");
  file_.appended = cursor.offset();
  return Status::Ok();
}

Result<std::vector<double>> Reader::Numbers(const XmlTag& tag, const std::string& key, std::size_t count,
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

Status Reader::ReadHeader() {
  if (file_.pieces != 1) return Wrong(fmt::format("has {} pieces, must have 1", file_.pieces));
  const auto whole = Numbers(file_.image, "WholeExtent", 6, {}), extent = Numbers(file_.piece, "Extent", 6, {});
  const auto origin = Numbers(file_.image, "Origin", 3, {0, 0, 0}), spacing = Numbers(file_.image, "Spacing", 3, {1, 1, 1});
  const auto direction = Numbers(file_.image, "Direction", 9, {1, 0, 0, 0, 1, 0, 0, 0, 1});
  for (const auto* numbers : {&whole, &extent, &origin, &spacing, &direction}) {
    if (!numbers->ok()) return numbers->status();
  }
  if (*whole != *extent) {
    return Wrong(fmt::format("its piece has the extent {}, must have all of it: {}", file_.piece.Attribute("Extent"),
                             file_.image.Attribute("WholeExtent")));
  }
  const auto& e = *extent;
  if (Status status = SetSize(header_, path_, {e[1] - e[0] + 1, e[3] - e[2] + 1, e[5] - e[4] + 1}, options_); !status.ok()) return status;
  header_.world = World::kScene;
  header_.matrix = "Direction";
  header_.origin = {(*origin)[0], (*origin)[1], (*origin)[2]};
  for (std::size_t i = 0; i < 3; ++i) {
    header_.steps[i] = (*spacing)[i] * Vec3{(*direction)[i], (*direction)[3 + i], (*direction)[6 + i]};
    header_.origin = header_.origin + e[2 * i] * header_.steps[i];
  }
  return Status::Ok();
}

Result<const DataArray*> Reader::ChooseArray() const {
  const std::vector<DataArray>& arrays = file_.arrays;
  if (arrays.size() == 1) return &arrays.front();
  const auto active = std::ranges::find_if(arrays, [&](const DataArray& array) { return array.tag.Attribute("Name") == file_.scalars; });
  if (active != arrays.end() && !file_.scalars.empty()) return &*active;
  std::string names;
  for (const DataArray& array : arrays) names.append(names.empty() ? "" : ", ").append(array.tag.Attribute("Name"));
  if (!names.empty()) return Wrong("has several arrays and none is the active scalars, must have one: " + names);
  return Wrong(file_.cell_arrays > 0
                   ? "its samples belong to cells (CellData), must belong to points; ParaView's filter Cell Data to Point "
                     "Data makes them so"
                   : "has no samples of points (PointData)");
}

Result<RawVolume> Reader::ReadArray(const DataArray& array) {
  const std::string name = array.tag.Attribute("Name"), type_name = array.tag.Attribute("type"), format = array.tag.Attribute("format");
  const auto* const type = std::ranges::find(kTypes, type_name, [](const auto& entry) { return entry.first; });
  if (type == kTypes.end()) return Wrong(fmt::format("array {}: type '{}' is not supported", name, type_name));
  header_.type = type->second;
  const std::string components = array.tag.Attribute("NumberOfComponents");
  header_.components = components.empty() ? 1 : ParseNumber<int>(components).value_or(0);
  if (header_.components < 1 || header_.components > kMaxComponents) {
    return Wrong(fmt::format("array {}: NumberOfComponents is '{}', must be in [1, {}]", name, components, kMaxComponents));
  }
  const std::string compressor = file_.file.Attribute("compressor");
  const bool text = format == "ascii", appended = format == "appended", compressed = !text && !compressor.empty();
  if (compressed && compressor != "vtkZLibDataCompressor") {
    return Wrong(fmt::format("compressor {} is not supported; supported: vtkZLibDataCompressor", compressor));
  }
  if (!text && !appended && format != "binary")
    return Wrong(fmt::format("array {}: format '{}', must be ascii, binary or appended", name, format));
  const bool base64 = !appended || file_.appended_encoding == "base64";
  if (appended && !base64 && file_.appended_encoding != "raw") {
    return Wrong(fmt::format("its appended samples have encoding '{}', must be raw or base64", file_.appended_encoding));
  }

  std::error_code error;
  const auto file_bytes = std::int64_t(std::filesystem::file_size(path_, error));
  std::int64_t begin = array.begin, end = array.end;
  if (appended) {
    const std::string offset = array.tag.Attribute("offset");
    const std::optional<std::int64_t> bytes = ParseNumber<std::int64_t>(offset);
    if (!bytes || *bytes < 0 || file_.appended == 0) return Wrong(fmt::format("array {}: offset '{}' of appended samples", name, offset));
    begin = std::min(*bytes, file_bytes) + file_.appended;
    end = std::max(begin, file_bytes);
  }

  // A text has a digit and a blank for each sample, at least.
  const std::int64_t bytes = header_.sample_bytes(), samples = bytes / std::int64_t(BytesPerSample(header_.type));
  const std::int64_t least = text ? 2 * samples - 1 : compressed ? bytes / kMaxDeflateRatio : bytes;
  if (error || end - begin < least) {
    return Damaged(fmt::format("truncated: array {} has {} bytes, its {} samples need at least {}", name,
                               std::max<std::int64_t>(end - begin, 0), samples, least));
  }
  Result<RawVolume> raw = TakeMemory(path_, header_, options_);
  if (!raw.ok() || options_.headers_only) return raw;
  Status status;
  if (text) {
    TextCursor cursor(path_, begin, end);
    status = ReadTextSamples(cursor, header_.type, raw->bytes);
  } else {
    ByteSource source(path_, begin, end, base64);
    status = compressed ? ReadBlocks(source, file_bytes, raw->bytes) : ReadPlain(source, raw->bytes);
    if (file_.file.Attribute("byte_order") == "BigEndian") SwapByteOrder(header_.type, raw->bytes);
  }
  if (!status.ok()) return Status(status.code(), fmt::format("{}: array {}: {}", path_, name, status.message()));
  return raw;
}

Result<std::uint64_t> Reader::ReadCount(ByteSource& source) const {
  std::array<std::byte, 8> bytes{};
  const std::span word = std::span(bytes).first(file_.file.Attribute("header_type") == "UInt64" ? 8 : 4);
  if (source.Read(word) != word.size()) return Status::DataLoss("truncated in the header of its samples");
  if (file_.file.Attribute("byte_order") == "BigEndian") std::ranges::reverse(word);
  return std::bit_cast<std::uint64_t>(bytes);
}

Status Reader::ReadPlain(ByteSource& source, std::span<std::byte> out) const {
  const Result<std::uint64_t> bytes = ReadCount(source);
  if (!bytes.ok()) return bytes.status();
  if (*bytes != out.size()) return Status::DataLoss(fmt::format("has {} bytes, must have {}", *bytes, out.size()));
  const std::size_t found = source.Read(out);
  return found == out.size() ? Status::Ok() : Status::DataLoss(fmt::format("truncated: has {} of {} bytes", found, out.size()));
}

// The number of blocks, the size of all but the last, the size of the last if it is less (else 0), and the size of each when compressed.
Status Reader::ReadBlocks(ByteSource& source, std::int64_t file_bytes, std::span<std::byte> out) const {
  std::array<std::uint64_t, 3> header{};
  for (std::uint64_t& number : header) {
    const Result<std::uint64_t> read = ReadCount(source);
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
    const Result<std::uint64_t> bytes = ReadCount(source);
    if (!bytes.ok()) return bytes.status();
    if (*bytes > std::uint64_t(file_bytes))
      return Status::DataLoss(fmt::format("block {} has {} bytes, the file {}", i, *bytes, file_bytes));
    packed_bytes.push_back(*bytes);
  }
  std::vector<std::byte> packed;
  std::size_t done = 0;
  for (std::uint64_t i = 0; i < blocks; ++i) {
    packed.resize(packed_bytes[i]);
    const std::size_t bytes = std::min<std::size_t>(block_bytes, out.size() - done);
    uLongf unpacked = bytes;
    uLong used = packed.size();
    const bool sound = source.Read(packed) == packed.size() && uncompress2(reinterpret_cast<Bytef*>(out.data() + done), &unpacked,
                                                                           reinterpret_cast<const Bytef*>(packed.data()), &used) == Z_OK;
    if (!sound || unpacked != bytes || used != packed.size()) {
      return Status::DataLoss(fmt::format("block {} is truncated or damaged", i));
    }
    done += bytes;
  }
  return Status::Ok();
}

Result<RawVolume> Read(const std::string& path, const ReadOptions& options) { return Reader(path, options).Read(); }

// Appended raw and not compressed: what every reader takes, and the quickest to write.
Status Write(const FileSamples& samples, const std::string& path) {
  const auto& [size, spacing, orientation] = samples.geometry();
  const auto& axes = orientation.axes;
  const std::string extent = fmt::format("0 {} 0 {} 0 {}", size.x - 1, size.y - 1, size.z - 1);
  const auto* const type = std::ranges::find(kTypes, samples.type(), [](const auto& entry) { return entry.second; });
  std::string header = fmt::format(
      "<?xml version=\"1.0\"?>\n"
      "<VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n"
      "  <ImageData WholeExtent=\"{0}\" Origin=\"{1}\" Spacing=\"{2}\" Direction=\"{3} {4} {5}\">\n"
      "    <Piece Extent=\"{0}\">\n"
      "      <PointData Scalars=\"values\">\n"
      "        <DataArray type=\"{6}\" Name=\"values\" format=\"appended\" offset=\"0\"/>\n"
      "      </PointData>\n"
      "    </Piece>\n"
      "  </ImageData>\n"
      "  <AppendedData encoding=\"raw\">\n"
      "_",
      extent, slabstream::Numbers(orientation.origin), slabstream::Numbers(spacing), slabstream::Numbers({axes[0].x, axes[1].x, axes[2].x}),
      slabstream::Numbers({axes[0].y, axes[1].y, axes[2].y}), slabstream::Numbers({axes[0].z, axes[1].z, axes[2].z}), type->first);
  const auto bytes = std::uint64_t(samples.bytes());
  header.append(reinterpret_cast<const char*>(&bytes), sizeof bytes);
  Result<OutputFile> file = OutputFile::Create(path);
  if (!file.ok()) return file.status();
  file->Append(header);
  AppendSamples(*file, samples);
  file->Append(std::string("\n  </AppendedData>\n</VTKFile>\n"));
  return file->Finish();
}

}  // namespace

VolumeFormat VtkImage() {
  return {.name = "VTK image",
          .endings = {".vti"},
          .options = {"channel"},
          .read = Read,
          .written_endings = {".vti"},
          .write = Write,
          .keeps = {.patient = false}};
}

}  // namespace slabstream
