// Volume files of every format, read from a file, since that is what the readers take.
//
// input: u8 kind (Kinds()), u8 options (OptionsNumber), the file
#include <fmt/format.h>

#include <algorithm>

#include "data/open/read_volume.h"
#include "data/volume_io/formats.h"
#include "data/volume_io/volume_writer.h"
#include "tests/data/volume_io/more_files.h"
#include "tests/data/volume_io/tiff_files.h"
#include "tests/data/volume_io/volume_files.h"
#include "tests/data/volume_io/vtu_files.h"
#include "tests/fuzz/decoders.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

// The ending of a file, or of the pictures in a folder.
struct Kind {
  std::string ending;
  bool folder = false;
};

const std::vector<Kind>& Kinds() {
  static const std::vector<Kind> kinds = [] {
    std::vector<Kind> all = {{".png", true}, {".jpg", true}, {".bmp", true}, {".jp2", true}};
    for (const VolumeFormat& format : FileFormats()) {
      for (const std::string_view ending : format.endings) all.push_back({std::string(ending)});
    }
    return all;
  }();
  return kinds;
}

ReadOptions OptionsNumber(std::uint8_t number, const Kind& kind) {
  if (kind.ending == ".raw") return {.dims = Index3{3, 2, 2}, .type = SampleType(number % (int(SampleType::kFloat64) + 1)), .offset = 1};
  switch (number % 4) {
    case 1: return {.time = TimeRange{1, 1}};
    case 2: return {.channel = 0};
    case 3: return {.channel = kLuminance};
    default: return {};
  }
}

struct Files {
  Files() {
    for (const int x : {0, 3}) WriteFile(Path(fmt::format(".{}.vti", x)), VtiFile({}, FileBytes(24, 'x'), {.origin = {double(x), 0, 0}}));
  }

  TemporaryDirectory directory{PlaceOfFuzzFiles()};  // with two blocks of an image
  std::string Path(const std::string& ending) const { return directory / ("volume" + ending); }
};
const Files& SharedFiles() {
  static const Files files;
  return files;
}

// Where a volume of this file lies: a folder holds it twice.
std::string Written(const Kind& kind, const FileBytes& file) {
  const std::string path = SharedFiles().Path(kind.ending);
  if (!kind.folder) {
    WriteFile(path, file);
    return path;
  }
  std::filesystem::create_directories(path);
  for (const char* number : {"1", "2"}) WriteFile(path + "/" + number + kind.ending, file);
  return path;
}

FuzzBytes Seed(const std::string& ending, std::string_view file, std::uint8_t options = 0) {
  const auto kind = std::ranges::find(Kinds(), ending, &Kind::ending) - Kinds().begin();
  return FuzzSeed().Put(std::uint8_t(kind)).Put(options).Put(file).bytes();
}

bool SameSamples(const Volume& a, const Volume& b) {
  return a.description.type == b.description.type && a.description.geometry.size == b.description.geometry.size &&
         std::ranges::equal(a.block.bytes, b.block.bytes);
}

// Reads, writes and reads again.
std::shared_ptr<const Volume> Rewritten(const Volume& volume, const std::string& path) {
  const Status written = WriteVolume(volume, path);
  CHECK(written.ok()) << written.message();
  const Result<LoadedVolume> read = ReadVolume(path);
  CHECK(read.ok()) << read.status().message();
  return read->volume;
}

}  // namespace

bool DecodeVolumeFile(std::span<const std::byte> bytes) {
  FuzzInput input(bytes);
  const Kind& kind = Kinds()[input.Take<std::uint8_t>() % Kinds().size()];
  const ReadOptions options = OptionsNumber(input.Take<std::uint8_t>(), kind);
  const Result<LoadedVolume> loaded = ReadVolume(Written(kind, FileBytes(input.Text())), options);
  if (!loaded.ok()) {
    CheckRefusal(loaded.status());
    return false;
  }
  const Volume& volume = *loaded->volume;
  const VolumeGeometry& geometry = volume.description.geometry;
  for (const Axis axis : kAxes) {
    CHECK(geometry.size[axis] >= 1 && geometry.size[axis] <= kMaxVolumeSide);
    CHECK(geometry.spacing[axis] > 0 && std::isfinite(geometry.spacing[axis])) << geometry.spacing[axis];
  }
  CHECK_EQ(volume.block.bytes.size(), std::size_t(geometry.bounds().voxel_count()) * BytesPerSample(volume.description.type));

  // The first copy has the data values of formats that store others; from there on nothing changes.
  const auto once = Rewritten(volume, SharedFiles().Path(".copy.nrrd"));
  CHECK(once->description.geometry.size == geometry.size);
  const auto twice = Rewritten(*once, SharedFiles().Path(".copy.nrrd"));
  CHECK(SameSamples(*once, *twice));
  for (const Axis axis : kAxes) {  // oblique axes are rounded when they are written
    const double spacing = once->description.geometry.spacing[axis];
    CHECK(std::abs(twice->description.geometry.spacing[axis] - spacing) <= 1e-9 * spacing);
  }
  return true;
}

