// The series of a DICOM folder as `info` lists them: facts of the images, nothing of the patient.
#pragma once

#include <string>
#include <vector>

#include "common/json/json.h"
#include "data/volume_io/dicom_series.h"

namespace slabstream {

// The series that a source names (read_options.h), if it is DICOM; else none. Errors of ListDicomSeries.
Result<std::vector<DicomSeries>> SeriesAt(const std::string& source);

// Whether several of them are volumes, and the source does not say which is meant.
bool NeedsChoice(const std::vector<DicomSeries>& all, const std::string& source);

// A line each, below a line of headings; "" if there are none.
std::string SeriesText(const std::vector<DicomSeries>& all);
Json SeriesJson(const std::vector<DicomSeries>& all);

}  // namespace slabstream
