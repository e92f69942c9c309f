#include "data/volume_io/read_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>

#include "common/mesh/lattice.h"
#include "common/text/parse_number.h"

namespace slabstream {
namespace {

Status Wrong(std::string_view option, std::string_view text, const std::string& must_be) {
  return Status::InvalidArgument(fmt::format("{} '{}' must be {}", option, text, must_be));
}

Status SetSeries(ReadOptions& options, std::string_view option, std::string_view text) {
  options.series = text;
  return text.empty() ? Wrong(option, text, "the number or the UID of a series") : Status::Ok();
}

Status SetTime(ReadOptions& options, std::string_view option, std::string_view text) {
  const Result<TimeRange> range = ParseTimeRange(option, text);
  if (!range.ok()) return range.status();
  options.time = *range;
  return Status::Ok();
}

Status SetChannel(ReadOptions& options, std::string_view option, std::string_view text) {
  constexpr int kMost = 65535;
  const bool mixed = IsMixedChannel(text);
  options.channel = text == "luminance" ? kLuminance : mixed ? kMagnitude : ParseNumber<int>(text);
  if (mixed || (options.channel && *options.channel >= 0 && *options.channel <= kMost)) return Status::Ok();
  return Wrong(option, text, fmt::format("luminance, magnitude or a whole number in [0, {}]", kMost));
}

// "X,Y,Z"
template <class T>
std::optional<Vector3<T>> ParseTriple(std::string_view text) {
  Vector3<T> triple;
  for (int i = 0; i < 3; ++i) {
    const std::size_t end = i < 2 ? text.find(',') : text.size();
    const std::optional<T> number = end == std::string_view::npos ? std::nullopt : ParseNumber<T>(text.substr(0, end));
    if (!number) return std::nullopt;
    triple[i] = *number;
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return triple;
}

Status SetDims(ReadOptions& options, std::string_view option, std::string_view text) {
  options.dims = ParseTriple<std::int32_t>(text);
  const auto in_range = [](std::int32_t side) { return side >= 1 && side <= kMaxVolumeSide; };
  if (options.dims && in_range(options.dims->x) && in_range(options.dims->y) && in_range(options.dims->z)) return Status::Ok();
  return Wrong(option, text, fmt::format("three whole numbers in [1, {}], such as 256,256,100", kMaxVolumeSide));
}

Status SetSpacing(ReadOptions& options, std::string_view option, std::string_view text) {
  options.spacing = ParseTriple<double>(text);
  const auto in_range = [](double spacing) { return spacing > 0 && std::isfinite(spacing); };
  if (options.spacing && in_range(options.spacing->x) && in_range(options.spacing->y) && in_range(options.spacing->z)) return Status::Ok();
  return Wrong(option, text, "three numbers above 0, such as 0.5,0.5,1.25");
}

Status SetMatrix(ReadOptions& options, std::string_view option, std::string_view text) {
  options.matrix = text;
  return text == "sform" || text == "qform" ? Status::Ok() : Wrong(option, text, "sform or qform");
}

Status SetType(ReadOptions& options, std::string_view option, std::string_view text) {
  options.type = SampleTypeNamed(text);
  return options.type ? Status::Ok() : Wrong(option, text, "one of " + SampleTypeNames());
}

Status SetEndian(ReadOptions& options, std::string_view option, std::string_view text) {
  options.big_endian = text == "big";
  return text == "big" || text == "little" ? Status::Ok() : Wrong(option, text, "little or big");
}

Status SetOffset(ReadOptions& options, std::string_view option, std::string_view text) {
  constexpr std::int64_t kMost = std::int64_t{1} << 60;
  options.offset = ParseNumber<std::int64_t>(text);
  if (options.offset && *options.offset >= 0 && *options.offset <= kMost) return Status::Ok();
  return Wrong(option, text, "a whole number of bytes, at least 0");
}

Status SetArray(ReadOptions& options, std::string_view option, std::string_view text) {
  options.array = text;
  return text.empty() ? Wrong(option, text, "the name of an array") : Status::Ok();
}

Status SetLattice(ReadOptions& options, std::string_view option, std::string_view text) {
  options.lattice = ParseNumber<std::int32_t>(text);
  if (options.lattice && *options.lattice >= 1 && *options.lattice <= kMaxLatticeSide) return Status::Ok();
  return Wrong(option, text, fmt::format("a whole number in [1, {}]", kMaxLatticeSide));
}

Status SetResample(ReadOptions& options, std::string_view option, std::string_view text) {
  options.resample = text == "even" ? 0 : ParseNumber<std::int32_t>(text);
  if (text == "even" || (options.resample && *options.resample >= 2 && *options.resample <= kMaxVolumeSide)) return Status::Ok();
  return Wrong(option, text, fmt::format("even or a whole number in [2, {}]", kMaxVolumeSide));
}

Status SetDataset(ReadOptions& options, std::string_view option, std::string_view text) {
  if (text.empty() || text.size() > kMaxDatasetBytes) {
    return Wrong(option, text.substr(0, 64), fmt::format("the path of a dataset in an HDF5 file, of 1 to {} bytes", kMaxDatasetBytes));
  }
  options.dataset = text;
  return Status::Ok();
}

template <bool ReadOptions::*kMember>
Status SetYes(ReadOptions& options, std::string_view option, std::string_view text) {
  options.*kMember = text == "yes" || text == "true";
  return options.*kMember || text == "no" || text == "false" ? Status::Ok() : Wrong(option, text, "yes or no");
}

Status SetHeader(ReadOptions& options, std::string_view option, std::string_view text) {
  // What a request for bytes has of its own.
  constexpr std::array<std::string_view, 7> kOurs = {"accept-encoding", "connection", "content-length",   "host",
                                                     "if-none-match",   "range",      "transfer-encoding"};
  const std::size_t colon = std::min(text.find(':'), text.size());
  std::string name(text.substr(0, colon));
  const auto in_name = [](unsigned char c) { return std::isalnum(c) != 0 || c == '-' || c == '_'; };
  const bool printable = std::ranges::none_of(text, [](unsigned char c) { return c < ' ' || c == 0x7F; });
  if (name.empty() || colon + 1 >= text.size() || !printable || !std::ranges::all_of(name, in_name)) {
    return Status::InvalidArgument(fmt::format("{} must be NAME:VALUE, or NAME:@FILE with the value in a file", option));
  }
  options.headers.emplace_back(text);
  std::ranges::transform(name, name.begin(), [](unsigned char c) { return char(std::tolower(c)); });
  if (std::ranges::find(kOurs, name) == kOurs.end()) return Status::Ok();
  return Status::InvalidArgument(fmt::format("{}: '{}' is a header that requests have of their own", option, name));
}

template <auto kMember>
bool IsGiven(const ReadOptions& options) {
  return options.*kMember != ReadOptions{}.*kMember;
}

}  // namespace

Result<TimeRange> ParseTimeRange(std::string_view option, std::string_view text) {
  const std::size_t colon = text.find(':');
  const auto parse = [&](std::string_view end) -> Result<int> {
    const std::optional<int> time = ParseNumber<int>(end);
    if (time && *time >= 0 && *time < kMaxVolumes) return *time;
    return Wrong(option, text, fmt::format("a whole number in [0, {}], or FIRST:LAST", kMaxVolumes - 1));
  };
  const Result<int> first = parse(text.substr(0, colon)), last = colon == std::string_view::npos ? first : parse(text.substr(colon + 1));
  if (!first.ok()) return first.status();
  if (!last.ok()) return last.status();
  if (*first <= *last) return TimeRange{*first, *last};
  return Status::InvalidArgument(fmt::format("{} '{}': FIRST must not be above LAST", option, text));
}

const std::vector<ReadOption>& ReadOptionList() {
  static const std::vector<ReadOption> options = {
      {"time", "T", "Which volume of a file with several, such as a time series; counted from 0", SetTime, IsGiven<&ReadOptions::time>},
      {"channel", "N|luminance|magnitude",
       "Which channel of an image (default: 0) or component of a voxel; or the luminance of red, green and blue, or the magnitude of a "
       "vector",
       SetChannel, IsGiven<&ReadOptions::channel>},
      {"matrix", "sform|qform", "Which matrix places a NIfTI volume that states both (default: the sform)", SetMatrix,
       IsGiven<&ReadOptions::matrix>},
      {"spacing", "X,Y,Z", "Voxel spacing, for files that state none: raw, NumPy, pictures", SetSpacing, IsGiven<&ReadOptions::spacing>},
      {"dims", "X,Y,Z", "Voxels along each axis of raw samples, the fastest axis first", SetDims, IsGiven<&ReadOptions::dims>},
      {"type", "TYPE", "Type of raw samples: uint8, int8, uint16, int16, uint32, int32, uint64, int64, float32, float64 or float16",
       SetType, IsGiven<&ReadOptions::type>},
      {"endian", "little|big", "Byte order of raw samples (default: little)", SetEndian, IsGiven<&ReadOptions::big_endian>},
      {"offset", "BYTES", "Bytes of the file before raw samples (default: 0)", SetOffset, IsGiven<&ReadOptions::offset>},
      {"series", "NUMBER|UID", "Which series of a DICOM folder, or which image of an OME-TIFF, from 0; `slabstream info` lists them",
       SetSeries, IsGiven<&ReadOptions::series>},
      {"array", "NAME", "Which array of a VTK file, or which array or group of a Zarr or N5 hierarchy", SetArray,
       IsGiven<&ReadOptions::array>},
      {"lattice", "VOXELS", "Voxels along the longest side of the lattice on which an unstructured grid is sampled", SetLattice,
       IsGiven<&ReadOptions::lattice>},
      {"resample", "even|VOXELS",
       "Puts a rectilinear grid on even voxels by linear interpolation, for all renderers: none longer than the shortest distance, or so "
       "many along each uneven axis",
       SetResample, IsGiven<&ReadOptions::resample>},
      {"dataset", "PATH", "Which dataset of an HDF5 file; without it, the error lists them", SetDataset, IsGiven<&ReadOptions::dataset>},
      {"follow-links", "", "Follow links that lead out of a folder of Zarr, N5 or precomputed, such as those of git-annex and DataLad",
       SetYes<&ReadOptions::follow_links>, IsGiven<&ReadOptions::follow_links>},
      {"ids", "", "Values are labels: names of structures, which are kept to the last digit and never mixed", SetYes<&ReadOptions::labels>,
       IsGiven<&ReadOptions::labels>, false, true},
      {"hollow", "", "Values are not read: there are labels alone", SetYes<&ReadOptions::hollow>, IsGiven<&ReadOptions::hollow>, false,
       true},
      {"header", "NAME:@FILE", "A header of each request to a web server, with its value in a file; may be given several times", SetHeader,
       IsGiven<&ReadOptions::headers>, true},
  };
  return options;
}

}  // namespace slabstream
