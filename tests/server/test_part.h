#pragma once

#include <string>

#include "binpose/v1/detection_service.pb.h"
#include "binpose/v1/model_service.pb.h"

/// A part made in code, and scans of it.
namespace binpose::server {

/// Binary STL of a block with an L-shaped outline, 60 x 40 x 20 units.
std::string l_block_stl();

/// An ID and the block in millimetres.
v1::TrainRequest train_request(const std::string& id);

/// A depth image in millimetres of the block, standing 400 mm before the camera on nothing.
v1::PointCloud block_scan();

/// The block's scan, to be searched for one model.
v1::DetectRequest detect_request(const std::string& request_id, const std::string& model_id);

}  // namespace binpose::server
