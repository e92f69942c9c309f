// The catalogue: which volumes a coordinator serves, by name, and how to load each. Clients name datasets; no request carries a path.
//
// What --data takes, any number of times:
//   NAME=PATH   one volume: a file, or a directory of slices; with options for reading it behind a question mark (read_options.h)
//   DIR         every volume file in DIR by its stem ("head.nii.gz" is "head"); a DIR of slices is one volume named as the directory;
//               if DIR holds nothing but directories, each that holds a volume
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/volume/volume.h"

namespace slabstream {

using VolumeLoader = std::function<Result<std::shared_ptr<const Volume>>()>;
using Catalogue = std::map<std::string, VolumeLoader>;

// Reads directories, opens no volume. InvalidArgument: a name that is empty, too long (kMaxNameBytes) or has other characters than letters,
// digits and "._-", a repeated name, a DIR without volumes, options that are wrong; NotFound: a path that does not exist. Messages name the
// argument.
Result<Catalogue> MakeCatalogue(const std::vector<std::string>& arguments);

}  // namespace slabstream
