// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "geometry/body/body_model.h"
#include "solver/markers/marker_names.h"
#include "solver/terms/body/marker_terms.h"
#include "solver/terms/body/posture_terms.h"

namespace holdfast {

/// Of a marker's middle over the skin: 8 mm on average, 8 mm standard deviation between recordings
/// and 3 mm between the markers of one.
constexpr double kMarkerHeight_m = 0.008, kMarkerHeightSigma_m = 0.008, kOnSkinSigma_m = 0.003;

/// What legs do that no marker is on.
enum class RestPosture { kSeated, kStanding };

/// A body model with M markers on it: what all frames of all its recordings share.
struct MarkedPerson {
  std::shared_ptr<const BodyModel> model;
  MarkedBody body;
  std::vector<MarkerSite> sites;  ///< M
  Eigen::VectorXd usual;          ///< (3 M) places that the sites tell, in the joints' frames
  Eigen::MatrixXd J_usual;        ///< by betas (3 M x B)
  std::vector<SkinPatch> skin;    ///< M, about the usual places; empty but of kSkin
  Eigen::Matrix3Xd
      bent;  ///< (3 x M) usual places of a body upright, forearms forward; T-pose's axes
  std::vector<int> joint_of_vertex;  ///< that a vertex follows most
  bool pelvis_marked = false;        ///< pelvis or legs; else the pelvis keeps its place
  // Of a frame's q.
  Eigen::VectorXd rest;
  Eigen::MatrixXd root_information;  ///< of each part by itself: zero between parts
  std::vector<PoseLimit> limits;
  Eigen::VectorXd acceleration;  ///< usual, rad / s^2
  double limit_sigma_rad = 0.03;

  /// Rest and limits of each of a pose's parts (FreePose::Parts).
  std::vector<std::unique_ptr<PoseRest>> RestTerms() const;
  /// Markers on the skin at `places` (3 M) move as the skin does there (MarkedBody::shares).
  void BlendAt(const Eigen::VectorXd& places);
  /// Joints below the neck that no marker moves: they rest.
  std::vector<int> Unmarked() const;
};

/// The joint that each vertex follows more than any other.
std::vector<int> JointOfVertices(const std::shared_ptr<const BodyModel>& model);

/// Free are the joints between the pelvis and the markers, and fingers by few numbers each: flexion
/// at the base and beyond it, spread; fingers without a marker go with their neighbor. Their prior
/// is normal, with mean and covariance of this hand open, at ease and about to pinch things of 1 to
/// 9 cm (PinchHand).
MarkedPerson MakeMarkedPerson(std::shared_ptr<const BodyModel> model, std::vector<MarkerSite> sites,
                              RestPosture posture);

}  // namespace holdfast
