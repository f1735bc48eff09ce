#include "client/camera.h"

#include <google/protobuf/struct.pb.h>
#include <google/protobuf/util/json_util.h>

#include <cmath>

#include "client/read_file.h"

namespace binpose::client {
namespace {

constexpr double kMaxSidePixels = 65536;  // a row or column of any depth camera

/// Takes the numbers of a JSON object; the first fault is remembered.
class Fields {
 public:
  Fields(const google::protobuf::Struct& object, std::string file) : object_(object), file_(std::move(file)) {}

  double number(const std::string& name, double low, double high) {
    const auto field = object_.fields().find(name);
    if (field == object_.fields().end() || field->second.kind_case() != google::protobuf::Value::kNumberValue) {
      fail("lacks the number " + name);
      return 0;
    }
    const double value = field->second.number_value();
    if (!(value >= low && value <= high)) {
      fail("has " + name + " = " + std::to_string(value) + "; it must lie in [" + std::to_string(low) + ", " +
           std::to_string(high) + "]");
      return 0;
    }
    return value;
  }

  std::uint32_t count(const std::string& name) {
    const double value = number(name, 1, kMaxSidePixels);
    if (std::floor(value) != value) fail("has " + name + " = " + std::to_string(value) + "; it must be a whole number");
    return static_cast<std::uint32_t>(value);
  }

  std::string text(const std::string& name) const {
    const auto field = object_.fields().find(name);
    return field == object_.fields().end() ? "" : field->second.string_value();
  }

  const absl::Status& status() const { return status_; }

 private:
  void fail(const std::string& fault) {
    if (status_.ok()) status_ = absl::InvalidArgumentError(file_ + " " + fault + ".");
  }

  const google::protobuf::Struct& object_;
  const std::string file_;
  absl::Status status_;
};

}  // namespace

absl::StatusOr<Camera> read_camera(const std::filesystem::path& path) {
  const absl::StatusOr<std::string> text = read_file(path);
  if (!text.ok()) return text.status();
  google::protobuf::Struct object;
  if (!google::protobuf::util::JsonStringToMessage(*text, &object).ok()) {
    return absl::InvalidArgumentError(path.string() + " is no JSON object.");
  }
  Fields fields(object, path.string());
  Camera camera;
  camera.width = fields.count("width");
  camera.height = fields.count("height");
  camera.intrinsics.set_fx(fields.number("fx", 1e-3, 1e6));
  camera.intrinsics.set_fy(fields.number("fy", 1e-3, 1e6));
  camera.intrinsics.set_cx(fields.number("cx", -1e6, 1e6));
  camera.intrinsics.set_cy(fields.number("cy", -1e6, 1e6));
  camera.millimetres_per_step = fields.number("depth_unit_mm", 1e-6, 1e6);
  camera.depth_file = fields.text("depth_file");
  if (!fields.status().ok()) return fields.status();
  return camera;
}

}  // namespace binpose::client
