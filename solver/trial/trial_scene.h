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

/// Throws Error with installation advice unless HasPhysics().
void RequirePhysics();

/// Mass, mass center and inertia about it, in the body's frame; kilograms and meters.
struct SolidMass {
  double mass_kg = 0.0;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();
};

/// Exact mass properties of closed meshes of uniform density: integrals over the tetrahedra of
/// faces and origin.
SolidMass MassOfSolids(const std::vector<TriangleMesh>& solids, double density_kg_m3);

struct TrialSceneOptions {
  double friction = 0.8;              ///< between hand and object, Coulomb
  double torsion_m = 0.005;           ///< torsional friction: MuJoCo's default
  double step_s = 0.002;              ///< integration step
  double joint_damping_Nms = 0.05;    ///< Nm s/rad, about each axis
  double joint_inertia_kg_m2 = 2e-4;  ///< added to each axis, for tendons and tissue
};

/// Motion of the hand's frame, in that frame, which acts on the object.
struct FrameMotion {
  Eigen::Vector3d field = Eigen::Vector3d::Zero();      ///< gravity minus acceleration, m/s^2
  Eigen::Vector3d turning = Eigen::Vector3d::Zero();    ///< angular velocity, rad/s
  Eigen::Vector3d turn_rate = Eigen::Vector3d::Zero();  ///< angular acceleration, rad/s^2
  double drag_per_s = 0.0;  ///< damping rate of the object's motion in the hand
};

/// A hand and an object for MuJoCo; const and shareable.
class TrialScene {
 public:
  /// Throws Error as RequirePhysics does, and with MuJoCo's message if it rejects the scene.
  /// Links turn as fitted at `rest`; they have springs about their first axis, up to its limit, and
  /// about the other two, of the second's stiffness. The object is a free body of convex `pieces`
  /// (its own frame, meters).
  TrialScene(const std::vector<MjcfLink>& links, const std::vector<GripContact>& contacts,
             const std::vector<TriangleMesh>& pieces, const SolidMass& mass,
             const Eigen::Isometry3d& hand_from_object, const TrialSceneOptions& options);
  ~TrialScene();
  TrialScene(const TrialScene&) = delete;
  TrialScene& operator=(const TrialScene&) = delete;

 private:
  friend class TrialRun;
  struct Model;
  std::unique_ptr<const Model> model_;
};

/// One simulation run; one per thread.
class TrialRun {
 public:
  /// Starts in the fitted pose, at rest. The scene must outlive this.
  explicit TrialRun(const TrialScene& scene);
  TrialRun(const TrialRun& other);  ///< continues from the state of `other`
  ~TrialRun();
  TrialRun& operator=(const TrialRun&) = delete;

  /// Advances by `seconds` (whole steps; the remainder is carried over). Springs pull links to
  /// their targets, and contact forces, which rotate with the links, press.
  void Advance(double seconds, const FrameMotion& motion);
  /// Sets the targets of all links but 0: parent_from_link, in order.
  void SetTargets(const std::vector<Eigen::Quaterniond>& targets);

  Eigen::Isometry3d HandFromObject() const;
  /// parent_from_link of all links but 0.
  std::vector<Eigen::Quaterniond> Joints() const;
  int Touching() const;   ///< current contacts of hand and object
  bool Unstable() const;  ///< MuJoCo has found invalid values

 private:
  struct Data;
  const TrialScene* scene_;
  std::unique_ptr<Data> data_;
};

}  // namespace holdfast
