// XDMF files, beside an HDF5 file and a binary one.
//
// input: the file
#include "tests/data/hdf5/hdf5_files.h"
#include "tests/data/volume_io/volume_files.h"
#include "tests/fuzz/decoders.h"
#include "tests/fuzz/read_source.h"

namespace slabstream {
namespace {

void WriteFilesBeside() {
  static const bool written = [] {
    std::vector<float> samples(2 * 3 * 4);
    for (std::size_t i = 0; i < samples.size(); ++i) samples[i] = float(i);
    Hdf5Writer file(PathOfSource("beside.h5"));
    file.Write("/p", {.size = {2, 3, 4}, .type = SampleType::kFloat32}, samples.data());
    file.Write("/q", {.size = {2, 2, 3, 4}, .chunk = {1, 2, 2, 2}, .type = SampleType::kInt16, .fill = std::vector<std::byte>(2)},
               samples.data());
    file.Doubles("/x", {4}, {0, 1, 2, 3});
    file.Doubles("/points", {5, 3}, {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0.5, 0.5, 1});
    file.Doubles("/cells", {2, 4}, {0, 1, 3, 4, 1, 2, 3, 4});
    WriteFile(PathOfSource("beside.raw"), FileBytes(100, 'a'));
    return true;
  }();
  CHECK(written);
}

}  // namespace

bool DecodeXdmfFile(std::span<const std::byte> bytes) {
  WriteFilesBeside();
  const std::string path = PathOfSource("grids.xmf");
  WriteFile(path, FileBytes(FuzzInput(bytes).Text()));
  return ReadSource(path, {.describe = true});
}

std::vector<FuzzBytes> XdmfFileSeeds() {
  const std::string even =
      "<Topology TopologyType='3DCoRectMesh' Dimensions='2 3 4'/><Geometry GeometryType='ORIGIN_DXDYDZ'>"
      "<DataItem Dimensions='3'>0 0 0</DataItem><DataItem>2 1 -1</DataItem></Geometry>";
  const std::string points = "<Attribute Name='p'><DataItem Dimensions='2 3 4' Format='HDF'>beside.h5:/p</DataItem></Attribute>";
  const std::string grid = "<Grid>" + even + points + "</Grid>";
  const std::string mesh =
      "<Topology TopologyType='Mixed' NumberOfElements='3'><DataItem Dimensions='14'>6 0 1 3 4 4 1 2 3 6 1 2 3 4</DataItem></Topology>"
      "<Geometry GeometryType='XYZ'><DataItem Dimensions='5 3'>0 0 0 1 0 0 1 1 0 0 1 0 .5 .5 1</DataItem></Geometry>";
  const std::string values = "<Attribute Name='p'><DataItem Dimensions='5'>0 1 2 3 4</DataItem></Attribute>";
  const std::string inside[] = {
      "<Grid>" + mesh + values +
          "<Attribute Name='vtkGhostType' Center='Cell'><DataItem Dimensions='3'>0 0 1</DataItem></Attribute></Grid>",
      "<Grid Name='m'>" + mesh + "</Grid><Grid GridType='Collection' CollectionType='Temporal'><Grid><xi:include " +
          "xmlns:xi='http://www.w3.org/2001/XInclude' xpointer='xpointer(//Grid[1]/*[self::Topology or self::Geometry])'/>" + values +
          "</Grid></Grid>",
      "<Grid><Topology TopologyType='Tetrahedron' NumberOfElements='2'><DataItem Dimensions='2 4' Format='HDF'>beside.h5:/cells</DataItem>"
      "</Topology><Geometry><DataItem Dimensions='5 3' Format='HDF'>beside.h5:/points</DataItem></Geometry><Attribute Name='c' "
      "Center='Cell'><DataItem ItemType='HyperSlab'><DataItem>0 1 1 1 2 1</DataItem><DataItem Dimensions='2 4' "
      "Format='HDF'>beside.h5:/cells</DataItem></DataItem></Attribute></Grid>",
      "<Grid><Topology TopologyType='3DSMesh' Dimensions='2 2 2'/><Geometry GeometryType='X_Y_Z'><DataItem>0 1 0 1 0 1 0 1</DataItem>"
      "<DataItem>0 0 1 1 0 0 1 1</DataItem><DataItem>0 0 0 0 1 1 1 2</DataItem></Geometry><Attribute Name='p'><DataItem "
      "Dimensions='2 2 2'>0 1 2 3 4 5 6 7</DataItem></Attribute></Grid>",
      grid,
      "<Grid GridType='Uniform'><Topology Type='3DRectMesh' Dimensions='2 3 4'/><Geometry Type='VXVYVZ'><DataItem Dimensions='4' "
      "Format='HDF'>beside.h5:/x</DataItem><DataItem>0 2 4</DataItem><DataItem>9 8</DataItem></Geometry>" +
          points + "</Grid>",
      "<Grid>" + even +
          "<Attribute Name='c' Center='Cell'><DataItem ItemType='HyperSlab'><DataItem>1 0 1 0 1 1 1 1 1 1 2 3</DataItem><DataItem "
          "Dimensions='2 2 3 4' Format='HDF'>beside.h5:/q</DataItem></DataItem></Attribute></Grid>",
      "<Grid>" + even +
          "<Attribute Name='v'><DataItem Dimensions='2 3 4 2' Format='Binary' Endian='Big' Seek='3' NumberType='UInt' "
          "Precision='2'>beside.raw</DataItem></Attribute></Grid>",
      "<Grid Name='t' GridType='Collection' CollectionType='Temporal'><Time TimeType='List'><DataItem>0 2</DataItem></Time>" + grid + grid +
          "</Grid>",
      "<Grid GridType='Tree'><Grid GridType='Collection' CollectionType='Spatial'>" + grid + "</Grid><Grid GridType='Collection'>" + grid +
          "</Grid></Grid>",
      "<DataItem Name='i' Dimensions='2 3 4' Format='HDF'>beside.h5:/p</DataItem><Grid GridType='Collection'><Grid Name='a'>" + even +
          "<Attribute Name='p'><DataItem Reference='XML'>/Xdmf/Domain/DataItem[@Name='i']</DataItem></Attribute></Grid><Grid "
          "Reference=\"//Grid[@Name='a'][1]\"/></Grid>",
      "<Grid>" + even +
          "<Attribute Name='p'><DataItem Dimensions='2 3 4'>0 1 2 3 4 5 6 7 8 9 0 1 2 3 4 5 6 7 8 9 0 1 2 3</DataItem></Attribute></Grid>",
  };
  std::vector<FuzzBytes> seeds;
  for (const std::string& each : inside)
    seeds.push_back(SeedOf("<!DOCTYPE Xdmf SYSTEM 'Xdmf.dtd' []>\n<Xdmf><Domain>" + each + "</Domain></Xdmf>"));
  return seeds;
}

}  // namespace slabstream
