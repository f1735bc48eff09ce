#include "tests/scenes/ray_scene.h"

#include <cstring>
#include <limits>

namespace binpose::scenes {
namespace {

RTCRay ray_from(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double length) {
  RTCRay ray{};
  ray.org_x = static_cast<float>(origin.x());
  ray.org_y = static_cast<float>(origin.y());
  ray.org_z = static_cast<float>(origin.z());
  ray.dir_x = static_cast<float>(direction.x());
  ray.dir_y = static_cast<float>(direction.y());
  ray.dir_z = static_cast<float>(direction.z());
  ray.tfar = static_cast<float>(length);
  ray.mask = ~0U;
  return ray;
}

}  // namespace

// One thread and one instruction set, so that every machine traces the same scene to the last bit.
RayScene::RayScene() : device_(rtcNewDevice("threads=1,isa=sse2")), scene_(rtcNewScene(device_)) {
  rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
}

RayScene::~RayScene() {
  rtcReleaseScene(scene_);
  rtcReleaseDevice(device_);
}

std::uint32_t RayScene::add(const Mesh& mesh, const Pose& T_scene_mesh) {
  RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                               3 * sizeof(float), mesh.vertices.size()));
  for (const Eigen::Vector3f& vertex : mesh.vertices) {
    const Eigen::Vector3f placed = (T_scene_mesh * vertex.cast<double>()).cast<float>();
    vertices = std::copy(placed.begin(), placed.end(), vertices);
  }
  void* triangles = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                            3 * sizeof(std::uint32_t), mesh.triangles.size());
  std::memcpy(triangles, mesh.triangles.data(), mesh.triangles.size() * 3 * sizeof(std::uint32_t));
  rtcCommitGeometry(geometry);
  const std::uint32_t object = rtcAttachGeometry(scene_, geometry);
  rtcReleaseGeometry(geometry);
  return object;
}

void RayScene::build() { rtcCommitScene(scene_); }

std::optional<RayHit> RayScene::cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const {
  RTCRayHit query{};
  query.ray = ray_from(origin, direction, std::numeric_limits<float>::infinity());
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(scene_, &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  const Eigen::Vector3d normal(query.hit.Ng_x, query.hit.Ng_y, query.hit.Ng_z);
  return RayHit{query.ray.tfar, normal.normalized(), query.hit.geomID};
}

bool RayScene::blocked(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const {
  RTCRay ray = ray_from(from, (to - from).normalized(), (to - from).norm());
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(scene_, &context, &ray);
  return ray.tfar < 0;  // this is how Embree says yes
}

bool RayScene::inside(const Eigen::Vector3d& point) const {
  // A direction that no face of a machined part is parallel to; the first surface met is left, not entered.
  const Eigen::Vector3d direction = Eigen::Vector3d(0.5377, 0.2911, 0.7913).normalized();
  const std::optional<RayHit> hit = cast(point, direction);
  return hit && hit->normal.dot(direction) > 0;
}

}  // namespace binpose::scenes
