#include "data/volume_io/output.h"

#include <fmt/format.h>
#include <zlib.h>

#include <cstddef>
#include <new>
#include <span>
#include <vector>

namespace slabstream {
namespace {

// Appends bytes to a file as one gzip member, which Finish ends.
class GzipStream {
 public:
  explicit GzipStream(OutputFile& file) : file_(file), out_(std::size_t{1} << 20) {
    constexpr int kGzipWindow = 15 + 16;
    if (deflateInit2(&stream_, Z_DEFAULT_COMPRESSION, Z_DEFLATED, kGzipWindow, 8, Z_DEFAULT_STRATEGY) != Z_OK) throw std::bad_alloc();
  }
  ~GzipStream() { deflateEnd(&stream_); }
  GzipStream(const GzipStream&) = delete;
  GzipStream& operator=(const GzipStream&) = delete;

  // At most 4 GiB at a time, since zlib counts in 32 bits.
  void Append(std::span<const std::byte> bytes) { Deflate(bytes, Z_NO_FLUSH); }
  void Finish() { Deflate({}, Z_FINISH); }

 private:
  void Deflate(std::span<const std::byte> bytes, int flush) {
    stream_.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(bytes.data()));
    stream_.avail_in = uInt(bytes.size());
    do {
      stream_.next_out = reinterpret_cast<Bytef*>(out_.data());
      stream_.avail_out = uInt(out_.size());
      (void)deflate(&stream_, flush);
      file_.Append(std::span(out_).first(out_.size() - stream_.avail_out));
    } while (stream_.avail_out == 0 && file_.ok());
  }

  OutputFile& file_;
  std::vector<std::byte> out_;
  z_stream stream_{};
};

}  // namespace

void AppendSamples(OutputFile& file, const FileSamples& samples) {
  samples.ForEachBlock([&](std::span<const std::byte> block) { file.Append(block); });
}

Status WriteHeaderAndSamples(const std::string& path, const std::string& header, const FileSamples& samples, Gzipped gzipped) {
  Result<OutputFile> file = OutputFile::Create(path);
  if (!file.ok()) return file.status();
  if (gzipped != Gzipped::kAll) file->Append(header);
  if (gzipped == Gzipped::kNothing) {
    AppendSamples(*file, samples);
    return file->Finish();
  }
  GzipStream stream(*file);
  if (gzipped == Gzipped::kAll) stream.Append(std::as_bytes(std::span(header)));
  samples.ForEachBlock([&](std::span<const std::byte> block) {
    if (file->ok()) stream.Append(block);
  });
  stream.Finish();
  return file->Finish();
}

std::string Numbers(const Vec3& v, const char* separator) { return fmt::format("{}{}{}{}{}", v.x, separator, v.y, separator, v.z); }

}  // namespace slabstream
