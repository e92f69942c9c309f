// Addresses as other programs spell them.
#pragma once

#include <string>
#include <string_view>

#include "common/base/status.h"

namespace slabstream {

// The path of a file, or an address (IsUrl, common/text/url.h), that `text` names. `text` begins with a scheme and has no query.
//
//   zarr://URL, zarr2://, zarr3://, n5://, precomputed://    URL: which format it is, is seen there
//   URL|zarr3:PATH|, and so on                               URL/PATH
//   gs://BUCKET/PATH, gcs://                                 https://storage.googleapis.com/BUCKET/PATH
//   s3+https://HOST/BUCKET/PATH                              s3://BUCKET/PATH?endpoint=https://HOST
//   file:///PATH                                             /PATH, with %XX decoded
//
// InvalidArgument: another scheme; the message says what to write, where that is known.
Result<std::string> WithoutOtherSpellings(std::string_view text);

}  // namespace slabstream
