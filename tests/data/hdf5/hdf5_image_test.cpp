// Files whose groups and attributes say what a dataset's axes are, where its voxels lie and what its samples stand for. The value of each
// element tells where in the dataset it lies; each layout's own formula tells where in the world that is.
#include "data/hdf5/hdf5_image.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <utility>

#include "data/open/open_source.h"
#include "tests/data/hdf5/hdf5_files.h"
#include "tests/data/sources/opened_source.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

using testing::Contains;

class Hdf5ImageTest : public testing::Test {
 protected:
  std::shared_ptr<VolumeSource> Open(const ReadOptions& options = {}) { return Opened(OpenSource(path_, options, context_)); }
  void ExpectRefused(const std::string& why, const ReadOptions& options = {}) { ExpectRefusal(OpenSource(path_, options, context_), why); }

  TemporaryDirectory directory_;
  std::string path_ = directory_ / "image.h5";
  SourceContext context_ = TestReadContext();
};

std::vector<std::int16_t> Ascending(std::size_t count) {
  std::vector<std::int16_t> samples(count);
  for (std::size_t i = 0; i < count; ++i) samples[i] = std::int16_t(i);
  return samples;
}

// The data value of the voxel at a place of the world, NaN outside.
double ValueAt(VolumeSource& source, const Vec3& place) {
  const VolumeDescription& description = source.info().levels[0].description;
  const VolumeGeometry& geometry = description.geometry;
  const Vec3 away = geometry.orientation.FromWorld(place - geometry.orientation.origin);
  Box voxel;
  for (int axis = 0; axis < 3; ++axis) {
    voxel.begin[axis] = int(std::lround(away[axis] / geometry.spacing[axis]));
    voxel.end[axis] = voxel.begin[axis] + 1;
    EXPECT_NEAR(away[axis], voxel.begin[axis] * geometry.spacing[axis], 1e-6) << "no centre of a voxel";
  }
  if (!geometry.bounds().Contains(voxel)) return std::nan("");
  const AlignedVector<std::byte> bytes = ReadBox(source, 0, voxel);
  return VisitScalarType(description.type, [&](const auto* null) {
    std::remove_cvref_t<decltype(*null)> sample;
    std::memcpy(&sample, bytes.data(), sizeof sample);
    return description.mapping.FromStored(sample);
  });
}

// The dataset "/data" of 2 x 3 x 4 x 5 samples, axes named a letter each, read at time and channel 1.
TEST_F(Hdf5ImageTest, AxistagsAndLabelsNameTheAxesInAnyOrder) {
  const std::array<hsize_t, 4> size = {2, 3, 4, 5};
  const std::vector<std::int16_t> samples = Ascending(2 * 3 * 4 * 5);
  for (const std::string names : {"zyxc", "czyx", "xyzc", "tzyx", "yxct", "cxyz"}) {
    for (const bool tags : {true, false}) {
      SCOPED_TRACE(names);
      {
        Hdf5Writer writer(path_);
        writer.Write("/data", {.size = {2, 3, 4, 5}, .chunk = {1, 2, 2, 3}, .type = SampleType::kInt16}, samples.data());
        std::string json;
        std::vector<std::string> labels;
        for (const char name : names) {
          json += fmt::format("{}{{\"key\": \"{}\", \"typeFlags\": 2, \"resolution\": 0}}", json.empty() ? "" : ", ", name);
          labels.emplace_back(1, name);
        }
        if (tags) writer.Text("/data", "axistags", "{\"axes\": [" + json + "]}");
        if (!tags) writer.Texts("/data", "DIMENSION_LABELS", labels);
      }
      ReadOptions options;
      const bool times = names.find('t') != std::string::npos, channels = names.find('c') != std::string::npos;
      if (times) options.time = TimeRange{1, 1};
      if (channels) options.channel = 1;
      const auto source =
          names == "tzyx" || names == "cxyz" ? Open({.describe = true})->At(times ? 1 : 0, channels ? 1 : 0) : Open(options);
      const Index3& voxels = source->info().levels[0].description.geometry.size;
      for (Index3 v; v.z < voxels.z; ++v.z) {
        for (v.y = 0; v.y < voxels.y; ++v.y) {
          for (v.x = 0; v.x < voxels.x; ++v.x) {
            int number = 0;
            for (std::size_t axis = 0; axis < 4; ++axis) {
              const std::size_t along = std::string("xyz").find(names[axis]);
              number = number * int(size[axis]) + (along == std::string::npos ? 1 : v[int(along)]);
            }
            ASSERT_EQ(ValueAt(*source, {double(v.x), double(v.y), double(v.z)}), number);
          }
        }
      }
    }
  }
  EXPECT_THAT(Open({.describe = true})->info().notes, Contains(HasSubstr("axes of the dataset: channel, x, y, z (by labels")));
}

