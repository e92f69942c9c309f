// The fields and times of a dataset, by what its source says, and where each of them is read.
#pragma once

#include <memory>

#include "common/volume/field_info.h"
#include "data/catalogue/data_source.h"
#include "data/sources/volume_source.h"

namespace slabstream {

// `info`: of the source as it is opened. A channel or time that the source's text names is the only one. Null: there is one field at one
// time.
std::shared_ptr<const DatasetFields> FieldsOf(const DataSource& source, const SourceInfo& info);

// Where a field is read at a time. Both are some of `fields`. `statistics`: DataSource::statistics at another time than the
// dataset's own; else null.
DataSource AtFieldAndTime(const DataSource& source, const DatasetFields& fields, int field, int time,
                          std::shared_ptr<const VolumeSummary> statistics);

}  // namespace slabstream
