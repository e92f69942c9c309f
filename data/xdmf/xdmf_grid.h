// A grid of an XDMF file as a volume: where its voxels lie, and the attribute that they show.
#pragma once

#include <string>
#include <vector>

#include "common/base/status.h"
#include "data/volume_io/grid_arrays.h"
#include "data/volume_io/raw_volume.h"
#include "data/xdmf/xdmf_document.h"
#include "data/xdmf/xdmf_item.h"

namespace slabstream {

struct XdmfGrid {
  std::string named;  // "a.xmf: Grid 'g'"
  RawHeader header;   // its steps lie along x, y and z; its type is what the XML says, which HDF5 files may not have
  std::string array;  // the name of the attribute, and where its values belong
  ValuesAt at = ValuesAt::kPoints;
  XdmfItem item;                   // its samples
  std::vector<std::string> files;  // where they and the coordinates are, other than the XDMF file
};

// Of a grid of GridType Uniform. Sources of what numbers mean: https://www.xdmf.org/index.php/XDMF_Model_and_Format; that origin and
// spacing stand in the order z, y, x, as dimensions do: VTK's vtkXdmfHeavyData.cxx and VisIt's manual (Data into VisIt, Xdmf). `like`: the
// grid whose attribute is taken, if any; else the options choose one (ChooseArray). InvalidArgument: another topology or geometry,
// coordinates as of GridOfCoordinates, no such attribute; errors of ParseXdmfItem and XdmfArrays::ReadNumbers. Messages name grid or item.
// Waits.
Result<XdmfGrid> ReadXdmfGrid(XdmfDocument& document, const XdmfElement& element, const ReadOptions& options, XdmfArrays& arrays,
                              const XdmfGrid* like = nullptr);

}  // namespace slabstream
