// Programs are found beside the running one.
#include "common/files/program_beside.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

namespace slabstream {
namespace {

TEST(ProgramBeside, IsInTheFolderOfThisProgram) {
  const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe");
  EXPECT_EQ(ProgramFolder(), self.parent_path());
  EXPECT_EQ(ProgramBeside(self.filename()).value(), self.string());
  const Status missing = ProgramBeside("slabstream-nobody").status();
  EXPECT_EQ(missing.code(), StatusCode::kNotFound);
  EXPECT_EQ(missing.message(),
            "the program '" + (self.parent_path() / "slabstream-nobody").string() + "' is missing; deploy/build makes all programs");
}

}  // namespace
}  // namespace slabstream