TEST_F(Hdf5ImageTest, AxistagsThatDoNotFitAreRefused) {
  const std::vector<std::int16_t> samples = Ascending(24);
  for (const auto& [tags, why] : {std::pair(R"({"axes": [{"key": "z"}]})", "a list of 3 axes"), {"{", "not JSON"}}) {
    Hdf5Writer writer(path_);
    writer.Write("/data", {.size = {2, 3, 4}, .type = SampleType::kInt16}, samples.data());
    writer.Text("/data", "axistags", tags);
  }
  ExpectRefused("dataset '/data': axistags");
}

TEST_F(Hdf5ImageTest, ItkImagesLieWhereTheirDirectionsSay) {
  const std::vector<std::int16_t> samples = Ascending(2 * 3 * 4);
  // A turn by 30 degrees about z, with y running down. Row i is the direction of axis i.
  const double c = std::cos(0.5235987755982988), s = 0.5;
  {
    Hdf5Writer writer(path_);
    writer.Write("/ITKImage/0/VoxelData", {.size = {2, 3, 4}, .chunk = {2, 2, 2}, .type = SampleType::kInt16}, samples.data());
    writer.Doubles("/ITKImage/0/Spacing", {3}, {1, 2, 3});
    writer.Doubles("/ITKImage/0/Origin", {3}, {10, 20, 30});
    writer.Doubles("/ITKImage/0/Directions", {3, 3}, {c, s, 0, s, -c, 0, 0, 0, 1});
  }
  const auto source = Open();
  EXPECT_EQ(source->info().format, "ITK HDF5");
  EXPECT_EQ(source->info().levels[0].description.geometry.orientation.world, World::kPatient);
  for (int z = 0; z < 2; ++z) {
    for (int y = 0; y < 3; ++y) {
      for (int x = 0; x < 4; ++x) {
        const Vec3 lps = Vec3{10, 20, 30} + Vec3{x * c + 2 * y * s, x * s - 2 * y * c, 3.0 * z};
        ASSERT_EQ(ValueAt(*source, {-lps.x, -lps.y, lps.z}), x + 4 * (y + 3 * z));
      }
    }
  }
}

TEST_F(Hdf5ImageTest, AxesThatAreNotAtRightAnglesAreRefused) {
  const std::vector<std::int16_t> samples = Ascending(24);
  {
    Hdf5Writer writer(path_);
    writer.Write("/ITKImage/0/VoxelData", {.size = {2, 3, 4}, .type = SampleType::kInt16}, samples.data());
    writer.Doubles("/ITKImage/0/Spacing", {3}, {1, 2, 3});
    writer.Doubles("/ITKImage/0/Origin", {3}, {0, 0, 0});
    writer.Doubles("/ITKImage/0/Directions", {3, 3}, {1, 0, 0, 0.6, 0.8, 0, 0, 0, 1});
  }
  ExpectRefused("has axes that are not at right angles");
}

TEST_F(Hdf5ImageTest, MincVolumesAreScaledSliceBySlice) {
  const std::vector<std::int16_t> samples = Ascending(3 * 2 * 4);
  {
    Hdf5Writer writer(path_);
    const std::string image = "/minc-2.0/image/0/image";
    writer.Write(image, {.size = {3, 2, 4}, .chunk = {2, 2, 2}, .type = SampleType::kInt16}, samples.data());
    writer.Text(image, "dimorder", "yspace,zspace,xspace");
    writer.Numbers(image, "valid_range", {0, 20});
    writer.Doubles("/minc-2.0/image/0/image-min", {3}, {0, 100, 200});
    writer.Doubles("/minc-2.0/image/0/image-max", {3}, {20, 140, 260});
    for (const auto& [name, step, start, cosines] :
         {std::tuple("xspace", -2.0, 5.0, std::vector<double>{1, 0, 0}), std::tuple("yspace", 3.0, -4.0, std::vector<double>{0, 0.8, 0.6}),
          std::tuple("zspace", 1.5, 7.0, std::vector<double>{0, -0.6, 0.8})}) {
      const std::string dimension = std::string("/minc-2.0/dimensions/") + name;
      writer.Doubles(dimension, {1}, {0});
      writer.Numbers(dimension, "step", {step});
      writer.Numbers(dimension, "start", {start});
      writer.Numbers(dimension, "direction_cosines", cosines);
    }
  }
  const auto source = Open();
  EXPECT_EQ(source->info().format, "MINC 2");
  EXPECT_EQ(source->info().file_type, "int16");
  for (int y = 0; y < 3; ++y) {
    for (int z = 0; z < 2; ++z) {
      for (int x = 0; x < 4; ++x) {
        const Vec3 along = {5 - 2.0 * x, -4 + 3.0 * y, 7 + 1.5 * z};
        const Vec3 place = {along.x, 0.8 * along.y - 0.6 * along.z, 0.6 * along.y + 0.8 * along.z};
        const double sample = std::min(20, x + 4 * (z + 2 * y));  // those above the valid range are taken for its end
        ASSERT_FLOAT_EQ(float(ValueAt(*source, place)), float(100 * y + sample * (y + 1)));
      }
    }
  }
}

