// NRRD with its samples in the same file or in one other (.nrrd, .nhdr), raw or gzip.
#include <itkNrrdImageIO.h>

#include <array>
#include <filesystem>

#include "common/volume_io/itk_header.h"
#include "common/volume_io/raw_volume.h"
#include "common/volume_io/text_header.h"

namespace slabstream {
namespace {

// The value of a field that has two spellings.
std::optional<std::string> FindEither(const TextHeader& text, const std::string& one, const std::string& other) {
  const std::optional<std::string> found = text.Find(one);
  return found ? found : text.Find(other);
}

Result<Payload> FindPayload(const TextHeader& text, const std::string& path, std::int64_t sample_bytes) {
  const auto unsupported = [&](const std::string& what) { return Status::InvalidArgument(path + ": " + what); };
  Payload payload{.file = path, .offset = text.end};
  if (const auto file = FindEither(text, "data file", "datafile")) {
    if (file->starts_with("LIST") || file->find('%') != std::string::npos) {
      return unsupported("data file '" + *file + "': samples in several files are not supported");
    }
    payload.file = std::filesystem::path(path).parent_path() / *file;  // an absolute name stays as it is
    payload.offset = 0;
  }

  const std::string encoding = ToLower(text.Find("encoding").value_or(""));
  payload.compressed = encoding == "gzip" || encoding == "gz";
  if (!payload.compressed && encoding != "raw") return unsupported("encoding '" + encoding + "' is not supported, raw and gzip are");
  payload.big_endian = ToLower(text.Find("endian").value_or("little")) == "big";

  if (FindEither(text, "line skip", "lineskip").value_or("0") != "0") return unsupported("line skip is not supported");
  const std::string skip_text = FindEither(text, "byte skip", "byteskip").value_or("0");
  const std::optional<std::int64_t> skip = ToInteger(skip_text);
  if (!skip || *skip < -1 || (*skip == -1 && payload.compressed)) {
    return unsupported("byte skip '" + skip_text + "' must be at least 0, or -1 with raw samples");
  }
  if (*skip == -1) return FromTheEnd(payload, path, sample_bytes);
  (payload.compressed ? payload.skip : payload.offset) += *skip;
  return payload;
}

}  // namespace

Result<RawVolume> ReadNrrd(const std::string& path) {
  const Result<TextHeader> text = ReadTextHeader(path, ':', KeyCase::kLower, "");
  if (!text.ok()) return text.status();
  auto io = itk::NrrdImageIO::New();
  const Result<RawHeader> header = ReadItkHeader(*io, path, "NRRD");
  if (!header.ok()) return header.status();
  const Result<Payload> payload = FindPayload(*text, path, header->sample_bytes());
  if (!payload.ok()) return payload.status();
  return ReadSamples(path, *header, *payload);
}

}  // namespace slabstream
