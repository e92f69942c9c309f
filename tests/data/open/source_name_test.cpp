#include "data/open/source_name.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "common/frame/dataset_name.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

TEST(SourceName, IsTheFilesWithoutExtensions) {
  EXPECT_EQ(NameOfSource("/data/head.nii.gz"), "head");
  EXPECT_EQ(NameOfSource("scan.v2.NII"), "scan.v2");
  EXPECT_EQ(NameOfSource("cells.ome.tif"), "cells");
  EXPECT_EQ(NameOfSource("emd_1234.map.gz"), "emd_1234");
  EXPECT_EQ(NameOfSource("1.2.840.10008"), "1.2.840.10008") << "no extension begins with a digit";
  EXPECT_EQ(NameOfSource("ct.raw?dims=2,2,2,type=uint8"), "ct");
  EXPECT_EQ(NameOfSource("https://example.org/public/brain.ome.zarr/?channel=1"), "brain");
  EXPECT_EQ(NameOfSource("s3://bucket/my%20brain.zarr"), "my_brain");
}

TEST(SourceName, OfAFolderKeepsItsDots) {
  TemporaryDirectory temporary;
  const std::filesystem::path folder = temporary.path();
  for (const char* name : {"brain.ome.zarr", "cells.n5", "Smith.John", "plain"}) std::filesystem::create_directory(folder / name);
  EXPECT_EQ(NameOfSource(folder / "brain.ome.zarr"), "brain");
  EXPECT_EQ(NameOfSource((folder / "cells.n5").string() + "/"), "cells");
  EXPECT_EQ(NameOfSource(folder / "Smith.John"), "Smith.John");
  EXPECT_EQ(NameOfSource((folder / "plain" / "..").string()), folder.filename().string());
}

TEST(SourceName, IsSafe) {
  EXPECT_EQ(NameOfSource("scan 1.nrrd"), "scan_1");
  EXPECT_EQ(NameOfSource("t1 (2).nrrd"), "t1_2");
  EXPECT_EQ(NameOfSource("Sch\u00e4del.nrrd"), "Sch_del");
  EXPECT_EQ(NameOfSource("\u8133.nii"), "volume");
  EXPECT_EQ(NameOfSource("-v.nrrd"), "v") << "no option";
  EXPECT_EQ(NameOfSource("a@3.nrrd"), "a_3") << "no time";
  EXPECT_EQ(NameOfSource("/"), "volume");
  for (const std::string& odd :
       {fmt::format("{:a>300}.nii", ""), std::string("..."), std::string("\xff\xfe.nii"), std::string("a\nb.nii")}) {
    EXPECT_TRUE(CheckDatasetName(NameOfSource(odd)).ok()) << odd;
  }
}

TEST(SourceName, SameNamesAreToldApartByNumbers) {
  using testing::ElementsAre;
  EXPECT_THAT(NamesOfSources(std::vector<std::string>{"a b.nrrd", "a_b.nrrd", "a(b).nrrd"}), ElementsAre("a_b-2", "a_b", "a_b-3"))
      << "who needs no change keeps the name";
  EXPECT_THAT(NamesOfSources(std::vector<std::string>{"head.nii", "head.nrrd", "head-2.nii"}), ElementsAre("head", "head-3", "head-2"));
  EXPECT_THAT(NamesOfSources({}), ElementsAre());
}

}  // namespace
}  // namespace slabstream
