#include "coordinator/catalogue.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <filesystem>
#include <system_error>
#include <thread>
#include <utility>

#include "common/frame/frame_request.h"
#include "common/volume_io/formats.h"
#include "common/volume_io/read_options.h"
#include "common/volume_io/volume_reader.h"

namespace slabstream {
namespace {

namespace fs = std::filesystem;

bool AllowedInName(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '.' || c == '_' || c == '-'; }

// The beginning of an argument that is too long for a message.
std::string Shown(const std::string& argument) {
  constexpr std::size_t kMost = 512;
  return argument.size() <= kMost ? argument : argument.substr(0, kMost) + "...";
}

Status CheckName(const std::string& name) {
  if (!name.empty() && name.size() <= kMaxNameBytes && std::ranges::all_of(name, AllowedInName)) return Status::Ok();
  return Status::InvalidArgument(
      fmt::format("dataset name \"{}\" must have 1 to {} letters, digits, '.', '_' or '-'", Shown(name), kMaxNameBytes));
}

// The file name without its ending; ".nii.gz" is one ending.
std::string Stem(const fs::path& path) {
  fs::path name = path.filename();
  if (name.extension() == ".gz") name = name.stem();
  return name.stem().string();
}

bool IsFolder(const fs::path& path) {
  std::error_code error;
  return fs::is_directory(path, error);
}

bool IsHidden(const fs::path& path) { return path.filename().string().starts_with('.'); }

bool HasFiles(const std::string& folder) {
  std::error_code error;
  const fs::directory_iterator entries(folder, error);
  return !error && std::any_of(begin(entries), end(entries), [](const fs::directory_entry& entry) {
    std::error_code unreadable;
    return entry.is_regular_file(unreadable) && !IsHidden(entry.path());
  });
}

// Whether the folder is a volume, and nothing in it is one of another format. One of nothing but folders, such as those of DICOM studies,
// holds a volume in each.
bool IsOneVolume(const std::string& folder, const std::vector<fs::path>& volumes) {
  const VolumeFormat* const format = FindFormat(folder, {});
  return format != nullptr && LooksLikeVolume(folder) && HasFiles(folder) &&
         std::ranges::all_of(volumes, [&](const fs::path& path) { return FindFormat(path.string(), {}) == format; });
}

Status Repeated(const std::string& name) { return Status::InvalidArgument("there is already a dataset named \"" + name + "\""); }

// Adds what is in the folder; what cannot be added is left out.
void AddContents(FoundData& found, const std::string& folder, const std::vector<fs::path>& files) {
  const auto add = [&](const std::string& name, const std::string& path) {
    Status added = CheckName(name);
    if (added.ok() && !found.datasets.emplace(name, DataSource(path, folder)).second) added = Repeated(name);
    if (!added.ok()) found.complaints.push_back(path + ": left out: " + added.message());
  };
  if (IsOneVolume(folder, files)) {
    add(fs::path(folder).filename().string(), folder);
  } else {
    for (const fs::path& file : files) add(IsFolder(file) ? file.filename().string() : Stem(file), file.string());
  }
}

// The files and folders in a folder that are volumes, by name.
Result<std::vector<fs::path>> VolumeFilesIn(const std::string& folder) {
  std::vector<fs::path> files;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    const fs::path& path = entry->path();
    if (!IsHidden(path) && LooksLikeVolume(path.string())) files.push_back(path);
  }
  if (error) {
    const bool missing = error == std::errc::no_such_file_or_directory || error == std::errc::not_a_directory;
    return Status(missing ? StatusCode::kNotFound : StatusCode::kUnavailable, folder + ": cannot read the folder: " + error.message());
  }
  std::ranges::sort(files);
  return files;
}

// Finds out what the argument names, a path that exists.
Status AddNamed(FoundData& found, const DataArgument& argument) {
  const Result<VolumeSource> source = ParseVolumeSource(argument.path);
  if (!source.ok()) return source.status();
  std::error_code error;
  if (!fs::exists(source->path, error)) return Status::NotFound("does not exist");
  return found.datasets.emplace(argument.name, DataSource(argument.path, "")).second ? Status::Ok() : Repeated(argument.name);
}

Status AddFolder(FoundData& found, const std::string& path) {
  std::error_code error;
  if (!fs::exists(path, error)) return Status::NotFound("does not exist");
  if (!fs::is_directory(path, error)) return Status::InvalidArgument("is a file; give it a name as in NAME=" + path);
  const std::string folder = WatchedFolder(path);
  if (std::ranges::find(found.folders, folder) != found.folders.end()) return Status::InvalidArgument("the folder is given before it");
  const Result<std::vector<fs::path>> files = VolumeFilesIn(folder);
  if (!files.ok()) return files.status();
  const std::size_t before = found.datasets.size() + found.complaints.size();
  AddContents(found, folder, *files);
  if (found.datasets.size() + found.complaints.size() == before) found.complaints.push_back(folder + ": no volume file in this folder yet");
  found.folders.push_back(folder);
  return Status::Ok();
}

Status CheckHeaders(const std::string& path) {
  const Result<VolumeSource> source = ParseVolumeSource(path);
  return source.ok() ? CheckVolumeHeaders(source->path, source->options).status() : source.status();
}

// Waits until the files were not changed for longer than a tick of the file system's clock. Then their stamp tells of every change from now
// on. Whoever writes them piece by piece is also likely to have come to an end.
void AwaitRest(const FileStamp& stamp) {
  constexpr std::chrono::milliseconds kRest(50);
  const auto age = std::chrono::system_clock::now() - stamp.newest;
  if (age >= age.zero() && age < kRest) std::this_thread::sleep_for(kRest - age);  // a clock that is ahead of ours tells nothing
}

}  // namespace

