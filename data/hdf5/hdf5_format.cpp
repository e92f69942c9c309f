#include "data/hdf5/hdf5_format.h"

#include <filesystem>
#include <fstream>
#include <set>
#include <string_view>
#include <utility>

#include "data/hdf5/classic_netcdf.h"
#include "data/hdf5/hdf5_image.h"
#include "data/hdf5/hdf5_layouts.h"
#include "data/hdf5/vtk_hdf_mesh.h"
#include "data/positional/file_source.h"

namespace slabstream {
namespace {

bool BeginsWith(const std::string& path, std::string_view signature) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return false;
  std::string first(signature.size(), '\0');
  return std::ifstream(path, std::ios::binary).read(first.data(), std::streamsize(first.size())) && first == signature;
}

bool IsClassicNetcdf(const std::string& path) { return BeginsWith(path, "CDF"); }

bool Recognises(const std::string& path, const ReadOptions&) { return BeginsWith(path, "\x89HDF\r\n\x1a\n") || IsClassicNetcdf(path); }

// As one image, at one level or several.
Result<Pyramid> ReadPyramid(const std::shared_ptr<Hdf5File>& file, const ReadOptions& options, const SourceContext& context) {
  for (const Hdf5Layout& layout : {Imaris(), BigDataViewerHdf5()}) {
    if (options.dataset.empty() && layout.recognises(*file)) return layout.read(file, options, context);
  }
  // A path names a dataset of any file, and a bare name a mesh of openPMD.
  if (options.dataset.find('/') == std::string::npos && IsOpenPmd(*file)) return ReadOpenPmd(*file, options, context);
  return ReadImage(*file, options, context);
}

Result<std::shared_ptr<VolumeSource>> OpenPyramid(const std::string& path, Result<Pyramid> pyramid, const SourceContext& context) {
  return pyramid.ok() ? MakeChunkedSource(path, *std::move(pyramid), context) : pyramid.status();
}

Result<RawVolume> ReadGrid(const std::string& path, const ReadOptions& options) {
  const Result<std::shared_ptr<Hdf5File>> file = Hdf5File::Open(path);
  return file.ok() ? ReadVtkHdfGrid(*file, options) : file.status();
}

Result<std::shared_ptr<VolumeSource>> Open(const std::string& path, const ReadOptions& options, const SourceContext& context) {
  if (IsClassicNetcdf(path)) {
    const Result<std::unique_ptr<AttributedFile>> file = OpenClassicNetcdf(path);
    return file.ok() ? OpenPyramid(path, ReadImage(**file, options, context), context) : file.status();
  }
  const Result<std::shared_ptr<Hdf5File>> file = Hdf5File::Open(path);
  if (!file.ok()) return file.status();
  const std::string type = VtkHdfType(**file);
  static const VolumeFormat kGrid = {.name = "VTKHDF", .endings = {}, .read = ReadGrid};
  if (IsVtkHdfGrid(type)) return OpenFile(kGrid, path, options, context);
  if (options.lattice) return Status::InvalidArgument(path + ": holds voxels, so it takes no option lattice");
  if (type == kVtkHdfAmr) return OpenVtkHdfAmr(*file, options, context);
  if (options.dataset.find('/') == std::string::npos && IsFlash(**file)) return OpenFlash(*file, options, context);
  return OpenPyramid(path, ReadPyramid(*file, options, context), context);
}

}  // namespace

int CountNumbered(const std::vector<std::string>& names, const std::string& prefix) {
  const std::set<std::string_view> known(names.begin(), names.end());
  int count = 0;
  while (known.contains(prefix + std::to_string(count))) ++count;
  return count;
}

VolumeFormat Hdf5() {
  return {.name = "HDF5",
          .endings = {".ims", ".h5", ".hdf5", ".he5", ".nc", ".nc4", ".mnc"},
          .recognises = Recognises,
          .options = {"time", "channel", "dataset", "lattice", "resample"},
          .open = Open};
}

}  // namespace slabstream