TEST_F(Hdf5ImageTest, VtkHdfCellsLieInTheirCentres) {
  const std::vector<std::int16_t> samples = Ascending(2 * 3 * 4);
  const auto write = [&](const std::string& type, const std::string& group, const std::vector<double>& extent) {
    Hdf5Writer writer(path_);
    writer.Write(group + "/density", {.size = {2, 3, 4}, .type = SampleType::kInt16}, samples.data());
    writer.Text("/VTKHDF", "Type", type);
    writer.Numbers("/VTKHDF", "WholeExtent", extent);
    writer.Numbers("/VTKHDF", "Origin", {10, 20, 30});
    writer.Numbers("/VTKHDF", "Spacing", {1, 2, 3});
    writer.Numbers("/VTKHDF", "Direction", {0, -1, 0, 1, 0, 0, 0, 0, 1});
  };
  write("ImageData", "/VTKHDF/PointData", {2, 5, 0, 2, 1, 2});
  EXPECT_EQ(ValueAt(*Open(), {10 - 2.0 * 2, 20 + 2.0 + 3, 30 + 3.0 + 3}), 3 + 4 * (2 + 3 * 1));
  write("ImageData", "/VTKHDF/CellData", {2, 6, 0, 3, 1, 3});
  EXPECT_EQ(ValueAt(*Open(), {10 - 2 * 2.5, 20 + 2.0 + 3.5, 30 + 3 * 2.5}), 3 + 4 * (2 + 3 * 1));
  EXPECT_EQ(Open()->info().levels[0].description.geometry.orientation.world, World::kScene);
  write("ImageData", "/VTKHDF/PointData", {2, 6, 0, 2, 1, 2});
  ExpectRefused("is of 2 x 3 x 4, but WholeExtent says 2 x 3 x 5 along z, y and x");
  write("HyperTreeGrid", "/VTKHDF/PointData", {2, 5, 0, 2, 1, 2});
  ExpectRefused("is a VTKHDF file of type 'HyperTreeGrid', which is not supported");
}

// As openPMD-api writes them: iterations are times, and components of a vector channels.
TEST_F(Hdf5ImageTest, MeshesOfOpenPmdLieOnTheirGridAtTheirIteration) {
  const auto write = [&](const std::string& order) {
    Hdf5Writer writer(path_);
    std::vector<std::int16_t> samples = Ascending(2 * 3 * 4);
    for (const int iteration : {0, 50, 100}) {
      const std::string base = fmt::format("/data/{}", iteration), mesh = base + "/fields/E";
      for (const std::string component : {"x", "y"}) {
        writer.Write(mesh + "/" + component, {.size = {2, 3, 4}, .type = SampleType::kInt16}, samples.data());
        writer.Numbers(mesh + "/" + component, "position",
                       order == "F" ? std::vector<double>{0.5, 0, 0.25} : std::vector<double>{0.25, 0, 0.5});
        for (std::int16_t& sample : samples) sample = std::int16_t(sample + 100);
      }
      writer.Numbers(base, "time", {iteration * 0.02});
      writer.Numbers(base, "timeUnitSI", {0.5});
      writer.Text(mesh, "geometry", order == "theta" ? "thetaMode" : "cartesian");
      writer.Text(mesh, "dataOrder", order);
      writer.Numbers(mesh, "gridUnitSI", {0.1});
      // Fortran's x, y and z are z, y and x of the dataset.
      writer.Texts(mesh, "axisLabels", order == "F" ? std::vector<std::string>{"x", "y", "z"} : std::vector<std::string>{"z", "y", "x"});
      writer.Numbers(mesh, "gridSpacing", order == "F" ? std::vector<double>{3, 2, 1} : std::vector<double>{1, 2, 3});
      writer.Numbers(mesh, "gridGlobalOffset", order == "F" ? std::vector<double>{30, 20, 10} : std::vector<double>{10, 20, 30});
    }
    writer.Text("/", "openPMD", "1.1.0");
    writer.Text("/", "meshesPath", "fields/");
  };
  for (const std::string order : {"C", "F"}) {
    SCOPED_TRACE(order);
    write(order);
    for (int time = 0; time < 3; ++time) {
      for (int channel = 0; channel < 2; ++channel) {
        const auto source = Open({.time = TimeRange{time, time}, .channel = channel});
        EXPECT_EQ(ValueAt(*source, {0.1 * (30 + 3 * 3.5), 0.1 * (20 + 2 * 2), 0.1 * (10 + 1.25)}),
                  3 + 4 * (2 + 3) + 100 * (2 * time + channel));
        EXPECT_EQ(source->info().times, (TimeAxis{3, 0.5, "s"}));
        EXPECT_EQ(source->info().channels[1].name, "y");
        EXPECT_EQ(source->info().finest().geometry.orientation.unit, LengthUnit::kMetre);
      }
    }
    EXPECT_EQ(ValueAt(*Open({.dataset = "/data/50/fields/E/y"}), {4.05, 2.4, 1.125}), 23 + 300) << "a path is one dataset, on its grid";
  }
  ExpectRefused("has no mesh B; in /data/0/fields there are: E", {.dataset = "B", .describe = true});
  write("theta");
  ExpectRefused("has geometry 'thetaMode', which is not supported; supported: cartesian", {.describe = true});
}