Result<DataArgument> ParseDataArgument(const std::string& argument) {
  const std::size_t equals = argument.find('=');
  DataArgument parsed;
  if (equals != std::string::npos) parsed.name = argument.substr(0, equals);
  parsed.path = equals == std::string::npos ? argument : argument.substr(equals + 1);
  const auto wrong = [&](const std::string& why) { return Status::InvalidArgument(Shown(argument) + ": " + why); };
  if (equals != std::string::npos) {
    if (Status name = CheckName(parsed.name); !name.ok()) return wrong(name.message());
  }
  if (parsed.path.empty() || parsed.path.size() > kMaxPathBytes) {
    return wrong(fmt::format("a path of {} bytes, must have 1 to {}", parsed.path.size(), kMaxPathBytes));
  }
  if (parsed.path.find('\0') != std::string::npos) return wrong("a path with a zero byte");
  return parsed;
}

std::string WatchedFolder(const std::string& path) {
  std::error_code error;
  const fs::path whole = fs::absolute(path, error).lexically_normal();
  return (whole.has_filename() || !whole.has_relative_path() ? whole : whole.parent_path()).string();
}

FoundData FindData(const std::vector<std::string>& arguments, const std::string& prefix) {
  FoundData found;
  std::vector<std::pair<std::string, DataArgument>> folders;
  const auto note = [&](const std::string& argument, const Status& status) {
    if (!status.ok()) found.errors.emplace_back(status.code(), prefix + Shown(argument) + ": " + status.message());
  };
  // What is named first: what lies in folders gives way.
  for (const std::string& argument : arguments) {
    const Result<DataArgument> parsed = ParseDataArgument(argument);
    if (!parsed.ok()) {
      found.errors.emplace_back(parsed.status().code(), prefix + parsed.status().message());
    } else if (parsed->name.empty()) {
      folders.emplace_back(argument, *parsed);
    } else {
      note(argument, AddNamed(found, *parsed));
    }
  }
  for (const auto& [argument, folder] : folders) note(argument, AddFolder(found, folder.path));
  return found;
}

Result<FoundData> ListFolder(const std::string& folder) {
  const Result<std::vector<fs::path>> files = VolumeFilesIn(folder);
  if (!files.ok()) return files.status();
  FoundData found;
  AddContents(found, folder, *files);
  return found;
}

void CheckFiles(FoundData& found) {
  for (const auto& [name, source] : found.datasets) {
    const Status readable = source.load ? Status::Ok() : CheckHeaders(source.path);
    if (readable.ok()) continue;
    if (source.folder.empty()) {
      // A damaged file is bad input, as a wrong name is.
      const StatusCode code = readable.code() == StatusCode::kDataLoss ? StatusCode::kInvalidArgument : readable.code();
      found.errors.emplace_back(code, fmt::format("dataset \"{}\": {}", name, readable.message()));
    } else {
      found.complaints.push_back(readable.message());
    }
  }
}

Result<LoadedSource> LoadSource(const DataSource& source) {
  if (source.load) {
    Result<std::shared_ptr<const Volume>> volume = source.load();
    if (!volume.ok()) return volume.status();
    return LoadedSource{*std::move(volume), nullptr};
  }
  const Result<VolumeSource> named = ParseVolumeSource(source.path);
  if (!named.ok()) return named.status();
  constexpr int kAttempts = 2;
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    Result<std::vector<std::string>> files = CheckVolumeHeaders(named->path, named->options);
    if (!files.ok()) return files.status();
    const Result<FileStamp> stamp = StampFiles(*std::move(files));
    if (!stamp.ok()) return stamp.status();
    AwaitRest(*stamp);
    const Result<LoadedVolume> read = ReadVolume(named->path, named->options);
    const Result<bool> changed = HaveChanged(*stamp);
    if (!changed.ok() || *changed) continue;
    if (!read.ok()) return read.status();
    return LoadedSource{read->volume, std::make_shared<const FileStamp>(*stamp)};
  }
  return Status::Unavailable(named->path + ": the file is being written; it is read again when it is asked for again");
}

}  // namespace slabstream
