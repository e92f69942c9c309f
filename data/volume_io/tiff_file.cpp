#include "data/volume_io/tiff_file.h"

#include <fmt/format.h>
#include <tiffio.h>

#include <algorithm>
#include <array>
#include <cstdarg>
#include <cstdio>
#include <utility>

#include "data/volume_io/tiff_field.h"
#include "data/volume_io/tiff_input.h"

namespace slabstream {
namespace {

// Keeps what libtiff complains about first; the rest are consequences.
int KeepFirst(TIFF*, void* complaint, const char*, const char* format, va_list arguments) {
  std::string& text = *static_cast<std::string*>(complaint);
  if (text.empty()) {
    std::array<char, 256> buffer{};
    (void)std::vsnprintf(buffer.data(), buffer.size(), format, arguments);
    text = buffer.data();
  }
  return 1;  // handled: nothing goes to stderr
}

int Ignore(TIFF*, void*, const char*, const char*, va_list) { return 1; }

struct NamedNumber {
  unsigned number;
  std::string_view name;
};

std::string Named(std::span<const NamedNumber> known, unsigned number) {
  const auto found = std::ranges::find(known, number, &NamedNumber::number);
  return found == known.end() ? std::to_string(number) : fmt::format("{} ({})", number, found->name);
}

// Those that libtiff lacks, or may be built without.
constexpr NamedNumber kCompressions[] = {{6, "JPEG of TIFF 6.0"},
                                         {7, "JPEG"},
                                         {33003, "JPEG 2000, Aperio"},
                                         {33004, "JPEG 2000, Aperio"},
                                         {33005, "JPEG 2000, Aperio"},
                                         {22610, "JPEG XR"},
                                         {34661, "JBIG"},
                                         {34712, "JPEG 2000"},
                                         {34887, "LERC"},
                                         {34892, "JPEG, lossy"},
                                         {34925, "LZMA"},
                                         {34926, "Zstandard"},
                                         {34927, "WebP"},
                                         {34933, "PNG"},
                                         {34934, "JPEG XR"},
                                         {48124, "Jetraw"},
                                         {50000, "Zstandard"},
                                         {50001, "WebP"},
                                         {50002, "JPEG XL"},
                                         {52546, "JPEG XL"}};
constexpr unsigned kLinearRaw = 34892;  // of DNG; tiff.h has no name for it
constexpr NamedNumber kColours[] = {{PHOTOMETRIC_PALETTE, "palette"},   {PHOTOMETRIC_SEPARATED, "CMYK"},
                                    {PHOTOMETRIC_YCBCR, "YCbCr"},       {PHOTOMETRIC_CIELAB, "CIE L*a*b*"},
                                    {PHOTOMETRIC_ICCLAB, "ICC L*a*b*"}, {PHOTOMETRIC_ITULAB, "ITU L*a*b*"},
                                    {PHOTOMETRIC_LOGL, "CIE Log2(L)"},  {PHOTOMETRIC_LOGLUV, "CIE Log2(L)(u',v')"}};

// Samples of less than 8 and of 9 to 15 bits, which have no bytes of their own, become unsigned integers.
std::optional<SampleType> ToSampleType(unsigned bits, unsigned format) {
  const bool is_unsigned = format == SAMPLEFORMAT_UINT || format == SAMPLEFORMAT_VOID;
  if (IsPacked(bits) && is_unsigned) return bits < 8 ? SampleType::kUint8 : SampleType::kUint16;
  const char* kind = is_unsigned ? "uint" : format == SAMPLEFORMAT_INT ? "int" : format == SAMPLEFORMAT_IEEEFP ? "float" : "";
  return SampleTypeNamed(kind + std::to_string(bits));
}

// Of a field that libtiff does not know, and therefore gives with their number.
template <class T>
std::span<const T> Values(TIFF* tiff, ttag_t tag, TIFFDataType type) {
  const TIFFField* const field = TIFFFindField(tiff, tag, TIFF_ANY);
  if (field == nullptr || TIFFFieldDataType(field) != type || TIFFFieldReadCount(field) != TIFF_VARIABLE2) return {};
  std::uint32_t count = 0;
  const T* values = nullptr;
  return TIFFGetField(tiff, tag, &count, &values) != 0 ? std::span(values, count) : std::span<const T>();
}

}  // namespace

void TiffFile::Close::operator()(tiff* handle) const { TIFFClose(handle); }

TiffFile::TiffFile(std::string path, TiffInput input)
    : path_(std::move(path)), input_(std::make_unique<TiffInput>(std::move(input))), complaint_(std::make_unique<std::string>()) {
  TIFFOpenOptions* options = TIFFOpenOptionsAlloc();
  TIFFOpenOptionsSetErrorHandlerExtR(options, KeepFirst, complaint_.get());
  TIFFOpenOptionsSetWarningHandlerExtR(options, Ignore, nullptr);
  tiff_.reset(input_->OpenTiff(path_.c_str(), options));
  TIFFOpenOptionsFree(options);
  if (tiff_ == nullptr) return;
  // libjpeg makes RGB of it; what other codecs hold stays as it is.
  if (Field<std::uint16_t>(tiff_.get(), TIFFTAG_COMPRESSION, 0) == COMPRESSION_JPEG &&
      Field<std::uint16_t>(tiff_.get(), TIFFTAG_PHOTOMETRIC, 0) == PHOTOMETRIC_YCBCR) {
    (void)TIFFSetField(tiff_.get(), TIFFTAG_JPEGCOLORMODE, JPEGCOLORMODE_RGB);
  }
}
TiffFile::~TiffFile() = default;

Result<std::unique_ptr<TiffFile>> TiffFile::Open(const std::string& path, std::uint64_t directory) {
  Result<TiffInput> input = TiffInput::Open(path, directory);
  if (!input.ok()) return input.status();
  std::unique_ptr<TiffFile> file(new TiffFile(path, *std::move(input)));
  if (file->tiff_ != nullptr) return file;
  return directory != 0 ? file->Damaged() : file->Refused("not a TIFF volume");
}

Status TiffFile::Failed(StatusCode code, const std::string& why) const { return PictureFailure(code, path_, why, *complaint_); }
Status TiffFile::Damaged() const { return Failed(StatusCode::kDataLoss, "truncated or damaged"); }
Status TiffFile::Refused(const std::string& why) const { return Failed(StatusCode::kInvalidArgument, why); }

Result<std::vector<TiffPage>> TiffFile::ReadPages() {
  constexpr std::size_t kMostLevels = 64;  // more than halving any picture gives
  std::vector<TiffPage> pages;
  std::int64_t count = 0;
  do {
    const std::uint64_t offset = TIFFCurrentDirOffset(tiff_.get());
    // A smaller picture of the page before it.
    const bool reduced = (Field<std::uint32_t>(tiff_.get(), TIFFTAG_SUBFILETYPE, 0) & FILETYPE_REDUCEDIMAGE) != 0;
    if (reduced && !pages.empty()) {
      if (pages.back().smaller.size() < kMostLevels) pages.back().smaller.push_back(offset);
    } else {
      std::uint16_t smaller = 0;
      const std::uint64_t* offsets = nullptr;
      pages.push_back({.number = count, .offset = offset});
      if (TIFFGetField(tiff_.get(), TIFFTAG_SUBIFD, &smaller, &offsets) != 0) {
        pages.back().smaller.assign(offsets, offsets + std::min<std::size_t>(smaller, kMostLevels));
      }
    }
    ++count;
  } while (count <= kMaxVolumes && TIFFReadDirectory(tiff_.get()) != 0);
  if (!complaint_->empty()) return Failed(StatusCode::kDataLoss, "truncated or damaged after page " + std::to_string(count));
  return pages;
}

std::string TiffFile::Description() const { return Field<const char*>(tiff_.get(), TIFFTAG_IMAGEDESCRIPTION, ""); }
double TiffFile::XResolution() const { return double(Field<float>(tiff_.get(), TIFFTAG_XRESOLUTION, 0)); }
double TiffFile::YResolution() const { return double(Field<float>(tiff_.get(), TIFFTAG_YRESOLUTION, 0)); }
int TiffFile::ResolutionUnit() const {
  std::uint16_t unit = 0;
  return TIFFGetField(tiff_.get(), TIFFTAG_RESOLUTIONUNIT, &unit) != 0 ? unit : 0;
}
bool TiffFile::HoldsDirectory(std::uint64_t offset) const {
  const bool big = TIFFIsBigTIFF(tiff_.get()) != 0;
  const std::size_t place = big ? 8 : 4, counted = big ? 8 : 2, entry = big ? 20 : 12;
  std::array<std::byte, 8> bytes{};
  if (input_->ReadAt(offset, bytes.data(), counted) != counted) return false;
  std::uint64_t entries = 0;
  for (std::size_t i = 0; i < counted; ++i) {
    const std::size_t at = TIFFIsBigEndian(tiff_.get()) != 0 ? i : counted - 1 - i;
    entries = entries << 8 | std::uint64_t(bytes[at]);
  }
  return entries <= input_->size() / entry && offset + counted + entries * entry + place <= input_->size();
}
std::uint64_t TiffFile::size() const { return input_->size(); }
bool TiffFile::big_endian() const { return TIFFIsBigEndian(tiff_.get()) != 0; }
std::span<const std::byte> TiffFile::Bytes(unsigned tag) const { return Values<std::byte>(tiff_.get(), tag, TIFF_BYTE); }
std::span<const std::uint32_t> TiffFile::Numbers(unsigned tag) const { return Values<std::uint32_t>(tiff_.get(), tag, TIFF_LONG); }

Status TiffFile::CheckCompression() const {
  const auto compression = Field<std::uint16_t>(tiff_.get(), TIFFTAG_COMPRESSION, COMPRESSION_NONE);
  const unsigned bits = Bits();
  if (TIFFIsCODECConfigured(compression) == 0) {
    return Refused(fmt::format("its compression {} is not supported: libtiff lacks it here", Named(kCompressions, compression)));
  }
  if (compression == COMPRESSION_JPEG && bits != 8) return Refused(fmt::format("JPEG of {} bits is not supported, only of 8", bits));
  // Other codecs have none, and libtiff complains if it is asked.
  constexpr std::array kWithPredictor = {COMPRESSION_LZW, COMPRESSION_ADOBE_DEFLATE, COMPRESSION_DEFLATE, COMPRESSION_LZMA,
                                         COMPRESSION_ZSTD};
  if (std::ranges::count(kWithPredictor, int(compression)) == 0) return Status::Ok();
  const auto predictor = Field<std::uint16_t>(tiff_.get(), TIFFTAG_PREDICTOR, PREDICTOR_NONE);
  const bool floats = Field<std::uint16_t>(tiff_.get(), TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_UINT) == SAMPLEFORMAT_IEEEFP;
  const bool decoded = predictor == PREDICTOR_NONE || (predictor == PREDICTOR_HORIZONTAL && !IsPacked(bits)) ||
                       (predictor == PREDICTOR_FLOATINGPOINT && floats);
  return decoded ? Status::Ok() : Refused(fmt::format("predictor {} of samples of {} bits is not supported", predictor, bits));
}

Status TiffFile::CheckColours(int components, std::vector<std::string>& notes) {
  const auto colours = Field<std::uint16_t>(tiff_.get(), TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
  const auto is = [&](std::initializer_list<unsigned> kinds) { return std::ranges::count(kinds, colours) > 0; };
  const bool decoded =
      colours == PHOTOMETRIC_YCBCR && Field<std::uint16_t>(tiff_.get(), TIFFTAG_COMPRESSION, COMPRESSION_NONE) == COMPRESSION_JPEG;
  const bool values = is({PHOTOMETRIC_MINISBLACK, PHOTOMETRIC_MINISWHITE, PHOTOMETRIC_RGB, kLinearRaw}) ||
                      (components == 1 && is({PHOTOMETRIC_PALETTE, PHOTOMETRIC_MASK, PHOTOMETRIC_CFA}));
  if (!values && !decoded) {
    return Refused(fmt::format("a colour image of {} samples a pixel, kind {}, must be grey or RGB", components, Named(kColours, colours)));
  }
  if (colours == PHOTOMETRIC_PALETTE) notes.emplace_back("the colour map of the pages is not applied: values are its indices");
  if (colours == PHOTOMETRIC_MINISWHITE) notes.emplace_back("the pages ask to show 0 as white: values are not inverted");
  const auto orientation = Field<std::uint16_t>(tiff_.get(), TIFFTAG_ORIENTATION, ORIENTATION_TOPLEFT);
  if (orientation != ORIENTATION_TOPLEFT) notes.push_back(fmt::format("the Orientation of the pages, {}, is not applied", orientation));
  return Status::Ok();
}

Result<RawHeader> TiffFile::ReadHeader() {
  const auto samples = Field<std::uint16_t>(tiff_.get(), TIFFTAG_SAMPLESPERPIXEL, 1);
  if (samples < 1 || samples > kMaxComponents) {
    return Refused(fmt::format("{} samples a pixel, must be in [1, {}]", samples, kMaxComponents));
  }
  const auto depth = Field<std::uint32_t>(tiff_.get(), TIFFTAG_IMAGEDEPTH, 1);
  if (depth > 1)
    return Refused(fmt::format("ImageDepth is {}: several slices in a page are not supported, a page for each slice is", depth));
  RawHeader header{.components = samples};
  if (Status status = CheckCompression(); !status.ok()) return status;
  if (Status status = CheckColours(samples, header.notes); !status.ok()) return status;
  const unsigned bits = Bits(), format = Field<std::uint16_t>(tiff_.get(), TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_UINT);
  const std::optional<SampleType> type = ToSampleType(bits, format);
  if (!type) {
    constexpr NamedNumber kFormats[] = {{SAMPLEFORMAT_UINT, "unsigned"},
                                        {SAMPLEFORMAT_INT, "signed"},
                                        {SAMPLEFORMAT_IEEEFP, "float"},
                                        {SAMPLEFORMAT_VOID, "undefined"},
                                        {SAMPLEFORMAT_COMPLEXINT, "complex whole"},
                                        {SAMPLEFORMAT_COMPLEXIEEEFP, "complex float"}};
    return Refused(
        fmt::format("samples of {} bits and format {} are not supported, only unsigned ones of 1 to 16, 32 and 64 bits, signed "
                    "ones of 8, 16, 32 and 64 bits and floats of 16, 32 and 64 bits",
                    bits, Named(kFormats, format)));
  }
  header.type = *type;
  const auto width = Field<std::uint32_t>(tiff_.get(), TIFFTAG_IMAGEWIDTH, 0),
             height = Field<std::uint32_t>(tiff_.get(), TIFFTAG_IMAGELENGTH, 0);
  if (Status status = SetSize(header, path_, {double(width), double(height), 1}, {}); !status.ok()) return status;
  if (XResolution() > 0 && YResolution() > 0) header.steps[1].y = XResolution() / YResolution();
  return header;
}

}  // namespace slabstream
