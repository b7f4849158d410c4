// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <vector>

#include <Eigen/Geometry>

#include "geometry/mesh/mesh.h"
#include "solver/trial/trial_hand.h"

namespace holdfast {

/// Whether this build has MuJoCo.
bool HasPhysics();

/// Throws Error that says what to install unless HasPhysics().
void RequirePhysics();

/// Mass, mass center and inertia about it, in the body's frame; kilograms and meters.
struct SolidMass {
  double mass_kg = 0.0;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();
};

/// Of closed meshes filled with one density, exact: integrals over the tetrahedra of faces and
/// origin.
SolidMass MassOfSolids(const std::vector<TriangleMesh>& solids, double density_kg_m3);

/// A free body of convex pieces.
struct TrialObject {
  std::vector<TriangleMesh> pieces;  ///< in its own frame, meters
  SolidMass mass;
  Eigen::Isometry3d hand_from_object = Eigen::Isometry3d::Identity();  ///< as fitted
};

struct TrialSceneOptions {
  double friction = 0.8;              ///< of hand and object, Coulomb
  double torsion_m = 0.005;           ///< torsional friction: MuJoCo's default
  double step_s = 0.002;              ///< of the integration
  double joint_damping_Nms = 0.05;    ///< Nm s/rad, about each axis
  double joint_inertia_kg_m2 = 2e-4;  ///< added to each axis: tendons and tissue
};

/// What the object feels besides the hand, in the hand's frame, which may move.
struct FrameMotion {
  Eigen::Vector3d field = Eigen::Vector3d::Zero();      ///< gravity less acceleration, m/s^2
  Eigen::Vector3d turning = Eigen::Vector3d::Zero();    ///< angular velocity, rad/s
  Eigen::Vector3d turn_rate = Eigen::Vector3d::Zero();  ///< angular acceleration, rad/s^2
  double drag_per_s = 0.0;  ///< how fast the object's motion in the hand dies away
};

/// A hand and an object for MuJoCo; const and shareable.
class TrialScene {
 public:
  /// Throws Error as RequirePhysics does, and with MuJoCo's words where it refuses the scene.
  TrialScene(const std::vector<TrialLink>& links, const std::vector<GripContact>& contacts,
             const TrialObject& object, const TrialSceneOptions& options);
  ~TrialScene();
  TrialScene(const TrialScene&) = delete;
  TrialScene& operator=(const TrialScene&) = delete;

 private:
  friend class TrialRun;
  struct Model;
  std::unique_ptr<const Model> model_;
};

/// One course of events; one per thread.
class TrialRun {
 public:
  /// From the fitted pose, at rest. The scene must outlive it.
  explicit TrialRun(const TrialScene& scene);
  TrialRun(const TrialRun& other);  ///< goes on from where `other` is
  ~TrialRun();
  TrialRun& operator=(const TrialRun&) = delete;

  /// Advances by `seconds` (whole steps; what is left over is made up for next time). Links pull
  /// towards their targets by their stiffness and press by their contacts' forces, which turn with
  /// them.
  void Advance(double seconds, const FrameMotion& motion);
  /// Where links other than 0 should be: parent_from_link, in order.
  void SetTargets(const std::vector<Eigen::Quaterniond>& targets);

  Eigen::Isometry3d HandFromObject() const;
  /// parent_from_link of all links but 0.
  std::vector<Eigen::Quaterniond> Joints() const;
  int Touching() const;   ///< contacts of hand and object now
  bool Unstable() const;  ///< MuJoCo has found numbers that no simulation should have

 private:
  struct Data;
  const TrialScene* scene_;
  std::unique_ptr<Data> data_;
};

}  // namespace holdfast
