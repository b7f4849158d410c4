// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string_view>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "generator/actions/face_marks.h"
#include "generator/actions/object_marks.h"

namespace holdfast {

/// A place of an object and the place at the head that an action brings it to.
struct FacePlace {
  Eigen::Vector3d mark = Eigen::Vector3d::Zero();   ///< object's frame, metres
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< head's frame (FaceMarks), metres
};

/// What the scripts of the actions ask for (WriteDrink and the others), for an object that is
/// where `head_from_object` has it: drink and toast, the rim's nearest place to the lips; eat, an
/// end of something long, the near side of anything else to the mouth; call, the phone's upper end
/// to the right ear; takepicture, the middle to the line of sight, as far off as it is, within
/// bounds; brush, the bristles to the teeth. Nothing for actions that bring nothing to the face.
std::optional<FacePlace> FacePlaceOf(std::string_view action, const ObjectMarks& object,
                                     const FaceMarks& face,
                                     const Eigen::Isometry3d& head_from_object);

}  // namespace holdfast
