#pragma once

#include <google/protobuf/message.h>

#include <string>

namespace binpose::client::cli {

/// A message as one line of proto3 JSON. An answer spells out its zeros and empty lists, so that scripts find every
/// name; a request leaves them out, because there absent means the default.
std::string answer_json(const google::protobuf::Message& answer);
std::string request_json(const google::protobuf::Message& request);

}  // namespace binpose::client::cli
