#include "client/cli/answer_text.h"

#include <algorithm>
#include <cmath>
#include <iostream>
#include <numbers>

#include "client/cli/style.h"
#include "client/cli/table.h"

namespace binpose::client::cli {
namespace {

struct RollPitchYaw {
  double roll = 0, pitch = 0, yaw = 0;  ///< degrees
};

/// R = Rz(yaw) Ry(pitch) Rx(roll).
RollPitchYaw roll_pitch_yaw(const v1::Quaternion& q) {
  constexpr double kDegrees = 180 / std::numbers::pi;
  const double sin_pitch = 2 * (q.w() * q.y() - q.z() * q.x());
  return {.roll = kDegrees * std::atan2(2 * (q.w() * q.x() + q.y() * q.z()), 1 - 2 * (q.x() * q.x() + q.y() * q.y())),
          .pitch = kDegrees * std::asin(std::clamp(sin_pitch, -1.0, 1.0)),
          .yaw = kDegrees * std::atan2(2 * (q.w() * q.z() + q.x() * q.y()), 1 - 2 * (q.y() * q.y() + q.z() * q.z()))};
}

double millimetres_per(v1::LengthUnit unit) { return unit == v1::LENGTH_UNIT_METRE ? 1000 : 1; }

Table hypothesis_table(const v1::DetectResponse& answer, double millimetres_per_unit) {
  Table table = {
      {"rank", "model", "x mm", "y mm", "z mm", "roll deg", "pitch deg", "yaw deg", "score", "visible", "confidence"}};
  for (const v1::PoseHypothesis& part : answer.hypotheses()) {
    const v1::Vector3& position = part.pose().position();
    const RollPitchYaw angles = roll_pitch_yaw(part.pose().orientation());
    table.push_back({std::to_string(table.size()), part.model_id(), fixed(position.x() * millimetres_per_unit, 2),
                     fixed(position.y() * millimetres_per_unit, 2), fixed(position.z() * millimetres_per_unit, 2),
                     fixed(angles.roll, 1), fixed(angles.pitch, 1), fixed(angles.yaw, 1), fixed(part.score(), 3),
                     fixed(part.visible_fraction(), 2), fixed(part.confidence(), 2)});
  }
  return table;
}

void print_warning(const std::string& sentence) {
  std::cout << coloured("warning: ", Colour::kYellow, stdout) << sentence << '\n';
}

/// Poses that the scan leaves open; one sentence for all.
void print_ambiguous(const v1::DetectResponse& answer) {
  std::string ranks;
  for (int i = 0; i < answer.hypotheses_size(); ++i) {
    if (answer.hypotheses(i).variants_size() > 0) ranks += (ranks.empty() ? "" : ", ") + std::to_string(i + 1);
  }
  if (ranks.empty()) return;
  print_warning("ambiguous: " + ranks + " may as well lie in one of the `variants` that --json lists.");
}

}  // namespace

void print_answer(const v1::DetectResponse& answer, const std::string& scene, v1::LengthUnit unit) {
  const v1::DetectStats& stats = answer.stats();
  const int count = answer.hypotheses_size();
  std::cout << scene << ": " << (count == 0 ? "nothing" : std::to_string(count)) << " found in "
            << fixed(1000 * stats.total_seconds(), 1) << " ms";
  if (stats.stop_reason() == v1::STOP_REASON_DEADLINE) std::cout << " (stopped early by the deadline)";
  if (stats.stop_reason() == v1::STOP_REASON_MAX_RESULTS) std::cout << " (the best of more)";
  std::cout << '\n';
  if (count > 0) print(hypothesis_table(answer, millimetres_per(unit)), std::cout);
  print_ambiguous(answer);
  for (const std::string& warning : answer.warnings()) print_warning(warning);
  std::cout << std::flush;
}

}  // namespace binpose::client::cli
