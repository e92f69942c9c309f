#include "coordinator/catalogue.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <string_view>
#include <system_error>

#include "common/frame/frame_request.h"
#include "common/volume_io/volume_reader.h"

namespace slabstream {
namespace {

namespace fs = std::filesystem;

bool AllowedInName(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '.' || c == '_' || c == '-'; }

// The file name without its ending; ".nii.gz" is one ending.
std::string Stem(const fs::path& path) {
  fs::path name = path.filename();
  if (name.extension() == ".gz") name = name.stem();
  return name.stem().string();
}

VolumeLoader LoaderOf(const VolumeSource& source) {
  return [source]() -> Result<std::shared_ptr<const Volume>> {
    Result<LoadedVolume> loaded = ReadVolume(source.path, source.options);
    if (!loaded.ok()) return loaded.status();
    return loaded->volume;
  };
}

Status Add(Catalogue& catalogue, const std::string& name, const VolumeSource& source, const std::string& argument) {
  if (name.empty() || name.size() > kMaxNameBytes || !std::ranges::all_of(name, AllowedInName)) {
    return Status::InvalidArgument(
        fmt::format("--data {}: dataset name \"{}\" must have 1 to {} letters, digits, '.', '_' or '-'", argument, name, kMaxNameBytes));
  }
  if (!catalogue.emplace(name, LoaderOf(source)).second) {
    return Status::InvalidArgument("--data " + argument + ": there is already a dataset named \"" + name + "\"");
  }
  return Status::Ok();
}

bool HasFiles(const fs::path& directory) {
  std::error_code error;
  const fs::directory_iterator entries(directory, error);
  return !error && std::any_of(begin(entries), end(entries), [](const fs::directory_entry& entry) {
    std::error_code unreadable;
    return entry.is_regular_file(unreadable);
  });
}

Status AddDirectory(Catalogue& catalogue, const fs::path& directory, const std::string& argument) {
  // A directory of nothing but directories holds a volume in each, as a directory of DICOM studies does.
  if (HasFiles(directory) && LooksLikeVolume(directory.string())) {
    const fs::path whole = fs::absolute(directory).lexically_normal();
    return Add(catalogue, (whole.has_filename() ? whole : whole.parent_path()).filename().string(), {directory.string(), {}}, argument);
  }
  std::vector<fs::path> found;
  std::error_code error;
  for (fs::directory_iterator entry(directory, error), end; !error && entry != end; entry.increment(error)) {
    if (LooksLikeVolume(entry->path().string())) found.push_back(entry->path());
  }
  if (error) return Status::NotFound("--data " + argument + ": cannot read the directory: " + error.message());
  if (found.empty()) return Status::InvalidArgument("--data " + argument + ": no volume file in this directory");
  std::ranges::sort(found);
  for (const fs::path& path : found) {
    if (Status status = Add(catalogue, Stem(path), {path.string(), {}}, argument); !status.ok()) return status;
  }
  return Status::Ok();
}

Status AddArgument(Catalogue& catalogue, const std::string& argument) {
  std::error_code error;
  const std::size_t equals = argument.find('=');
  if (equals != std::string::npos) {
    const Result<VolumeSource> source = ParseVolumeSource(argument.substr(equals + 1));
    if (!source.ok()) return Status(source.status().code(), "--data " + source.status().message());
    if (!fs::exists(source->path, error)) return Status::NotFound("--data " + argument + ": \"" + source->path + "\" does not exist");
    if (Status status = CheckVolume(source->path, source->options); !status.ok())
      return Status(status.code(), "--data " + status.message());
    return Add(catalogue, argument.substr(0, equals), *source, argument);
  }
  if (!fs::exists(argument, error)) return Status::NotFound("--data " + argument + ": does not exist");
  if (!fs::is_directory(argument, error)) {
    return Status::InvalidArgument("--data " + argument + ": is a file; give it a name as in NAME=" + argument);
  }
  return AddDirectory(catalogue, argument, argument);
}

}  // namespace

Result<Catalogue> MakeCatalogue(const std::vector<std::string>& arguments) {
  Catalogue catalogue;
  for (const std::string& argument : arguments) {
    if (Status status = AddArgument(catalogue, argument); !status.ok()) return status;
  }
  return catalogue;
}

}  // namespace slabstream