// Arrays of grids are no images. Whoever names one gets it.
TEST_F(Hdf5ImageTest, GridsOfOtherProgramsAreNamed) {
  const std::vector<std::int16_t> samples = Ascending(2 * 3 * 4);
  const Hdf5Writer::Layout cube = {.size = {2, 3, 4}, .type = SampleType::kInt16};
  Hdf5Writer(path_).Write("/Base/Zone/GridCoordinates/CoordinateX/ data", cube, samples.data());
  ASSERT_NE(Open(), nullptr);
  {
    Hdf5Writer writer(path_);
    writer.Write("/Base/Zone/GridCoordinates/CoordinateX/ data", cube, samples.data());
    writer.Doubles("/CGNSLibraryVersion/ data", {1}, {4.2});
  }
  ExpectRefused("image.h5: a CGNS file, which is not read; ParaView");
  EXPECT_NE(Open({.dataset = "/Base/Zone/GridCoordinates/CoordinateX/ data"}), nullptr);
  {
    Hdf5Writer writer(path_);
    writer.Write("/vals_nod_var1", cube, samples.data());
    writer.Numbers("/", "floating_point_word_size", {8});
  }
  ExpectRefused("image.h5: an Exodus file, which is not read; ParaView");
  path_ = directory_ / "grid.cgns";
  Hdf5Writer(path_).Write("/Base/Zone/GridCoordinates/CoordinateX/ data", cube, samples.data());
  ExpectRefused("grid.cgns: a CGNS file, which is not read; ParaView");
}

// As netCDF-4 writes them.
TEST_F(Hdf5ImageTest, CoordinatesPlaceTheAxesAndCfScalesTheValues) {
  std::vector<std::int16_t> samples = Ascending(2 * 3 * 4);
  samples[5] = -999;
  {
    Hdf5Writer writer(path_);
    writer.Write("/temperature", {.size = {2, 3, 4}, .chunk = {2, 2, 2}, .type = SampleType::kInt16}, samples.data());
    writer.Doubles("/height", {2}, {0.5, 1.5});
    writer.Doubles("/lat", {3}, {50, 48, 46});
    writer.Doubles("/lon", {4}, {-1, 0, 1, 2});
    writer.Text("/height", "axis", "Z");
    writer.Text("/lat", "units", "degrees_north");
    writer.Text("/lon", "units", "degrees_east");
    writer.Scales("/temperature", {"/height", "/lat", "/lon"});
    writer.Numbers("/temperature", "scale_factor", {0.5});
    writer.Numbers("/temperature", "add_offset", {270});
    writer.Numbers("/temperature", "_FillValue", {-999});
    writer.Numbers("/temperature", "valid_range", {-10, 20});
  }
  const auto source = Open();
  const VolumeGeometry& geometry = source->info().levels[0].description.geometry;
  EXPECT_EQ(geometry.spacing, (Vec3{1, 2, 1}));
  EXPECT_EQ(geometry.orientation.origin, (Vec3{-1, 46, 0.5}));
  EXPECT_EQ(ValueAt(*source, {1, 48, 1.5}), 270 + 0.5 * (2 + 4 * (1 + 3)));
  EXPECT_TRUE(std::isnan(ValueAt(*source, {0, 48, 0.5}))) << "the missing value";
  EXPECT_TRUE(std::isnan(ValueAt(*source, {2, 46, 1.5}))) << "above the valid range";
  EXPECT_EQ(source->info().file_type, "int16");
  EXPECT_THAT(source->info().notes, Contains(HasSubstr("axes of the dataset: z, y, x (by dimension scales)")));
  EXPECT_THAT(source->info().notes, Contains(HasSubstr("scale_factor")));
}

