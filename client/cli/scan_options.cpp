#include "client/cli/scan_options.h"

#include <google/protobuf/util/json_util.h>

#include "client/cli/choice.h"
#include "client/read_file.h"
#include "client/scene.h"

namespace binpose::client::cli {
namespace {

absl::Status read_params(const std::string& path, v1::DetectParams& params) {
  const absl::StatusOr<std::string> text = read_file(path);
  if (!text.ok()) return text.status();
  const auto parsed = google::protobuf::util::JsonStringToMessage(*text, &params);
  if (parsed.ok()) return absl::OkStatus();
  return absl::InvalidArgumentError(
      path + " holds no DetectParams as JSON, such as {\"minScore\": 0.4}: " + std::string(parsed.message()));
}

}  // namespace

void add_scan_options(CLI::App& command, ScanOptions& options) {
  command
      .add_option("--scene", options.scenes,
                  "PLY or PCD file, depth image (with --camera), or a folder with camera.json and its depth image")
      ->required()
      ->type_name("FILE...");
  add_search_options(command, options);
}

void add_search_options(CLI::App& command, ScanOptions& options) {
  command.add_option("--model", options.model_ids, "IDs of the parts to look for")->required()->type_name("ID...");
  add_unit(command, options.unit, "Unit of the scene's lengths (of a depth image: of the answer's)");
  CLI::Option* camera =
      command.add_option("--camera", options.camera, "Camera file of depth images, JSON")->type_name("FILE");
  command
      .add_option("--sensor", options.sensor,
                  "Where the scan was taken from, in its frame and unit; default: a PCD file's VIEWPOINT, else 0 0 0")
      ->expected(3)
      ->type_name("X Y Z")
      ->excludes(camera);
  command.add_option("--max-results", options.max_results, "At most this many poses, best first");
  command.add_option("--min-score", options.min_score, "Leave out poses that score less, 0 to 1");
  command.add_option("--presence-score", options.presence_score,
                     "Answer none of a part of which no pose has a score x explained area as high, 0 to 1");
  command.add_flag("--accept-ambiguous", options.accept_ambiguous,
                   "Answer parts as well that may lie in one of several nearly alike poses");
  command.add_option("--max-rejected", options.max_rejected,
                     "Answer so many of those apart, in `rejected` of --json; --view asks for some by itself");
  command.add_option("--start-point-share", options.start_point_share,
                     "Share of the scene's points that the search starts from, above 0 to 1");
  command.add_option("--normal-tolerance", options.normal_tolerance_degrees,
                     "Largest angle between alike normals of scene and model, degrees");
  command.add_flag("--keep-support-plane", options.keep_support_plane,
                   "Search the plane that the parts lie on as well, instead of leaving it out");
  add_choice<v1::Effort>(
      command, "--effort", options.effort,
      {{"fast", v1::EFFORT_FAST}, {"balanced", v1::EFFORT_BALANCED}, {"thorough", v1::EFFORT_THOROUGH}},
      "How much of the scan is searched");
  command
      .add_option("--params", options.params,
                  "DetectParams as JSON, for what has no option here: regions, bin, plane, priors, ...")
      ->type_name("FILE");
  command.add_option("--time-budget", options.time_budget,
                     "Seconds after which the server answers the best that it has found so far");
}

std::string request_id_of(const std::string& scene) {
  constexpr std::size_t kMaxBytes = 256;
  return scene.size() <= kMaxBytes ? scene : scene.substr(scene.size() - kMaxBytes);
}

absl::StatusOr<v1::DetectRequest> make_request(const ScanOptions& options, const std::string& scene) {
  absl::StatusOr<v1::PointCloud> cloud = read_scene(scene, options.camera, options.unit);
  if (!cloud.ok()) return cloud.status();
  v1::DetectRequest request;
  request.set_request_id(request_id_of(scene));
  request.mutable_model_ids()->Add(options.model_ids.begin(), options.model_ids.end());
  *request.mutable_cloud() = *std::move(cloud);
  if (!options.sensor.empty()) {
    if (request.cloud().has_depth()) {
      return absl::InvalidArgumentError(scene +
                                        " is a depth image, seen from its camera at 0 0 0; leave out --sensor.");
    }
    v1::Vector3& position = *request.mutable_cloud()->mutable_sensor_position();
    position.set_x(options.sensor[0]);
    position.set_y(options.sensor[1]);
    position.set_z(options.sensor[2]);
  }
  if (options.params.has_value()) {
    if (absl::Status read = read_params(*options.params, *request.mutable_params()); !read.ok()) return read;
  }
  v1::DetectParams& params = *request.mutable_params();
  if (options.effort != v1::EFFORT_UNSPECIFIED) params.set_effort(options.effort);
  if (options.max_results.has_value()) params.set_max_results(*options.max_results);
  if (options.max_rejected.has_value()) params.set_max_rejected(*options.max_rejected);
  if (options.min_score.has_value()) params.set_min_score(*options.min_score);
  if (options.presence_score.has_value()) params.set_presence_score(*options.presence_score);
  if (options.start_point_share.has_value()) params.set_start_point_share(*options.start_point_share);
  if (options.normal_tolerance_degrees.has_value()) {
    params.set_normal_tolerance_degrees(*options.normal_tolerance_degrees);
  }
  if (options.accept_ambiguous) params.set_accept_ambiguous(true);
  if (options.keep_support_plane) params.set_remove_support_plane(false);
  if (options.time_budget.has_value()) request.set_time_budget_seconds(*options.time_budget);
  return request;
}

}  // namespace binpose::client::cli
