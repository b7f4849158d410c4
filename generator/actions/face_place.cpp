// SPDX-License-Identifier: MIT
#include "generator/actions/face_place.h"

#include <algorithm>

namespace holdfast {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr double kOffSkin_m = 0.003;
constexpr double kNearLens_m = 0.13, kFarLens_m = 0.2, kNearScreen_m = 0.26, kFarScreen_m = 0.38;

// Of a circle around the object's z axis, the point nearest to a place.
Vector3d RimTowards(const ObjectMarks& object, const Vector3d& place) {
  Vector3d out = place - object.rim;
  out.z() = 0.0;
  if (out.squaredNorm() < 1e-12) return object.rim;
  return object.rim + object.rim_radius * out.normalized();
}

}  // namespace

std::optional<FacePlace> FacePlaceOf(std::string_view action, const ObjectMarks& object,
                                     const FaceMarks& face, const Isometry3d& head_from_object) {
  const Vector3d mouth = face.mouth + Vector3d(0.0, 0.0, kOffSkin_m);
  if (action == "drink" || action == "toast") {
    const Vector3d lips = mouth + Vector3d(0.0, -0.004, 0.0);
    return FacePlace{RimTowards(object, head_from_object.inverse() * lips), lips};
  }
  if (action == "eat") {
    if (object.size.x() > 2.0 * object.size.y()) return FacePlace{object.tip, mouth};
    const Vector3d in_object = head_from_object.inverse() * mouth;
    const Vector3d out = (in_object - object.middle).normalized();
    return FacePlace{object.middle + 0.5 * object.size.head<2>().maxCoeff() * out, mouth};
  }
  if (action == "call") {
    return FacePlace{object.tip, face.right_ear + Vector3d(-0.006, -0.004, 0.004)};
  }
  if (action == "takepicture") {
    const bool flat = object.size.z() < 0.3 * object.size.x();
    Vector3d place = face.eyes + Vector3d(0.0, -0.02, 0.0);
    place.z() = std::clamp((head_from_object * object.middle).z(),
                           face.eyes.z() + (flat ? kNearScreen_m : kNearLens_m),
                           face.eyes.z() + (flat ? kFarScreen_m : kFarLens_m));
    return FacePlace{object.middle, place};
  }
  if (action == "brush") return FacePlace{object.tip, mouth};
  return std::nullopt;
}

}  // namespace holdfast