TEST_F(Hdf5ImageTest, TimesHaveAStep) {
  const std::vector<std::int16_t> samples = Ascending(2 * 3 * 4 * 5);
  const Hdf5Writer::Layout layout{.size = {2, 3, 4, 5}, .type = SampleType::kInt16};
  const auto netcdf = [&](const std::vector<double>& times, const std::string& units) {
    {
      Hdf5Writer writer(path_);
      writer.Write("/data", layout, samples.data());
      writer.Doubles("/time", {2}, times);
      writer.Text("/time", "units", units);
      writer.Scales("/data", {"/time", "", "", ""});
    }
    const SourceInfo info = Open({.time = TimeRange{1, 1}})->info();
    EXPECT_EQ(info.levels[0].description.geometry.orientation.world, World::kVoxels) << "a time is no place";
    return info.times;
  };
  EXPECT_EQ(netcdf({6, 12}, "hours since 1900-01-01 00:00:00"), (TimeAxis{2, 6, "h"}));
  EXPECT_EQ(netcdf({6, 12}, "beats"), (TimeAxis{2, 6, ""}));
  EXPECT_EQ(netcdf({6, 6}, "hours since 1900-01-01"), (TimeAxis{2})) << "no step, so no unit either";
  EXPECT_EQ(netcdf({12, 6}, "hours since 1900-01-01"), (TimeAxis{2}));
  EXPECT_EQ(netcdf({6, NAN}, ""), (TimeAxis{2}));
  {
    Hdf5Writer writer(path_);
    writer.Write("/minc-2.0/image/0/image", layout, samples.data());
    writer.Text("/minc-2.0/image/0/image", "dimorder", "time,zspace,yspace,xspace");
    writer.Doubles("/minc-2.0/dimensions/time", {1}, {0});
    writer.Numbers("/minc-2.0/dimensions/time", "step", {2.5});
  }
  EXPECT_EQ(Open({.time = TimeRange{}})->info().times, (TimeAxis{2, 2.5, "s"}));
  {
    Hdf5Writer writer(path_);
    writer.Write("/VTKHDF/PointData/density", layout, samples.data());
    writer.Text("/VTKHDF", "Type", "ImageData");
    writer.Numbers("/VTKHDF", "WholeExtent", {0, 4, 0, 3, 0, 2});
    writer.Doubles("/VTKHDF/Steps/Values", {2}, {0, 0.25});
  }
  EXPECT_EQ(Open({.time = TimeRange{}})->info().times, (TimeAxis{2, 0.25, ""}));
}

TEST_F(Hdf5ImageTest, LengthsOfSeveralUnitsAreThoseOfX) {
  const std::vector<std::int16_t> samples = Ascending(24);
  Hdf5Writer(path_).Write("/data", {.size = {2, 3, 4}, .type = SampleType::kInt16}, samples.data());
  {
    Hdf5Writer writer(path_);
    writer.Write("/data", {.size = {2, 3, 4}, .type = SampleType::kInt16}, samples.data());
    const std::pair<const char*, const char*> axes[] = {{"/depth", "um"}, {"/row", "nm"}, {"/column", "nm"}};
    for (std::size_t i = 0; i < 3; ++i) {
      std::vector<double> coordinates;
      for (std::size_t number = 0; number < i + 2; ++number) coordinates.push_back(double(number) * 2);
      writer.Doubles(axes[i].first, {i + 2}, coordinates);
      writer.Text(axes[i].first, "units", axes[i].second);
    }
    writer.Scales("/data", {"/depth", "/row", "/column"});
  }
  const auto source = Open();
  const VolumeGeometry& geometry = source->info().levels[0].description.geometry;
  EXPECT_EQ(geometry.orientation.unit, LengthUnit::kNanometre);
  EXPECT_DOUBLE_EQ(geometry.spacing.x, 2);
  EXPECT_DOUBLE_EQ(geometry.spacing.z, 2000);
}

