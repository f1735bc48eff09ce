#pragma once

#include <string>

#include "binpose/v1/detection_service.pb.h"

namespace binpose::client::cli {

/// Prints what was found in a scene: a line, a table of poses in millimetres and degrees, and the warnings.
///
/// @param unit  of the scene's lengths and so of the answer's.
void print_answer(const v1::DetectResponse& answer, const std::string& scene, v1::LengthUnit unit);

}  // namespace binpose::client::cli
