// HDF5 files: their metadata, which libhdf5 reads, and chunks with their filters; classic netCDF files.
//
// input: u8: the ending of the file, and whether a dataset is asked for; the file
#include "tests/data/hdf5/hdf5_files.h"
#include "tests/data/hdf5/netcdf_writer.h"
#include "tests/data/volume_io/volume_files.h"
#include "tests/fuzz/decoders.h"
#include "tests/fuzz/read_source.h"

namespace slabstream {
bool DecodeHdf5File(std::span<const std::byte> bytes) {
  FuzzInput input(bytes);
  const ReadOptions options{.dataset = input.Take<std::uint8_t>() % 2 == 1 ? "/data" : "", .describe = true};
  const std::string path = PathOfSource("volume.h5");
  WriteFile(path, FileBytes(input.Text()));
  return ReadSource(path, options);
}

std::vector<FuzzBytes> Hdf5FileSeeds() {
  std::vector<FuzzBytes> seeds;
  const std::string path = PathOfSource("seed.h5");
  std::vector<std::uint16_t> samples(6 * 7 * 8);
  for (std::size_t i = 0; i < samples.size(); ++i) samples[i] = std::uint16_t(i);
  const auto keep = [&](std::uint8_t kind) { seeds.push_back(FuzzSeed().Put(kind).Put(ReadFile(path)).bytes()); };
  for (const bool latest : {false, true}) {
    for (const bool chunked : {false, true}) {
      Hdf5Writer::Layout layout{.size = {6, 7, 8}, .big_endian = chunked};
      if (chunked) layout.chunk = {3, 4, 4};
      layout.filters = {.shuffle = chunked, .deflate = chunked, .fletcher32 = chunked};
      Hdf5Writer(path, latest).Write("/data", layout, samples.data());
      keep(latest ? 1 : 0);
    }
  }
  {
    Hdf5Writer writer(path);
    const std::string group = "/DataSet/ResolutionLevel 0/TimePoint 0/Channel 0";
    writer.Write(group + "/Data", {.size = {6, 7, 8}, .chunk = {3, 4, 4}}, samples.data());
    writer.Characters(group, "ImageSizeX", "7");
    writer.Characters(group, "ImageSizeY", "6");
    writer.Characters(group, "ImageSizeZ", "6");
    writer.Group("/DataSetInfo/Image");
  }
  keep(0);
  {
    Hdf5Writer writer(path);
    const std::vector<double> factors = {1, 1, 1};
    writer.Write("/s00/resolutions", {.size = {1, 3}, .type = SampleType::kFloat64}, factors.data());
    writer.Write("/t00000/s00/0/cells", {.size = {6, 7, 8}, .chunk = {3, 4, 4}, .type = SampleType::kInt16}, samples.data());
  }
  keep(0);
  const auto double_of = [](double number, std::size_t count) { return std::vector<double>(count, number); };
  {
    Hdf5Writer writer(path);
    writer.Write("/data", {.size = {6, 7, 8}, .chunk = {3, 4, 4}, .type = SampleType::kInt16}, samples.data());
    writer.Doubles("/z", {6}, {1, 2, 3, 4, 5, 6});
    writer.Text("/z", "units", "mm");
    writer.Scales("/data", {"/z", "", ""});
    writer.Texts("/data", "DIMENSION_LABELS", {"", "y", "x"});
    writer.Numbers("/data", "scale_factor", {0.5});
    writer.Numbers("/data", "_FillValue", {7});
  }
  keep(0);
  {
    Hdf5Writer writer(path);
    writer.Write("/data", {.size = {6, 7, 8}}, samples.data());
    writer.Text("/data", "axistags", R"({"axes": [{"key": "x"}, {"key": "y"}, {"key": "c"}]})");
    writer.Numbers("/data", "element_size_um", {1, 2});
  }
  keep(1);
  {
    Hdf5Writer writer(path);
    writer.Write("/ITKImage/0/VoxelData", {.size = {6, 7, 8}}, samples.data());
    writer.Doubles("/ITKImage/0/Spacing", {3}, double_of(2, 3));
    writer.Doubles("/ITKImage/0/Origin", {3}, double_of(1, 3));
    writer.Doubles("/ITKImage/0/Directions", {3, 3}, {1, 0, 0, 0, 1, 0, 0, 0, 1});
  }
  keep(0);
  {
    Hdf5Writer writer(path);
    writer.Write("/minc-2.0/image/0/image", {.size = {6, 7, 8}, .chunk = {3, 4, 4}}, samples.data());
    writer.Text("/minc-2.0/image/0/image", "dimorder", "zspace,yspace,xspace");
    writer.Doubles("/minc-2.0/image/0/image-min", {6}, double_of(0, 6));
    writer.Doubles("/minc-2.0/image/0/image-max", {6}, double_of(9, 6));
  }
  keep(0);
  {
    Hdf5Writer writer(path);
    writer.Group("/VTKHDF");
    writer.Text("/VTKHDF", "Type", "UnstructuredGrid");
    writer.Doubles("/VTKHDF/NumberOfPoints", {2}, {4, 5});
    writer.Doubles("/VTKHDF/NumberOfCells", {2}, {1, 2});
    writer.Doubles("/VTKHDF/NumberOfConnectivityIds", {2}, {4, 8});
    writer.Doubles("/VTKHDF/Points", {9, 3}, {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0.5, 0.5, 1});
    writer.Doubles("/VTKHDF/Types", {3}, {10, 10, 10});
    writer.Doubles("/VTKHDF/Offsets", {5}, {0, 4, 0, 4, 8});
    writer.Doubles("/VTKHDF/Connectivity", {12}, {0, 1, 2, 3, 0, 1, 3, 4, 1, 2, 3, 4});
    writer.Doubles("/VTKHDF/PointData/p", {9}, double_of(1, 9));
    writer.Doubles("/VTKHDF/CellData/vtkGhostType", {3}, {0, 0, 1});
    writer.Doubles("/VTKHDF/Steps/Values", {2}, {0, 1});
    for (const std::string name : {"PartOffsets", "PointOffsets", "CellOffsets", "ConnectivityIdOffsets"}) {
      writer.Doubles("/VTKHDF/Steps/" + name, {2}, {0, name == "PartOffsets" || name == "CellOffsets" ? 1.0 : 4.0});
    }
    writer.Doubles("/VTKHDF/Steps/NumberOfParts", {2}, {1, 1});
  }
  keep(0);
  {
    Hdf5Writer writer(path);
    writer.Group("/VTKHDF");
    writer.Text("/VTKHDF", "Type", "OverlappingAMR");
    writer.Numbers("/VTKHDF", "Origin", {0, 0, 0});
    for (const int level : {0, 1}) {
      const std::string group = "/VTKHDF/Level" + std::to_string(level);
      writer.Group(group);
      writer.Numbers(group, "Spacing", double_of(level == 0 ? 1 : 0.5, 3));
      writer.Doubles(group + "/AMRBox", {1, 6}, {0, 3, 0, 3, 0, level == 0 ? 3.0 : 1.0});
      writer.Doubles(group + "/CellData/v", {64}, double_of(level, 64));
    }
  }
  keep(0);
  {
    Hdf5Writer writer(path);
    writer.Doubles("/refine level", {3}, {1, 1, 2});
    writer.Doubles("/node type", {3}, {2, 1, 1});
    writer.Doubles("/bounding box", {3, 3, 2}, {0, 1, 0, 1, 0, 1, 1, 2, 0, 1, 0, 1, 0, 0.5, 0, 0.5, 0.5, 1});
    writer.Doubles("/dens", {3, 2, 2, 2}, double_of(1, 24));
  }
  keep(0);
  for (const int version : {1, 2, 5}) {
    NetcdfWriter writer{.version = version, .streaming = version == 2, .records = 6, .dimensions = {{"z", 0}, {"lat", 7}, {"x", 8}}};
    writer.variables.push_back({"lat", {1}, SampleType::kFloat32, {7, 6, 5, 4, 3, 2, 1}, {{"units", "degrees_north"}}});
    writer.variables.push_back({"z", {0}, SampleType::kFloat64, {1, 2, 3, 4, 5, 6}, {{"bounds", "z_bounds"}}});
    writer.variables.push_back(
        {"data", {0, 1, 2}, SampleType::kInt16, {samples.begin(), samples.end()}, {{"_FillValue", "", {7}, SampleType::kInt16}}});
    WriteFile(path, writer.Bytes());
    keep(version == 5 ? 1 : 0);
  }
  return seeds;
}

}  // namespace slabstream