TEST_F(Hdf5ImageTest, UnevenCoordinatesPlaceVoxelsOrAreResampled) {
  const std::vector<std::int16_t> samples = Ascending(3 * 2 * 2);
  {
    Hdf5Writer writer(path_);
    writer.Write("/data", {.size = {3, 2, 2}, .type = SampleType::kInt16}, samples.data());
    writer.Doubles("/lev", {3}, {1000, 500, 100});
    writer.Doubles("/y", {2}, {0, 4});
    writer.Doubles("/x", {2}, {0, 5});
    writer.Scales("/data", {"/lev", "/y", "/x"});
  }
  // The axis runs down.
  const auto source = Open();
  EXPECT_THAT(source->info().notes, Contains(HasSubstr("the 3 voxels along z, 400 to 500 apart, lie at their own places")));
  const VolumeGeometry& uneven = source->info().finest().geometry;
  EXPECT_EQ(uneven.spacing, (Vec3{5, 4, 450}));
  for (const auto& [z, at] : {std::pair{0.0, 100.0}, {1.0, 500.0}, {2.0, 1000.0}}) {
    EXPECT_DOUBLE_EQ(uneven.ToWorld(uneven.stretch.ToData(Vec3{0, 0, z})).z, at);
  }

  testing::internal::CaptureStderr();
  const auto labels = Open({.labels = true});
  const std::string why = "coordinates lev are not evenly spaced: number 1 is 500, an even one would be 550";
  EXPECT_THAT(testing::internal::GetCapturedStderr(), HasSubstr(why));
  EXPECT_THAT(labels->info().notes, Contains(HasSubstr(why)));
  EXPECT_EQ(labels->info().levels[0].description.geometry.spacing, (Vec3{5, 4, 1}));

  const auto even = Open({.resample = 0});
  EXPECT_EQ(even->info().finest().geometry.spacing, (Vec3{5, 4, 1350.0 / 4}));
  EXPECT_THAT(even->info().notes, Contains(HasSubstr("the 3 voxels along z, 400 to 500 apart, are resampled linearly to 4 even ones")));
  ExpectValuesOfPlaces(*even, {0, 0, 100}, {5, 4, 1000}, [](const Vec3& at) {
    return at.x / 5 + at.y / 2 + 4 * (at.z < 500 ? 2 - (at.z - 100) / 400 : 1 - (at.z - 500) / 500);
  });
}

// Latitudes of a Gaussian grid: zeros of a Legendre polynomial, a little off even ones.
TEST_F(Hdf5ImageTest, GaussianLatitudesAreEven) {
  constexpr int kLatitudes = 96;
  std::vector<double> latitudes;
  for (int i = 0; i < kLatitudes; ++i) {
    double x = std::cos(M_PI * (i + 0.75) / (kLatitudes + 0.5)), step = 1;
    while (std::abs(step) > 1e-14) {  // Newton's method
      double before = 1, value = x;
      for (int n = 2; n <= kLatitudes; ++n) before = std::exchange(value, ((2 * n - 1) * x * value - (n - 1) * before) / n);
      step = value * (x * x - 1) / (kLatitudes * (x * value - before));
      x -= step;
    }
    latitudes.push_back(std::asin(x) * 180 / M_PI);
  }
  ASSERT_NEAR(latitudes[0], 88.572, 0.001) << "of the grid N48";
  const std::vector<std::int16_t> samples = Ascending(2 * kLatitudes);
  {
    Hdf5Writer writer(path_);
    writer.Write("/data", {.size = {kLatitudes, 2}, .type = SampleType::kInt16}, samples.data());
    writer.Doubles("/lat", {kLatitudes}, latitudes);
    writer.Scales("/data", {"/lat", ""});
  }
  EXPECT_NEAR(Open()->info().levels[0].description.geometry.spacing.y, 2 * latitudes[0] / (kLatitudes - 1), 1e-9);
}

