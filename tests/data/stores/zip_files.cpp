#include "tests/data/stores/zip_files.h"

#include <zip.h>

#include "common/base/check.h"

namespace slabstream {

void WriteZip(const std::string& path, const std::vector<ZipMember>& members) {
  int error = 0;
  zip_t* const archive = zip_open(path.c_str(), ZIP_CREATE | ZIP_TRUNCATE, &error);
  CHECK(archive != nullptr) << path << ": " << error;
  for (const ZipMember& member : members) {
    zip_source_t* const source = zip_source_buffer(archive, member.bytes.data(), member.bytes.size(), 0);
    CHECK(source != nullptr);
    const zip_int64_t number = zip_file_add(archive, member.name.c_str(), source, ZIP_FL_ENC_UTF_8);
    CHECK(number >= 0) << member.name;
    CHECK_EQ(zip_set_file_compression(archive, zip_uint64_t(number), member.deflated ? ZIP_CM_DEFLATE : ZIP_CM_STORE, 0), 0);
  }
  CHECK_EQ(zip_close(archive), 0) << path;
}

}  // namespace slabstream
