// VolumeFormat: by what a format of volumes is recognised, and how it is read and written. Every format becomes a VolumeSource
// (data/sources): by `open`, or by where its samples lie (`locate`), or by decoding all of it (`read`). VolumeFormats()
// (data/open/open_source.h) has all formats; FileFormats() those whose files this folder reads (docs/adding.md).
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "data/volume_io/raw_volume.h"
#include "data/volume_io/read_options.h"

namespace slabstream {

class FileSamples;
class ReadContext;
class VolumeSource;

// What a file of a format keeps of a volume's geometry.
struct KeptGeometry {
  bool spacing = true;
  bool axes = true;                   // directions and origin
  bool patient = true, scene = true;  // that they are a patient's, or that they are not
  // Which units a file can state.
  std::vector<LengthUnit> units = {LengthUnit::kMillimetre, LengthUnit::kMicrometre, LengthUnit::kNanometre,
                                   LengthUnit::kAngstrom,   LengthUnit::kCentimetre, LengthUnit::kMetre};
};

struct VolumeFormat {
  std::string_view name;                  // "NIfTI"
  std::vector<std::string_view> endings;  // endings of files, in lower case: ".nii"
  // Whether a file with one of the endings is of this format, which shares the ending with another one. Null: it is.
  bool (*claims)(const std::string& path) = nullptr;
  std::string_view also = {};  // what else is read, for error texts: "a folder of .tif slices"
  // Whether this is of the format: a folder, or a file by its first bytes. Asked if no format claims the ending. Null: only endings count.
  bool (*recognises)(const std::string& path, const ReadOptions& options) = nullptr;
  std::vector<std::string_view> options = {};   // names of the options (ReadOptionList) that it takes
  std::vector<std::string_view> required = {};  // those of them without which it cannot be read
  std::vector<std::string_view> markers = {};  // objects of a store, at least one of which each volume has; none: it is no store of objects
  // Opens what is read in parts. Null: as `locate` or `read` say; also if it returns null. NotFound, Unavailable: it cannot be read.
  // InvalidArgument: it is no such volume, or needs something that is not supported, which the message names; an option that does not suit
  // it. DataLoss: damaged metadata. ResourceExhausted.
  Result<std::shared_ptr<VolumeSource>> (*open)(const std::string& path, const ReadOptions& options,
                                                const std::shared_ptr<ReadContext>& context) = nullptr;
  // Where the samples of a file lie, which are in one piece: binary, perhaps compressed. Null: they never are. InvalidArgument: not in this
  // file. Errors as of OpenSource (data/open/open_source.h).
  Result<LocatedSamples> (*locate)(const std::string& path, const ReadOptions& options) = nullptr;
  // Decodes the whole volume. Null: as `locate` says. Errors as of `locate`.
  Result<RawVolume> (*read)(const std::string& path, const ReadOptions& options) = nullptr;

  std::vector<std::string_view> written_endings = {};  // endings of files that can be written; none: it is only read
  // `path` ends in one of those. Errors as of WriteVolume (volume_writer.h).
  Status (*write)(const FileSamples& samples, const std::string& path) = nullptr;
  std::string (*second_file)(const std::string& path) = nullptr;  // which is written with `path`; "": none
  KeptGeometry keeps = {};                                        // by what is written
};

// Of files, or of folders of them.
const std::vector<VolumeFormat>& FileFormats();

// By the ending of a file or else by recognises(), the first one of `formats`. Null: none of them knows it.
const VolumeFormat* FindFormat(const std::vector<VolumeFormat>& formats, const std::string& path, const ReadOptions& options);
// Null: nothing is written with this ending.
const VolumeFormat* FindWritableFormat(const std::string& path);

// Whether a format of files knows what is there, and needs no options. What is read in parts alone may not be known.
bool LooksLikeVolumeFile(const std::string& path);
// "must end in .nii, .nii.gz, ... or be a folder of ..."
std::string ReadableText(const std::vector<VolumeFormat>& formats);
// What a file or folder is that users may bring and that no format reads, and what helps; "": nothing is known of it.
std::string_view WhyUnread(const std::string& path);
// The same of grids that may lie in an HDF5 file.
inline constexpr std::string_view kWhyNotExodus =
    "an Exodus file, which is not read; ParaView's Save Data writes its grid as .vtm or .vtpc, or meshio convert as .vtu";
inline constexpr std::string_view kWhyNotCgns = "a CGNS file, which is not read; ParaView's Save Data writes its grid as .vtm or .vtpc";
// ".nrrd, .mha, ..."
std::string WritableEndings();

// What a file of the format does not keep of the geometry, such as "the spacing 0.5 0.5 2"; "": it keeps all.
std::string WhatIsLost(const VolumeFormat& format, const VolumeGeometry& geometry);

// InvalidArgument, naming `path`: an option is given that the format does not take, or one is missing that it requires. Options of
// addresses (ReadOption::of_addresses) are those of every address, and of nothing else.
Status CheckOptions(const VolumeFormat& format, const std::string& path, const ReadOptions& options);

}  // namespace slabstream
