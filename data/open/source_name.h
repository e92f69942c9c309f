// The one rule by which sources get names: the name of the file or folder without its extensions, made safe. So head.nii.gz is "head",
// brain.ome.zarr is "brain", "t1 (2).nrrd" is "t1_2". `view`, `up`, watched folders and pictures of several files name by it.
//
// Looks at the file system only to tell files from folders. Any thread.
#pragma once

#include <span>
#include <string>
#include <vector>

namespace slabstream {

// `source`: a path or an address, with options for reading it or without (read_options.h). A name that CheckDatasetName
// (common/frame/dataset_name.h) accepts: runs of other characters become '_', and "volume" stands for a name of which nothing is left.
std::string NameOfSource(const std::string& source);

// The names of several, all different. If sources have the same name, one whose name needed no change keeps it, and the
// others get a number behind it: "head", "head-2", "head-3".
std::vector<std::string> NamesOfSources(std::span<const std::string> sources);

}  // namespace slabstream
