#include "data/volume_io/formats.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "common/base/find_named.h"
#include "common/text/url.h"
#include "data/volume_io/output.h"
#include "data/volume_io/text_header.h"

namespace slabstream {

// Each in the file of its format.
VolumeFormat Nifti();
VolumeFormat Mgh();
VolumeFormat Nrrd();
VolumeFormat MetaImage();
VolumeFormat Tiff();
VolumeFormat Dicom();
VolumeFormat Mrc();
VolumeFormat VtkLegacy();
VolumeFormat VtkImage();
VolumeFormat VtkRectilinear();
VolumeFormat UnstructuredGrid();
VolumeFormat Npy();
VolumeFormat Png();
VolumeFormat Jpeg();
VolumeFormat Jpeg2000();
VolumeFormat Bmp();
VolumeFormat Bov();
VolumeFormat Raw();

const std::vector<VolumeFormat>& FileFormats() {
  static const std::vector<VolumeFormat> formats = {
      Nifti(), Mgh(), Nrrd(), MetaImage(), Tiff(), Dicom(), Mrc(), UnstructuredGrid(), VtkLegacy(), VtkImage(), VtkRectilinear(),
      Npy(),   Png(), Jpeg(), Jpeg2000(),  Bmp(),  Bov(),   Raw()};
  return formats;
}

namespace {

bool EndsInOneOf(const std::string& path, const std::vector<std::string_view>& endings) {
  const std::string lower = ToLower(path);
  return std::ranges::any_of(endings, [&](std::string_view ending) { return lower.ends_with(ending); });
}

constexpr std::string_view kWhyNotOpenFoam =
    "a case of OpenFOAM, which is not read; foamToVTK writes its grids as .vtm or .vtk, ParaView's Save Data as .vtm";

std::string Joined(const std::vector<std::string_view>& texts) { return fmt::format("{}", fmt::join(texts, ", ")); }

}  // namespace

const VolumeFormat* FindFormat(const std::vector<VolumeFormat>& formats, const std::string& path, const ReadOptions& options) {
  std::error_code error;
  auto found = formats.end();
  if (!std::filesystem::is_directory(path, error)) {
    found = std::ranges::find_if(formats, [&](const VolumeFormat& format) {
      return EndsInOneOf(path, format.endings) && (format.claims == nullptr || format.claims(path));
    });
  }
  if (found == formats.end()) {
    found = std::ranges::find_if(
        formats, [&](const VolumeFormat& format) { return format.recognises != nullptr && format.recognises(path, options); });
  }
  return found == formats.end() ? nullptr : &*found;
}

bool LooksLikeVolumeFile(const std::string& path) {
  const VolumeFormat* const format = FindFormat(FileFormats(), path, {});
  std::error_code error;
  return format != nullptr && format->required.empty() && std::filesystem::exists(path, error);
}

std::string_view WhyUnread(const std::string& path) {
  struct Unread {
    std::vector<std::string_view> endings;
    std::string_view why;
  };
  static const std::vector<Unread> files = {
      {{".pvtp", ".pvtk"},
       "a list of VTK files, which is not read; ParaView writes what it holds into one .vti, .vtr or .vtu, or open a file of the list"},
      {{".vtp"}, "a surface of VTK (PolyData), which holds no volume"},
      {{".e", ".exo", ".ex2", ".g"}, kWhyNotExodus},
      {{".cgns"}, kWhyNotCgns},
      {{".foam"}, kWhyNotOpenFoam},
      {{".vdb"}, "an OpenVDB file, which is not read; pyopenvdb's copyToArray and numpy.save write a grid as .npy"},
      {{".bp", ".bp4", ".bp5"}, "output of ADIOS2, which is not read; openpmd-pipe copies what openPMD wrote to .h5"},
      {{".case", ".encas"}, "an EnSight file, which is not read; ParaView's Save Data writes its grid as .vtm"}};
  std::error_code error;
  if (std::filesystem::exists(std::filesystem::path(path) / "system" / "controlDict", error)) return kWhyNotOpenFoam;
  const auto found = std::ranges::find_if(files, [&](const Unread& unread) { return EndsInOneOf(path, unread.endings); });
  return found == files.end() ? "" : found->why;
}

const VolumeFormat* FindWritableFormat(const std::string& path) {
  const auto found =
      std::ranges::find_if(FileFormats(), [&](const VolumeFormat& format) { return EndsInOneOf(path, format.written_endings); });
  return found == FileFormats().end() ? nullptr : &*found;
}

std::string ReadableText(const std::vector<VolumeFormat>& formats) {
  std::vector<std::string_view> endings, others;
  for (const VolumeFormat& format : formats) {
    for (const std::string_view ending : format.endings) {
      if (std::ranges::find(endings, ending) == endings.end()) endings.push_back(ending);
    }
    if (!format.also.empty()) others.push_back(format.also);
  }
  return fmt::format("must end in {}, or be {}", Joined(endings), fmt::join(others, ", or "));
}

std::string WritableEndings() {
  std::vector<std::string_view> endings;
  for (const VolumeFormat& format : FileFormats())
    endings.insert(endings.end(), format.written_endings.begin(), format.written_endings.end());
  return Joined(endings);
}

std::string WhatIsLost(const VolumeFormat& format, const VolumeGeometry& geometry) {
  const auto& [spacing, axes, patient, scene, units] = format.keeps;
  const World world = geometry.orientation.world;
  std::vector<std::string> lost;
  if (!spacing && geometry.spacing != Vec3{1, 1, 1}) lost.push_back("the spacing " + Numbers(geometry.spacing, ","));
  const std::optional<LengthUnit> unit = geometry.orientation.unit;
  if (unit && std::ranges::count(units, *unit) == 0) lost.push_back(fmt::format("the unit {}", NameOf(*unit)));
  if (!axes && world != World::kVoxels) lost.emplace_back("the origin and the directions of the axes");
  if (axes && !patient && world == World::kPatient) lost.emplace_back("that the axes are a patient's: right, anterior, superior");
  if (axes && !scene && world == World::kScene) lost.emplace_back("that the axes are not a patient's");
  return fmt::format("{}", fmt::join(lost, ", nor "));
}

Status CheckOptions(const VolumeFormat& format, const std::string& path, const ReadOptions& options) {
  for (const ReadOption& option : ReadOptionList()) {
    const bool taken = option.of_all || (option.of_addresses ? IsUrl(path) : std::ranges::count(format.options, option.name) > 0);
    if (!option.given(options) || taken) continue;
    const std::string takes = format.options.empty() ? "takes none" : "takes " + Joined(format.options);
    return Status::InvalidArgument(fmt::format("{}: {} is no option of {}, which {}", path, option.name, format.name, takes));
  }
  std::string flags, suffix;
  for (const std::string_view name : format.required) {
    const ReadOption& option = *FindNamed(ReadOptionList(), name);
    if (option.given(options)) continue;
    flags += fmt::format(" --{} {}", name, option.value);
    suffix += fmt::format("{}{}={}", suffix.empty() ? '?' : ',', name, option.value);
  }
  if (!flags.empty()) {
    return Status::InvalidArgument(fmt::format("{}: {} files need{}, or in --data {}{}", path, format.name, flags, path, suffix));
  }
  return Status::Ok();
}

}  // namespace slabstream