// CF: coordinates may lie anywhere in their cells, which bounds tell.
TEST_F(Hdf5ImageTest, EvenBoundsPlaceAnAxisBeforeItsCoordinates) {
  const std::vector<std::int16_t> samples = Ascending(2 * 3 * 4);
  const auto write = [&](const std::vector<hsize_t>& size, const std::vector<double>& bounds) {
    Hdf5Writer writer(path_);
    writer.Write("/grid/data", {.size = {2, 3, 4}, .type = SampleType::kInt16}, samples.data());
    writer.Doubles("/grid/depth", {2}, {10, 30});
    writer.Doubles("/grid/depth_bnds", {2, 2}, {0, 15, 15, 50});
    writer.Doubles("/grid/lat", {3}, {50, 47, 46});
    writer.Doubles("/grid/lat_bnds", {3, 2}, {51, 49, 49, 47, 47, 45});
    writer.Doubles("/grid/lon", {4}, {0, 1.25, 2, 3});
    writer.Doubles("/grid/lon_bnds", size, bounds);
    for (const std::string name : {"/grid/depth", "/grid/lat", "/grid/lon"}) writer.Text(name, "bounds", name.substr(6) + "_bnds");
    writer.Scales("/grid/data", {"/grid/depth", "/grid/lat", "/grid/lon"});
  };
  write({4, 2}, {-0.5, 0.5, 0.5, 1.5, 1.5, 2.5, 2.5, 3.5});
  const auto source = Open();
  const VolumeGeometry& geometry = source->info().finest().geometry;
  EXPECT_EQ(geometry.spacing, (Vec3{1, 2, 20}));
  EXPECT_EQ(geometry.orientation.origin, (Vec3{0, 46, 10}));
  EXPECT_TRUE(geometry.stretch.even());
  EXPECT_EQ(ValueAt(*source, {3, 50, 30}), 15) << "the axis of lat falls";
  EXPECT_THAT(source->info().notes, Contains(HasSubstr("bounds of the coordinates lon place its axis: 0 and steps of 1")));
  EXPECT_THAT(source->info().notes, Contains("coordinates depth place its axis: 10 and steps of 20")) << "its cells are not even";

  // Bounds that place nothing, so that the coordinates do: an array of another shape (three times), cells with gaps between them, and an
  // end that is not a number.
  const double nan = std::nan("");
  for (const auto& [size, bounds] :
       std::vector<std::pair<std::vector<hsize_t>, std::vector<double>>>{{{2, 4}, {-0.5, 0.5, 1.5, 2.5, 0.5, 1.5, 2.5, 3.5}},
                                                                         {{5}, {-0.5, 0.5, 1.5, 2.5, 3.5}},
                                                                         {{4, 4}, std::vector<double>(16, 1)},
                                                                         {{4, 2}, {-0.4, 0.4, 0.6, 1.4, 1.6, 2.4, 2.6, 3.4}},
                                                                         {{4, 2}, {-0.5, 0.5, 0.5, nan, 1.5, 2.5, 2.5, 3.5}}}) {
    write(size, bounds);
    EXPECT_THAT(Open()->info().notes, Contains(HasSubstr("the 4 voxels along x, 0.75 to 1.25 apart, lie at their own places")));
  }
}

TEST_F(Hdf5ImageTest, AnOnlySliceHasTheThicknessOfItsCell) {
  const std::vector<std::int16_t> samples = Ascending(6);
  {
    Hdf5Writer writer(path_);
    writer.Write("/data", {.size = {1, 2, 3}, .type = SampleType::kInt16}, samples.data());
    writer.Doubles("/depth", {1}, {10});
    writer.Doubles("/depth_bnds", {1, 2}, {0, 30});
    writer.Text("/depth", "bounds", "depth_bnds");
    writer.Scales("/data", {"/depth", "", ""});
  }
  const auto source = Open();
  EXPECT_EQ(source->info().finest().geometry.spacing.z, 30);
  EXPECT_EQ(source->info().finest().geometry.orientation.origin.z, 15);
}

TEST_F(Hdf5ImageTest, ASliceBesideBoundsOfMoreAxesIsTheImage) {
  const std::vector<std::int16_t> samples = Ascending(12);
  {
    Hdf5Writer writer(path_);
    writer.Write("/tos", {.size = {3, 4}, .type = SampleType::kInt16}, samples.data());
    for (const char* const name : {"/lat", "/lon"}) {
      writer.Doubles(name, {3, 4}, std::vector<double>(12));
      writer.Doubles(name + std::string("_vertices"), {3, 4, 4}, std::vector<double>(48));
      writer.Text(name, "bounds", (name + std::string("_vertices")).substr(1));
    }
    writer.Text("/tos", "coordinates", "lat lon");
  }
  const auto source = Open();
  EXPECT_EQ(source->info().finest().geometry.size, (Index3{4, 3, 1}));
  EXPECT_EQ(ValueAt(*source, {3, 2, 0}), 11);
}

TEST_F(Hdf5ImageTest, AMissingValueThatIsADoubleIsOneOfFloats) {
  const std::vector<float> samples = {1, 2, 1e20F, 4, 5, 6, 7, -9.99e8F};
  {
    Hdf5Writer writer(path_);
    writer.Write("/data", {.size = {2, 2, 2}, .type = SampleType::kFloat32}, samples.data());
    writer.Numbers("/data", "_FillValue", {1e20});
    writer.Numbers("/data", "missing_value", {-9.99e8});
  }
  const auto source = Open();
  EXPECT_TRUE(std::isnan(ValueAt(*source, {0, 1, 0})));
  EXPECT_TRUE(std::isnan(ValueAt(*source, {1, 1, 1})));
  EXPECT_EQ(ValueAt(*source, {0, 1, 1}), 7);
}

