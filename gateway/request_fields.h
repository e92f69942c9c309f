// The fields of a request: of its address, and of a POST's body.
#pragma once

#include <string>
#include <string_view>

#include "client/request/picture_fields.h"
#include "common/base/status.h"
#include "common/http/http.h"
#include "gateway/target.h"

namespace slabstream {

// All but the token. InvalidArgument: the body.
Result<PictureFields> FieldsOf(const Target& target, const HttpRequest& request);

// Takes the field out. InvalidArgument: it is missing, or there are several.
Result<std::string> Take(PictureFields& fields, const std::string& name, std::string_view purpose);
// The same, but `usual` if it is missing.
Result<std::string> TakeOr(PictureFields& fields, const std::string& name, std::string_view usual);

// The dataset that these fields name. InvalidArgument: they name anything else.
Result<std::string> OnlyDataset(PictureFields fields);

}  // namespace slabstream
