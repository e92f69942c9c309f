#include "data/open/source_name.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <map>
#include <set>
#include <string_view>
#include <system_error>

#include "common/frame/dataset_name.h"
#include "common/text/url.h"
#include "data/volume_io/read_options.h"

namespace slabstream {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kRoomForNumber = 16;  // behind a name: "-2", or "@" and a time

bool DropEnding(std::string& name, std::string_view ending) {
  const auto equal = [](unsigned char a, unsigned char b) { return std::tolower(a) == b; };
  const bool has = name.size() > ending.size() && std::equal(ending.begin(), ending.end(), name.end() - std::ptrdiff_t(ending.size()),
                                                             [&](char b, char a) { return equal(a, b); });
  if (has) name.resize(name.size() - ending.size());
  return has;
}

// A dot, a letter, and a few more letters and digits: not the end of "1.2.840" or of "scan.2024".
void DropExtension(std::string& name) {
  constexpr std::size_t kMostLetters = 12;
  const std::size_t dot = name.rfind('.');
  if (dot == std::string::npos || dot == 0 || dot + 1 == name.size() || name.size() - dot - 1 > kMostLetters) return;
  const auto is_word = [](unsigned char c) { return std::isalnum(c) != 0; };
  if (std::isalpha(static_cast<unsigned char>(name[dot + 1])) == 0 ||
      !std::all_of(name.begin() + std::ptrdiff_t(dot) + 1, name.end(), is_word))
    return;
  name.resize(dot);
}

// A folder's name may hold dots that begin no extension, such as "Smith.John".
std::string WithoutExtensions(std::string name, bool is_folder) {
  if (is_folder) {
    for (const std::string_view store : {".zarr", ".n5", ".precomputed"}) {
      if (DropEnding(name, store)) break;
    }
  } else {
    for (const std::string_view packed : {".gz", ".bz2", ".zst", ".xz", ".br"}) {
      if (DropEnding(name, packed)) break;
    }
    DropExtension(name);
  }
  (void)DropEnding(name, ".ome");
  return name;
}

std::string LastPart(std::string path) {
  while (path.ends_with('/')) path.pop_back();
  return path.substr(path.rfind('/') + 1);
}

// As the file or folder is called, without extensions.
std::string StemOf(const std::string& source) {
  const Result<SourceText> parsed = ParseSourceText(source);
  const std::string path = parsed.ok() ? parsed->path : source;
  if (IsUrl(path)) return WithoutExtensions(LastPart(DecodedPath(path.substr(0, path.find('?')))), false);
  std::error_code error;
  return WithoutExtensions(LastPart(fs::absolute(path, error).lexically_normal().string()), fs::is_directory(path, error));
}

bool IsAllowed(char c) { return CheckDatasetName(std::string(1, c)).ok(); }

std::string Safe(const std::string& stem) {
  std::string name;
  bool replaces = false;  // the last character
  for (const char c : stem) {
    if (IsAllowed(c)) {
      name += c;
    } else if (!replaces && !name.empty()) {
      name += '_';
    }
    replaces = !IsAllowed(c);
  }
  if (replaces && name.ends_with('_')) name.pop_back();
  name.erase(0, std::min(name.find_first_not_of(".-"), name.size()));  // a dot hides, a dash begins an option
  name.resize(std::min(name.size(), kMaxNameBytes - kRoomForNumber));
  return name.empty() ? "volume" : name;
}

}  // namespace

std::string NameOfSource(const std::string& source) { return Safe(StemOf(source)); }

std::vector<std::string> NamesOfSources(std::span<const std::string> sources) {
  std::vector<std::string> names(sources.size()), safe(sources.size());
  std::set<std::string> taken;
  for (std::size_t i = 0; i < sources.size(); ++i) {
    const std::string stem = StemOf(sources[i]);
    safe[i] = Safe(stem);
    if (safe[i] == stem && taken.insert(stem).second) names[i] = stem;
  }
  std::map<std::string, int> numbers;  // the last one behind each name
  for (std::size_t i = 0; i < sources.size(); ++i) {
    if (!names[i].empty()) continue;
    names[i] = safe[i];
    for (int& number = numbers.emplace(safe[i], 1).first->second; !taken.insert(names[i]).second;) {
      names[i] = safe[i] + "-" + std::to_string(++number);
    }
  }
  return names;
}

}  // namespace slabstream
