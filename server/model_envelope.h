#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "core/model.h"

/// The bytes of a model file: what the server knows about a model, before the model itself as core/io/model_file.h
/// writes it. One SHA-256 covers all of it. The ID is the file's name only, so that files can be copied and renamed.
namespace binpose::server {

/// A model as it is kept and served; immutable.
struct StoredModel {
  std::string id;
  std::uint32_t generation = 0;  ///< counts up from 1 with every training of the ID
  std::chrono::sys_seconds create_time;
  std::string content_hash;  ///< binpose::content_hash(model)
  std::size_t file_bytes = 0;
  Model model;
};

/// Heeds generation, time and model.
std::string seal_envelope(const StoredModel& stored);

/// The model of such bytes.
///
/// @param bytes  hostile.
/// Errors: DATA_LOSS (truncated, foreign, wrong checksum), UNIMPLEMENTED (a newer format version).
absl::StatusOr<StoredModel> open_envelope(std::string_view id, std::string_view bytes);

}  // namespace binpose::server
