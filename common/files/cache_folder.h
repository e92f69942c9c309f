// The folder of what programs keep for later runs and could make again: slabstream/ in $XDG_CACHE_HOME, or else in ~/.cache. What lies
// there holds voxels of files that others may not read. So it is for its user alone: folders are 0700, files 0600.
#pragma once

#include <string>

#include "common/base/status.h"

namespace slabstream {

// Looks at no file. NotFound: neither XDG_CACHE_HOME nor HOME is an absolute path.
Result<std::string> CacheFolder();

// Makes a folder, and those that it is in, for this user alone. If it is there, or the cache folder that it is in, others lose their rights
// to it and to all in it. Unavailable, naming the folder: it cannot be made, belongs to another user, or could be written by everybody, so
// that others may have put something there; or others keep their rights, as on some network drives.
Status MakeOwnFolder(const std::string& folder);

// Takes the rights of others to all in a folder from them, as far as that is possible. Links are not followed.
void TakeRightsOfOthers(const std::string& folder);

}  // namespace slabstream