std::vector<FuzzBytes> VolumeFileSeeds() {
  std::vector<FuzzBytes> seeds;
  FileSpec spec;
  const auto samples_of = [](const FileSpec& of) {
    std::vector<double> values(std::size_t(of.size.x) * std::size_t(of.size.y) * std::size_t(of.size.z));
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = double(i % 100);
    return EncodeSamples(of.type, values, of.big_endian);
  };
  for (int type = 0; type <= int(SampleType::kFloat64); ++type) {
    spec.type = SampleType(type);
    spec.big_endian = type % 2 == 1;
    spec.qform = std::int16_t(type % 2);
    spec.sform = std::int16_t(type % 3);
    const FileBytes samples = samples_of(spec), nifti = NiftiHeader(spec) + samples;
    seeds.push_back(Seed(".nii", nifti));
    seeds.push_back(Seed(".nrrd", NrrdHeader(spec, "raw") + samples));
    seeds.push_back(Seed(".mha", MetaHeader(spec, "LOCAL") + samples));
    if (type % 3 != 0) continue;
    seeds.push_back(Seed(".nii.gz", Gzip(nifti)));
    seeds.push_back(Seed(".nrrd", NrrdHeader(spec, "gzip") + Gzip(samples)));
    const FileBytes packed = Zlib(samples);
    seeds.push_back(Seed(".mha", MetaHeader(spec, "LOCAL", std::int64_t(packed.size())) + packed));
  }
  for (const SampleFile& file : OneOfEachFormat()) seeds.push_back(Seed(file.file.substr(1), file.bytes));
  seeds.push_back(Seed(".raw", FileBytes(13, 'x'), std::uint8_t(SampleType::kUint8)));
  seeds.push_back(Seed(".nii", NiftiHeader({.dimensions = {4, 3, 2, 2}}) + FileBytes(48, 'x'), 1));
  seeds.push_back(Seed(".npy", NpyHeader("<f2", "(2, 3, 4)", true, 2) + FileBytes(48, 'x')));
  seeds.push_back(Seed(".vti", VtiFile({}, FileBytes(72, 'x'), {.block = 10, .components = 3}), 3));
  seeds.push_back(Seed(".vtm", VtkListFile("vtkMultiBlockDataSet", {"volume.0.vti", "volume.3.vti"})));
  spec.big_endian = false;
  const std::string path = SharedFiles().Path(".seed.tif");
  for (const SampleType type : {SampleType::kUint8, SampleType::kInt16, SampleType::kFloat32}) {
    spec.type = type;
    const FileBytes samples = samples_of(spec);
    for (const TiffOptions& options :
         {TiffOptions{}, TiffOptions{.compression = 5}, TiffOptions{.compression = 8, .y_resolution = 50}, TiffOptions{.tile = 16}}) {
      WriteTiff(path, spec, samples, options);
      seeds.push_back(Seed(".tif", ReadFile(path)));
    }
  }
  const std::string ome =
      "<OME><Image><Pixels SizeZ=\"2\" SizeC=\"1\" SizeT=\"1\" DimensionOrder=\"XYZCT\" PhysicalSizeX=\"2\" TimeIncrement=\"2\">"
      "<Channel Color=\"-1\"/></Pixels></Image></OME>";
  const std::string imagej = "ImageJ=1.54f\nimages=2\nslices=2\nspacing=2\nunit=um\ncf=0\nc0=1\nc1=2\nmin=3\nmax=4\n";
  for (const std::string& description : {ome, imagej, std::string("{\"shape\": [2, 3, 4], \"axes\": \"ZYX\"}")}) {
    WriteTiff(path, {}, FileBytes(24, 'x'), {.description = description});
    seeds.push_back(Seed(".tif", ReadFile(path)));
  }
  for (const bool big_endian : {false, true}) {
    const ImageJEntries looks = LooksOfImageJ(big_endian, {3, 4}, {{255, 0, 0}});
    seeds.push_back(Seed(".tif", OneDirectoryTiff({4, 3, 2}, 8, big_endian, imagej, FileBytes(24, 'x'), looks)));
  }
  seeds.push_back(Seed(".bmp", Bmp({4, 2, 1}, {.bits = 8, .palette = FileBytes(1024, 'x')}, FileBytes(8, 1))));
  seeds.push_back(Seed(".bmp", Bmp({1, 2, 1}, {.bits = 24}, FileBytes(8, 1)), 3));
  const std::string jp2 = SharedFiles().Path(".seed.jp2");
  WriteJpeg2000(jp2, {16, 16, 1}, 3, 10, true, std::vector<int>(std::size_t{3} * 16 * 16, -5));
  seeds.push_back(Seed(".jp2", ReadFile(jp2), 3));
  for (const int picture : {0, 2, 3}) {
    WritePng(path, {4, 4, 1}, picture == 0 ? 16 : 8, picture, FileBytes(picture == 0 ? 32 : picture == 2 ? 48 : 16, 1), picture == 2);
    seeds.push_back(Seed(".png", ReadFile(path), picture == 0 ? 0 : 3));
    WriteJpeg(path, {8, 8, 1}, picture == 0 ? 1 : 3, FileBytes(192, 100), picture == 3);
    seeds.push_back(Seed(".jpg", ReadFile(path), picture == 0 ? 0 : 3));
  }
  return seeds;
}

}  // namespace slabstream
