#include "client/cli/picture_files.h"

#include "client/request/picture_record.h"

namespace slabstream {

Status PictureFiles::Put(const Picture& picture, const FrameJob& job) {
  PictureNotes notes{.geometry = picture.geometry, .key = picture.key, .record = {}};
  if (record_) {
    notes.record =
        RecordText(job.source, AsMade(job.request, picture.statistics), format_, picture.geometry, layers_, picture.statistics.levels);
  }
  return WritePicture(picture.image, picture.size, job.output, format_, notes);
}

}  // namespace slabstream
