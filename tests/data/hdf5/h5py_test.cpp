// Files that h5py writes, which is how most people write HDF5. Skipped where Debian's python3-h5py is not installed.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <cstring>

#include "common/files/files.h"
#include "data/hdf5/hdf5_array.h"
#include "tests/data/sources/read_array.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

constexpr const char* kScript = R"(
import itertools, sys
import h5py, numpy
shape = (11, 13, 17)
values = numpy.arange(numpy.prod(shape)).reshape(shape) * 7 % 120
with h5py.File(sys.argv[1], "w", libver=sys.argv[2]) as file:
    for type in ("i1", "u1", "<i2", ">i2", "<u2", ">u2", "<i4", ">u4", "<i8", ">u8", "<f4", ">f4", "<f8", ">f8"):
        for number, how in enumerate((
            {}, {"chunks": (4, 5, 6)}, {"chunks": (4, 5, 6), "compression": "gzip"},
            {"chunks": (4, 5, 6), "compression": "gzip", "compression_opts": 9, "shuffle": True, "fletcher32": True},
            {"chunks": (11, 13, 17), "shuffle": True}, {"chunks": (4, 5, 6), "maxshape": (None, None, None), "compression": "gzip"},
        )):
            file.create_dataset(type.strip("<>") + ("b" if ">" in type else "l") + str(number), data=values.astype(type), **how)
    file.create_dataset("lzf", data=values.astype("u1"), chunks=(4, 5, 6), compression="lzf")
    file.create_dataset("lzf2", data=values.astype(">u2"), compression="lzf", shuffle=True)
    sparse = file.create_dataset("sparse", shape, "<u2", chunks=(4, 5, 6), fillvalue=77)
    sparse[5, 6, 7] = 1234
)";

template <class T>
std::vector<std::byte> Expected() {
  std::vector<T> values(11 * 13 * 17);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = T(i * 7 % 120);
  const auto bytes = std::as_bytes(std::span(values));
  return {bytes.begin(), bytes.end()};
}

TEST(H5py, WritesWhatIsReadHere) {
  if (std::system("/usr/bin/python3 -c 'import h5py' 2>/dev/null") != 0) GTEST_SKIP() << "install python3-h5py";
  const TemporaryDirectory directory;
  ASSERT_TRUE(WriteTextFile(directory / "write.py", kScript).ok());
  const auto context = std::make_shared<ReadContext>(ReadContext::Limits{.decode_threads = 2});
  for (const std::string version : {"earliest", "latest"}) {
    const std::string path = directory / (version + ".h5");
    ASSERT_EQ(std::system(("/usr/bin/python3 -B " + directory / "write.py" + " " + path + " " + version).c_str()), 0);
    const auto file = Hdf5File::Open(path);
    ASSERT_TRUE(file.ok()) << file.status().message();
    const std::vector<std::string> names = (*file)->Datasets(3).paths;
    EXPECT_EQ(names.size(), 14U * 6U + 3U);
    for (const std::string& name : names) {
      SCOPED_TRACE(version + name);
      Result<std::shared_ptr<Hdf5Dataset>> dataset = (*file)->Dataset(name);
      ASSERT_TRUE(dataset.ok()) << dataset.status().message();
      const SampleType type = (*dataset)->type();
      const auto array = MakeHdf5Array(*std::move(dataset), context);
      ASSERT_TRUE(array.ok()) << array.status().message();
      const Result<std::vector<std::byte>> elements = ReadArray(**array);
      ASSERT_TRUE(elements.ok()) << elements.status().message();
      if (name == "/sparse") {
        std::vector<std::uint16_t> values(elements->size() / 2);
        std::memcpy(values.data(), elements->data(), elements->size());
        EXPECT_EQ(values[7 + 17 * (6 + 13 * 5)], 1234);
        EXPECT_EQ(std::ranges::count(values, 77), std::ptrdiff_t(values.size() - 1));
        continue;
      }
      EXPECT_EQ(*elements, VisitSampleType(type, [](const auto* none) { return Expected<std::remove_cvref_t<decltype(*none)>>(); }));
    }
  }
}

}  // namespace
}  // namespace slabstream
