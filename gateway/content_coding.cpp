#include "gateway/content_coding.h"

#include <zlib.h>

#include <algorithm>
#include <cctype>

#include "common/base/check.h"
#include "common/text/split.h"

namespace slabstream {
namespace {

std::string Plain(std::string_view text) {
  std::string plain;
  for (const char c : text) {
    if (c != ' ' && c != '\t') plain += char(std::tolower(static_cast<unsigned char>(c)));
  }
  return plain;
}

// "q=0", "q=0.000": not this one.
bool IsZero(std::string_view quality) {
  return quality.starts_with("q=0") && quality.substr(3).find_first_not_of(".0") == std::string_view::npos;
}

}  // namespace

bool AcceptsGzip(std::string_view accept_encoding) {
  bool any = false;  // "*" counts for what is not named
  for (const std::string_view item : Split(accept_encoding, ',')) {
    const std::string coding = Plain(item);
    const std::size_t end = std::min(coding.find(';'), coding.size());
    const std::string_view name = std::string_view(coding).substr(0, end);
    const bool takes = end == coding.size() || !IsZero(std::string_view(coding).substr(end + 1));
    if (name == "gzip" || name == "x-gzip") return takes;
    if (name == "*") any = takes;
  }
  return any;
}

std::string Gzipped(std::string_view bytes) {
  constexpr int kGzip = 16, kLargestWindow = 15, kMostMemory = 9;
  z_stream stream{};
  CHECK(::deflateInit2(&stream, Z_BEST_COMPRESSION, Z_DEFLATED, kGzip + kLargestWindow, kMostMemory, Z_DEFAULT_STRATEGY) == Z_OK);
  std::string out(::deflateBound(&stream, bytes.size()), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = uInt(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = uInt(out.size());
  CHECK(::deflate(&stream, Z_FINISH) == Z_STREAM_END);
  out.resize(stream.total_out);
  ::deflateEnd(&stream);
  return out;
}

}  // namespace slabstream
