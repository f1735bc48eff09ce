#pragma once

#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "core/model.h"

namespace binpose {

/// The stored members of a model as bytes: magic, format version, length, payload, SHA-256 of the payload.
/// Equal models give equal bytes on every machine.
std::string serialize_model(const Model& model);

/// The model of such bytes, its derived members rebuilt, its invariants checked anew.
///
/// @param bytes  hostile.
/// Errors: DATA_LOSS (truncated, foreign, wrong checksum, an index or a number out of range), UNIMPLEMENTED (a newer
/// format version).
absl::StatusOr<Model> parse_model(std::string_view bytes);

/// SHA-256 of the stored members, 64 hexadecimal digits.
std::string content_hash(const Model& model);

}  // namespace binpose
