#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "binpose/v1/detection_service.pb.h"

namespace binpose::client::cli {

/// What to search, for what, and how. Absent means the server's default.
struct ScanOptions {
  std::vector<std::string> model_ids;
  std::vector<std::string> scenes;
  std::optional<std::string> camera;
  std::vector<double> sensor;  ///< x, y, z in the scene's unit; empty: what the scan says itself
  v1::LengthUnit unit = v1::LENGTH_UNIT_UNSPECIFIED;
  std::optional<std::uint32_t> max_results;
  bool accept_ambiguous = false;
  std::optional<std::uint32_t> max_rejected;
  std::optional<double> min_score;
  std::optional<double> presence_score;
  std::optional<double> start_point_share;
  std::optional<double> normal_tolerance_degrees;
  bool keep_support_plane = false;
  v1::Effort effort = v1::EFFORT_UNSPECIFIED;
  std::optional<std::string> params;  ///< file of DetectParams as JSON
  std::optional<double> time_budget;  ///< seconds
};

/// The options of every search but --scene.
void add_search_options(CLI::App& command, ScanOptions& options);

/// Those, and --scene.
void add_scan_options(CLI::App& command, ScanOptions& options);

/// Reads a scene and makes the request for it; its request_id is the end of the scene's name.
absl::StatusOr<v1::DetectRequest> make_request(const ScanOptions& options, const std::string& scene);

/// What answers to this scene carry as their request_id.
std::string request_id_of(const std::string& scene);

}  // namespace binpose::client::cli
