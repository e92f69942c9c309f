// What a file of HDF5 or classic netCDF says of a dataset that is one image: what its axes are, where its voxels lie and what its samples
// stand for. Each layout reads this from its own groups and attributes; what follows from it is the same for all (hdf5_image.cpp, which has
// the only list).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/math/vec.h"
#include "common/volume/orientation.h"
#include "data/hdf5/attributed_file.h"
#include "data/sources/chunked_source.h"
#include "data/sources/mapped_array.h"
#include "data/sources/read_context.h"
#include "data/volume_io/read_options.h"
#include "data/volume_io/sample_type.h"

namespace slabstream {

struct ImageAxis {
  std::string name = {};                // as AxisNamed knows them ("z"), or any other; "": it has none
  double step = 1, start = 0;           // for x, y, z and time: voxel i lies at start + i * step along `direction`, in `unit`
  std::optional<Vec3> direction = {};   // in the world; none: that of the world's axis of this name
  std::optional<LengthUnit> unit = {};  // if the file states one that is known
  std::string time_unit = {};           // of the step of an axis of time, as the file spells it
  // Where its coordinates are not even: all of them, in `unit`, which then do not place it (step, start) unless it is resampled.
  std::vector<double> uneven = {};
  std::string uneven_named = {};  // "depth (m)"
};

struct ImageDescription {
  std::string format = {};
  std::vector<ImageAxis> axes = {};  // the dataset's axes, the slowest first
  std::string axes_from = {};        // what names them, for a note: "axistags"; "": nothing does, so their order decides
  World world = World::kVoxels;      // kVoxels: only lengths are known
  Vec3 origin = {};
  // What the samples are.
  std::optional<SampleType> type = {};  // another type of as many bytes than the dataset's
  ElementMeaning meaning = {};
  bool labels = false;
  std::vector<std::string> notes = {};
};

// The elements that a type of whole numbers can hold; nullopt: it is another type.
struct Limits {
  double least = 0, most = 0;
};
std::optional<Limits> WholeNumbers(SampleType type);
// Whole numbers of the same bytes with or without a sign; nullopt: it is another type.
std::optional<SampleType> WithSign(SampleType type, bool has_sign);

struct ImageLayout {
  // Paths of the images in a file of the layout. Empty: it is of another one. InvalidArgument: it is of this one, but of a kind that is not
  // supported.
  Result<std::vector<std::string>> (*images)(AttributedFile& file) = nullptr;
  // nullopt: the dataset does not belong to the layout. InvalidArgument, DataLoss: what the file says of it is wrong.
  Result<std::optional<ImageDescription>> (*describe)(AttributedFile& file, const DatasetFacts& dataset) = nullptr;
};

ImageLayout ItkImage();
ImageLayout Minc();
ImageLayout VtkHdf();
ImageLayout Nexus();
ImageLayout OpenPmdMesh();

// By the attributes of the dataset and its dimension scales alone: axistags, netCDF-4 with the conventions of CF, labels of dimensions,
// element_size_um and others. `scales`: for each axis the path of a dataset with its coordinates, "" where there is none; empty: the
// dimension scales that the dataset has.
Result<ImageDescription> DescribeByAttributes(AttributedFile& file, const DatasetFacts& dataset, std::vector<std::string> scales = {});

// The type and the meaning of samples by the conventions of CF: scale_factor, add_offset, _FillValue, missing_value, valid_range,
// _Unsigned. What of them applies is noted.
void DescribeValues(AttributedFile& file, const DatasetFacts& dataset, ImageDescription& image);

// A dataset of a file as a source: the one that `options` names, else the only image. Errors of VolumeFormat::open.
Result<Pyramid> ReadImage(AttributedFile& file, const ReadOptions& options, const SourceContext& context);

// openPMD, whose iterations are times. options.dataset: the name of a mesh; "": the only one. Errors of VolumeFormat::open.
bool IsOpenPmd(AttributedFile& file);
Result<Pyramid> ReadOpenPmd(AttributedFile& file, const ReadOptions& options, const SourceContext& context);

}  // namespace slabstream
