// write_seeds FOLDER: writes the seeds of each target into a folder of its name, and prints the names.
#include <cstdio>
#include <filesystem>
#include <string>

#include "common/files/files.h"
#include "tests/fuzz/fuzz_target.h"

int main(int argc, char** argv) {
  using namespace slabstream;
  if (argc != 2) {
    (void)std::fprintf(stderr, "write_seeds: needs FOLDER\n");
    return 2;
  }
  for (const FuzzTarget& target : FuzzTargets()) {
    const std::filesystem::path folder = std::filesystem::path(argv[1]) / target.name;
    std::filesystem::create_directories(folder);
    const std::vector<FuzzBytes> seeds = target.seeds();
    for (std::size_t i = 0; i < seeds.size(); ++i) {
      const std::string text(reinterpret_cast<const char*>(seeds[i].data()), seeds[i].size());
      if (const Status written = WriteTextFile(folder / ("seed-" + std::to_string(i)), text); !written.ok()) {
        (void)std::fprintf(stderr, "write_seeds: %s\n", written.message().c_str());
        return 1;
      }
    }
    (void)std::printf("%.*s\n", int(target.name.size()), target.name.data());
  }
  return 0;
}
