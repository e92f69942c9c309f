// What the schema says of the fields of a request (proto/slabstream/v1/about.proto). Private to those who include generated code.
#pragma once

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

#include <string>
#include <vector>

#include "slabstream/v1/about.pb.h"

namespace slabstream {

inline const v1::About& AboutOf(const google::protobuf::FieldDescriptor& field) { return field.options().GetExtension(v1::about); }

// The word of an enumerator: "cut-away" of CLIP_MODE_CUT_AWAY.
std::string WordOf(const google::protobuf::EnumValueDescriptor& value);
// The words of an enum, in the order of its numbers from 1 on.
std::vector<std::string> WordsOf(const google::protobuf::EnumDescriptor& choices);

// Gives each field that is left out its standard value, in messages that are there or that say `always`.
void FillAbsent(google::protobuf::Message& message);
template <class P>
P WithStandards(P message) {
  FillAbsent(message);
  return message;
}

}  // namespace slabstream
