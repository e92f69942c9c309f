// How programs lay volumes of several levels out in HDF5 files. hdf5_format.cpp has the only list.
#pragma once

#include <memory>
#include <string>

#include "common/base/status.h"
#include "data/hdf5/hdf5_file.h"
#include "data/sources/chunked_source.h"
#include "data/sources/read_context.h"
#include "data/volume_io/read_options.h"

namespace slabstream {

struct Hdf5Layout {
  bool (*recognises)(Hdf5File& file) = nullptr;
  // Errors of VolumeFormat::open.
  Result<Pyramid> (*read)(const std::shared_ptr<Hdf5File>& file, const ReadOptions& options, const SourceContext& context) = nullptr;
};

Hdf5Layout Imaris();
Hdf5Layout BigDataViewerHdf5();

// Files of FLASH. options.dataset names the variable. Errors of VolumeFormat::open.
bool IsFlash(AttributedFile& file);
Result<std::shared_ptr<VolumeSource>> OpenFlash(const std::shared_ptr<Hdf5File>& file, const ReadOptions& options,
                                                const SourceContext& context);

// How many names PREFIX0, PREFIX1, ... there are without a gap.
int CountNumbered(const std::vector<std::string>& names, const std::string& prefix);

}  // namespace slabstream
