// What a request says: its target, "/api/v1/render.png?dataset=head&azimuth=30", and the fields of it and of a POST's body. Pure.
#pragma once

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>

#include "client/request/picture_fields.h"
#include "common/base/printable.h"
#include "common/base/status.h"
#include "common/http/http.h"

namespace slabstream {

struct Target {
  std::string path;      // as it stands: the gateway's own paths need no escapes
  PictureFields fields;  // decoded; in their order
};

// InvalidArgument: no path, a '%' that is no escape, or more than kMaxPictureFields fields.
Result<Target> ParseTarget(std::string_view text);

// All but the token, and those of a body in JSON unless it is empty. InvalidArgument: the body.
Result<PictureFields> FieldsOf(const Target& target, std::string_view body);

// Takes fields out by their names. The first mistake stays, and what is taken after it does not matter.
class FieldReader {
 public:
  explicit FieldReader(PictureFields fields) : fields_(std::move(fields)) {}

  bool Has(std::string_view name) const { return std::ranges::find(fields_, name, &PictureField::name) != fields_.end(); }
  // The text of a field that is there once; one that may be missing is `usual` then.
  std::string Need(const std::string& name, std::string_view purpose);
  std::string Get(const std::string& name, std::string_view usual) { return Has(name) ? Need(name, "") : std::string(usual); }
  // The dataset, when all other fields have been taken.
  std::string Dataset();
  void NothingElse();
  const PictureFields& rest() const { return fields_; }

  // What was made of a text that was taken.
  template <class T>
  T Value(Result<T> made) {
    Check(made.status());
    return made.ok() ? *std::move(made) : T();
  }
  void Check(const Status& status) {
    if (status_.ok()) status_ = Printable(status);
  }
  void Refuse(std::string why) { Check(Status::InvalidArgument(std::move(why))); }
  const Status& status() const { return status_; }  // the first mistake

 private:
  PictureFields fields_;
  Status status_;
};

}  // namespace slabstream
