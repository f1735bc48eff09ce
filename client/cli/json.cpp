#include "client/cli/json.h"

#include <google/protobuf/util/json_util.h>

#include <stdexcept>

namespace binpose::client::cli {
namespace {

std::string to_json(const google::protobuf::Message& message, bool with_defaults) {
  google::protobuf::util::JsonPrintOptions options;
  options.always_print_primitive_fields = with_defaults;
  std::string text;
  const auto status = google::protobuf::util::MessageToJsonString(message, &text, options);
  if (!status.ok()) throw std::runtime_error("the message cannot be written as JSON: " + status.ToString());
  return text;
}

}  // namespace

std::string answer_json(const google::protobuf::Message& answer) { return to_json(answer, true); }

std::string request_json(const google::protobuf::Message& request) { return to_json(request, false); }

}  // namespace binpose::client::cli
