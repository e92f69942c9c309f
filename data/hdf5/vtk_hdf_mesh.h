// VTKHDF files that hold no image: unstructured grids, blocks of them, and adaptive meshes. Source:
// https://docs.vtk.org/en/latest/vtk_file_formats/vtkhdf_file_format/index.html
#pragma once

#include <memory>
#include <string>

#include "common/base/status.h"
#include "data/hdf5/hdf5_file.h"
#include "data/sources/read_context.h"
#include "data/sources/volume_source.h"
#include "data/volume_io/mesh_reader.h"
#include "data/volume_io/raw_volume.h"

namespace slabstream {

// "UnstructuredGrid"; "": it is no VTKHDF file.
std::string VtkHdfType(AttributedFile& file);

// The times of a file (Steps), and the number of the one that the options take. Errors of ChosenVolume and SmallDataset.
struct VtkHdfTime {
  TimeAxis times = TimeAxis();  // one, if the file has no Steps
  std::int64_t number = 0;
};
Result<VtkHdfTime> ChooseVtkHdfTime(AttributedFile& file, const ReadOptions& options);

// The arrays of points or of cells in a block or a level ("/VTKHDF/Level0"). Errors of AttributedFile::Names.
Result<std::vector<GridArray>> VtkHdfArrays(AttributedFile& file, const std::string& block, ValuesAt at);

// A file of type UnstructuredGrid, or MultiBlockDataSet or PartitionedDataSetCollection, whose blocks of such grids become one.
bool IsVtkHdfGrid(const std::string& type);
// The grid and its times. options.dataset names the array: "p", or "VTKHDF/PointData/p". Errors of ReadMesh (mesh_reader.h). Waits.
Result<RawVolume> ReadVtkHdfGrid(const std::shared_ptr<Hdf5File>& file, const ReadOptions& options);

// A file of type OverlappingAMR. options.dataset names the array as above. Errors of VolumeFormat::open.
inline constexpr std::string_view kVtkHdfAmr = "OverlappingAMR";
Result<std::shared_ptr<VolumeSource>> OpenVtkHdfAmr(const std::shared_ptr<Hdf5File>& file, const ReadOptions& options,
                                                    const SourceContext& context);

// Of "VTKHDF/PointData/p" or "p": "p".
std::string VtkHdfArrayName(const std::string& dataset);

}  // namespace slabstream
