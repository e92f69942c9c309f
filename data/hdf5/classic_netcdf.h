// Classic netCDF files (netCDF-3: CDF-1, CDF-2 and CDF-5): a header, and the samples of each variable in one piece, or in records.
#pragma once

#include <memory>
#include <string>

#include "common/base/status.h"
#include "data/hdf5/attributed_file.h"

namespace slabstream {

// NotFound, Unavailable: it cannot be opened. Errors of ReadNetcdfHeader.
Result<std::unique_ptr<AttributedFile>> OpenClassicNetcdf(const std::string& path);

}  // namespace slabstream
