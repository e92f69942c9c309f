// Content codings of responses (RFC 9110, section 8.4.1): gzip, or none.
#pragma once

#include <string>
#include <string_view>

namespace slabstream {

// Whether a request with this Accept-Encoding takes gzip; of a request without one: "".
bool AcceptsGzip(std::string_view accept_encoding);

// As small as it gets: it may take milliseconds.
std::string Gzipped(std::string_view bytes);

}  // namespace slabstream
