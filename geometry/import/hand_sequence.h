// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/import/fields.h"
#include "geometry/import/scene_objects.h"

namespace holdfast {

/// What the root of a MANO hand rotates about, and what its translation is.
enum class HandRoot {
  kWrist,        ///< MANO: x = R (v - J_0) + J_0 + t
  kWristPlaced,  ///< manopth with center_idx = 0: t is the position of the wrist
  kOrigin,       ///< EasyMocap: x = R_h v + t, with R_h outside of the model
};

/// How a data set stores hands.
struct HandLayout {
  std::string_view name;
  HandRoot root = HandRoot::kWrist;
  /// Fingers: principal components on top of the mean hand, else complete angles.
  bool coefficients = false;
  std::string_view world;  ///< description of the frame of its positions
  UpAxis up = UpAxis::kZ;
};

struct HandFrame {
  Eigen::Vector3d orient;  ///< of the root in the world, axis-angle
  Eigen::VectorXd fingers;
  Eigen::Vector3d trans;
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();  ///< R_h of kOrigin, axis-angle
};

/// The frames of one hand with its object, as read from a data set.
struct HandSequence {
  HandLayout layout;
  std::filesystem::path path;
  Side side = Side::kRight;
  std::vector<std::optional<HandFrame>> frames;  ///< none: a frame without a hand
  std::vector<Eigen::Isometry3d> object;         ///< none, one that stands, or one for each frame
  std::string object_name;
  /// Where the object's mesh may be, relative to the root of the data set.
  std::vector<std::string> meshes;
  double mesh_scale = 1.0;  ///< meters per unit of it
  Eigen::VectorXd betas;
  std::optional<double> rate_hz;  ///< if the file states it
  ImportedClip imported;          ///< its notes, and what is left out
};

/// Side that the user asks for, by --hands or by the model of a hand; nullopt if neither says.
std::optional<Side> WantedHand(const ParameterOptions& options);
/// The hand to take from a file that has a right, a left or both hands: the one asked for, else the
/// only one, else the right one, with a note.
Side ChooseHand(bool has_right, bool has_left, const ParameterOptions& options,
                ImportedClip& imported);

/// Takes the shape from an array of betas, the mean of its rows, unless the sequence has one.
void TakeBetas(const Fields& fields, std::string_view name, HandSequence& sequence);

/// Chooses the object that the hand holds, by ChooseObject, of objects with one pose for each frame
/// of the sequence. Returns whether there is one.
bool ChooseObjectOfHand(std::vector<SceneObject> objects, const ParameterOptions& options,
                        HandSequence& sequence);

/// Makes the clip of a hand alone. Frames without a hand get the nearest one, with a warning that
/// names them. The world is turned by the layout's up axis. Throws Error for coefficients without
/// --hand-model, for a sequence without any hand, and for an object with another number of frames.
ImportedClip ClipOfHand(HandSequence sequence, const ParameterOptions& options);

}  // namespace holdfast