TEST_F(Hdf5ImageTest, BoundsAndCoordinatesOfSeveralAxesAreNoImages) {
  const std::vector<std::int16_t> samples = Ascending(24);
  {
    Hdf5Writer writer(path_);
    for (const char* const name : {"/so", "/corners", "/heights"}) {
      writer.Write(name, {.size = {2, 3, 4}, .type = SampleType::kInt16}, samples.data());
    }
    writer.Doubles("/lat", {3, 4}, std::vector<double>(12));
    writer.Text("/lat", "bounds", "corners");
    writer.Text("/so", "coordinates", "lat heights");
  }
  EXPECT_EQ(ValueAt(*Open(), {3, 2, 1}), 23);
  EXPECT_EQ(ValueAt(*Open({.dataset = "corners"}), {3, 2, 1}), 23) << "unless they are asked for";
}

TEST_F(Hdf5ImageTest, DimensionsOfNetcdfWithoutAVariablePlaceNothing) {
  const std::vector<std::int16_t> samples = Ascending(8);
  {
    Hdf5Writer writer(path_);
    writer.Write("/data", {.size = {2, 2, 2}, .type = SampleType::kInt16}, samples.data());
    writer.Doubles("/x", {2}, {0, 7});
    writer.Text("/x", "NAME", "This is a netCDF dimension but not a netCDF variable.         2");
    writer.Scales("/data", {"", "", "/x"});
  }
  const auto source = Open();
  const VolumeGeometry& geometry = source->info().levels[0].description.geometry;
  EXPECT_EQ(geometry.spacing, (Vec3{1, 1, 1}));
  EXPECT_EQ(geometry.orientation.world, World::kVoxels);
}

TEST_F(Hdf5ImageTest, UnsignedSamplesInSignedOnesAreToldByCf) {
  const std::vector<std::int8_t> samples = {0, 1, -1, -2, 100, -128, 7, 8};
  {
    Hdf5Writer writer(path_);
    writer.Write("/data", {.size = {2, 2, 2}, .type = SampleType::kInt8}, samples.data());
    writer.Text("/data", "_Unsigned", "true");
    writer.Numbers("/data", "_FillValue", {-1});
  }
  const auto source = Open();
  EXPECT_TRUE(std::isnan(ValueAt(*source, {0, 1, 0}))) << "255";
  EXPECT_EQ(ValueAt(*source, {1, 1, 0}), 254);
  EXPECT_EQ(ValueAt(*source, {1, 0, 1}), 128);
}

TEST_F(Hdf5ImageTest, NexusLeadsToTheSignalAndItsAxes) {
  const std::vector<std::int16_t> samples = Ascending(2 * 3 * 4);
  {
    Hdf5Writer writer(path_);
    for (const char* const name : {"/entry/data/counts", "/entry/data/errors"}) {
      writer.Write(name, {.size = {2, 3, 4}, .type = SampleType::kInt16}, samples.data());
    }
    writer.Doubles("/entry/data/z", {2}, {1, 1.5});
    writer.Text("/", "default", "entry");
    writer.Text("/entry", "default", "data");
    writer.Text("/entry/data", "NX_class", "NXdata");
    writer.Text("/entry/data", "signal", "counts");
    writer.Texts("/entry/data", "axes", {"z", ".", "."});
  }
  const auto source = Open();
  EXPECT_EQ(source->info().format, "NeXus");
  EXPECT_EQ(source->info().levels[0].description.geometry.spacing, (Vec3{1, 1, 0.5}));
  EXPECT_EQ(source->info().levels[0].description.geometry.orientation.origin, (Vec3{0, 0, 1}));
}

TEST_F(Hdf5ImageTest, ResolutionAndOffsetAreInTheOrderOfTheAxes) {
  const std::vector<std::int16_t> samples = Ascending(2 * 3 * 4);
  {
    Hdf5Writer writer(path_);
    writer.Write("/volumes/raw", {.size = {2, 3, 4}, .type = SampleType::kInt16}, samples.data());
    writer.Numbers("/volumes/raw", "resolution", {40, 4, 8});
    writer.Numbers("/volumes/raw", "offset", {400, 12, 16});
    writer.Text("/volumes/raw", "units", "nm");
  }
  const auto source = Open();
  const VolumeGeometry& geometry = source->info().levels[0].description.geometry;
  EXPECT_EQ(geometry.spacing, (Vec3{8, 4, 40}));
  EXPECT_EQ(geometry.orientation.origin, (Vec3{16, 12, 400}));
  EXPECT_EQ(geometry.orientation.unit, LengthUnit::kNanometre);
}

}  // namespace
}  // namespace slabstream
