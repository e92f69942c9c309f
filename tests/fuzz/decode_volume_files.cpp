// Volume files of every format, read from a file, since that is what the readers take.
//
// input: u8 format (kEndings), the file
#include <algorithm>
#include <array>

#include "common/volume_io/volume_reader.h"
#include "tests/fuzz/decoders.h"
#include "tests/support/temporary_directory.h"
#include "tests/volume_io/volume_files.h"

namespace slabstream {
namespace {

constexpr std::array<const char*, 7> kEndings = {"nii", "nii.gz", "nrrd", "nhdr", "mha", "mhd", "tif"};

struct Files {
  TemporaryDirectory directory{PlaceOfFuzzFiles()};
  std::string Path(const std::string& ending) const { return directory / ("volume." + ending); }
};
const Files& SharedFiles() {
  static const Files files;
  return files;
}

FuzzBytes Seed(const char* ending, std::string_view file) {
  const auto format = std::find_if(kEndings.begin(), kEndings.end(), [&](std::string_view e) { return e == ending; }) - kEndings.begin();
  return FuzzSeed().Put(std::uint8_t(format)).Put(file).bytes();
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
  const std::string path = SharedFiles().Path(kEndings[input.Take<std::uint8_t>() % kEndings.size()]);
  WriteFile(path, FileBytes(input.Text()));
  const Result<LoadedVolume> loaded = ReadVolume(path);
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
  const auto once = Rewritten(volume, SharedFiles().Path("copy.nrrd"));
  CHECK(once->description.geometry.size == geometry.size);
  const auto twice = Rewritten(*once, SharedFiles().Path("copy.nrrd"));
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
    seeds.push_back(Seed("nii", nifti));
    seeds.push_back(Seed("nrrd", NrrdHeader(spec, "raw") + samples));
    seeds.push_back(Seed("mha", MetaHeader(spec, "LOCAL") + samples));
    if (type % 3 != 0) continue;
    seeds.push_back(Seed("nii.gz", Gzip(nifti)));
    seeds.push_back(Seed("nrrd", NrrdHeader(spec, "gzip") + Gzip(samples)));
    const FileBytes packed = Zlib(samples);
    seeds.push_back(Seed("mha", MetaHeader(spec, "LOCAL", std::int64_t(packed.size())) + packed));
  }
  spec.big_endian = false;
  const std::string path = SharedFiles().Path("seed.tif");
  for (const SampleType type : {SampleType::kUint8, SampleType::kInt16, SampleType::kFloat32}) {
    spec.type = type;
    const FileBytes samples = samples_of(spec);
    for (const TiffOptions& options :
         {TiffOptions{}, TiffOptions{.compression = 5}, TiffOptions{.compression = 8, .y_resolution = 50}, TiffOptions{.tile = 16}}) {
      WriteTiff(path, spec, samples, options);
      seeds.push_back(Seed("tif", ReadFile(path)));
    }
  }
  return seeds;
}

}  // namespace slabstream
