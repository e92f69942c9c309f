// `slurm`: prints a job script.
#include <fmt/format.h>

#include <filesystem>
#include <iostream>

#include "client/cli/commands.h"
#include "client/cli/job_script.h"
#include "client/service/service_state.h"
#include "common/cli/program.h"
#include "common/files/program_beside.h"
#include "data/catalogue/catalogue.h"

namespace slabstream {
namespace {

namespace fs = std::filesystem;

// Jobs may start in another folder.
std::string Absolute(const std::string& path) { return fs::absolute(path).lexically_normal().string(); }

// NAME=PATH or DIR.
std::string WithAbsolutePath(const std::string& data) {
  const std::size_t path = data.find('=') + 1;  // 0 without a name
  return data.substr(0, path) + Absolute(data.substr(path));
}

Result<std::string> FolderOfPrograms() {
  std::string folder;
  for (const char* const name : {kWorkerProgram, kCoordinatorProgram}) {
    const Result<std::string> program = ProgramBeside(name);
    if (!program.ok()) return program.status();
    folder = fs::path(*program).parent_path().string();
  }
  return folder;
}

}  // namespace

Status RunSlurm(const SlurmOptions& options) {
  SlurmOptions script = options;
  if (!options.time.empty()) script.directives.insert(script.directives.begin(), "time=" + options.time);  // --sbatch may overrule it
  for (std::string& line : script.directives) {
    Result<std::string> directive = ParseDirective(line);
    if (!directive.ok()) return directive.status();
    line = *std::move(directive);
  }

  FoundData found = FindData(options.data);  // mistakes show here, not when the job starts
  CheckFiles(found);
  if (!found.errors.empty()) return ReportAll("slabstream slurm", found.errors);
  if (found.datasets.empty()) return Status::InvalidArgument("--data " + options.data.front() + ": no volume file in this folder");
  for (std::string& data : script.data) data = WithAbsolutePath(data);
  if (!options.folder.empty()) {
    std::error_code error;
    if (!fs::is_directory(options.folder, error)) return Status::NotFound(fmt::format("--folder '{}' is no folder", options.folder));
    script.folder = Absolute(options.folder);
  }
  const Result<std::string> programs = FolderOfPrograms();
  if (!programs.ok()) return programs.status();
  std::cout << JobScript(script, found.datasets.begin()->first, *programs) << std::flush;
  return Status::Ok();
}

}  // namespace slabstream
