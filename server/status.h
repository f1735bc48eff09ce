#pragma once

#include <grpcpp/support/status.h>

#include <exception>
#include <new>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "binpose/v1/types.pb.h"

/// Core's errors as those of the wire; the codes are the same numbers.
namespace binpose::server {

grpc::Status to_grpc(const absl::Status& status);
v1::Error to_error(const absl::Status& status);

/// The same error, its message led by the field that it is about.
absl::Status in_field(const char* field, const absl::Status& error);
template <class Value>
absl::StatusOr<Value> in_field(const char* field, absl::StatusOr<Value> value) {
  return value.ok() ? std::move(value) : in_field(field, value.status());
}

/// What `compute` returns, a Status or StatusOr, or an error when it throws: neither memory that runs out nor a fault
/// in a library may end the server.
template <class Compute>
auto contain_exceptions(Compute&& compute) -> decltype(compute()) {
  try {
    return std::forward<Compute>(compute)();
  } catch (const std::bad_alloc&) {
    return absl::ResourceExhaustedError("The server has not enough memory for this request.");
  } catch (const std::exception& error) {
    return absl::InternalError(absl::StrCat("The server failed: ", error.what(), "."));
  }
}

}  // namespace binpose::server
