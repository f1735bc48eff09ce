#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "binpose/v1/detection_service.pb.h"
#include "client/client.h"

namespace binpose::client::cli {

/// Where to draw a result, and what more to draw into it.
struct ResultPageOptions {
  std::optional<std::string> page;  ///< HTML file to write
  std::vector<std::string> meshes;  ///< of the models, in their order; without: the points of each model
  v1::LengthUnit mesh_unit = v1::LENGTH_UNIT_UNSPECIFIED;
  std::optional<std::string> truth;  ///< file of true poses
};

void add_result_page_options(CLI::App& command, ResultPageOptions& options);

/// Poses below min_score that a page shows, unless the user asked for another number.
inline constexpr std::uint32_t kRejectedOnPage = 30;

/// Writes the page of a result. Asks the server for the models. Errors: those of the calls, and of files that cannot be
/// read or written.
absl::Status write_result_page(const ResultPageOptions& options, const v1::DetectRequest& request,
                               const v1::DetectResponse& answer, Client& client);

}  // namespace binpose::client::cli
