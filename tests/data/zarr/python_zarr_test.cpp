// What python3-zarr writes, we read: version 2, in every type, codec, order and byte order.
//
// SLABSTREAM_ZARR_PYTHON: a Python that has zarr, numcodecs and numpy.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

#include "data/open/open_source.h"
#include "tests/data/volume_io/volume_files.h"
#include "tests/data/zarr/read_zarr.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

// Writes arrays of 5 x 6 x 7 elements, of which element i is i % 100, into folders of argv[1].
constexpr char kWriter[] = R"(
import itertools, sys
import numcodecs, numpy, zarr

values = (numpy.arange(5 * 6 * 7) % 100).reshape(5, 6, 7)
codecs = {"none": None, "zlib": numcodecs.Zlib(), "gzip": numcodecs.GZip(), "zstd": numcodecs.Zstd(), "lz4": numcodecs.LZ4()}
for name, shuffle in itertools.product(numcodecs.blosc.list_compressors(), [0, 1, 2]):
    codecs[f"blosc_{name}_{shuffle}"] = numcodecs.Blosc(cname=name, shuffle=shuffle)
types = ["|u1", "|i1", "<u2", ">u2", "<i2", ">i2", "<u4", ">i4", "<u8", ">i8", "<f4", ">f4", "<f8", ">f8"]
cases = [(codec, "<u2", "C", ".") for codec in codecs] + [("zstd", dtype, "C", "/") for dtype in types]
cases += [("zlib", "<i2", order, separator) for order in "CF" for separator in "./"]
for number, (codec, dtype, order, separator) in enumerate(cases):
    path = f"{sys.argv[1]}/{number}.{codec}.{dtype[1:]}{order}"
    array = zarr.open(path, mode="w", shape=values.shape, chunks=(2, 3, 7), dtype=dtype, compressor=codecs[codec], order=order,
                      dimension_separator=separator, fill_value=5, write_empty_chunks=False,
                      filters=[numcodecs.Shuffle(numpy.dtype(dtype).itemsize)] if number % 3 == 0 else None)
    array[:4] = values[:4]  # the rest is not there
with zarr.ZipStore(f"{sys.argv[1]}/archive.zip", mode="w") as store:
    zarr.group(store).create_dataset("a", data=values.astype("<u2"), chunks=(2, 3, 7))
)";

TEST(PythonZarrTest, WeReadWhatItWrites) {
  const char* const python = std::getenv("SLABSTREAM_ZARR_PYTHON");
  if (python == nullptr) GTEST_SKIP() << "SLABSTREAM_ZARR_PYTHON names no Python";
  const TemporaryDirectory folder;
  WriteFile(folder / "writer.py", kWriter);
  ASSERT_EQ(std::system((std::string(python) + " -B " + (folder / "writer.py") + " " + folder.path()).c_str()), 0);
  std::vector<double> expected;
  for (int i = 0; i < 5 * 6 * 7; ++i) expected.push_back(i < 4 * 6 * 7 ? i % 100 : 5);
  int arrays = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder.path())) {
    if (!entry.is_directory()) continue;
    SCOPED_TRACE(entry.path().filename());
    ++arrays;
    const Result<zarr::ZarrArray> array = OpenTestArray(entry.path().string());
    ASSERT_TRUE(array.ok()) << array.status().message();
    const Result<std::vector<double>> elements = ReadElements(*array);
    ASSERT_TRUE(elements.ok()) << elements.status().message();
    // Chunks that are begun hold what is written to them and, behind it, the fill value.
    EXPECT_EQ(*elements, expected);
  }
  EXPECT_EQ(arrays, 41);
  const auto archive = OpenSource(folder / "archive.zip", {}, TestContext());
  ASSERT_TRUE(archive.ok()) << archive.status().message();
  EXPECT_EQ((*archive)->info().levels[0].description.geometry.size, (Index3{7, 6, 5}));
}

}  // namespace
}  // namespace slabstream
