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

/// Height of a marker's center above the skin: mean 8 mm, standard deviation 8 mm between
/// recordings and 3 mm between the markers of one recording.
constexpr double kMarkerHeight_m = 0.008, kMarkerHeightSigma_m = 0.008, kOnSkinSigma_m = 0.003;

/// Posture of legs without markers.
enum class RestPosture { kSeated, kStanding };

/// A body model with M markers: data shared by all frames of all recordings of a person.
struct MarkedPerson {
  std::shared_ptr<const BodyModel> model;
  MarkedBody body;
  std::vector<MarkerSite> sites;  ///< M
  Eigen::VectorXd usual;  ///< (3 M) nominal marker positions from the sites, in the joints' frames
  Eigen::MatrixXd J_usual;      ///< Jacobian by betas (3 M x B)
  std::vector<SkinPatch> skin;  ///< M, around the nominal positions; empty unless kSkin
  Eigen::Matrix3Xd
      bent;  ///< (3 x M) nominal positions of an upright body, forearms forward; T-pose's axes
  std::vector<int> joint_of_vertex;  ///< joint with the largest weight of each vertex
  bool pelvis_marked = false;        ///< pelvis or legs; otherwise the pelvis is static
  // Of a frame's q.
  Eigen::VectorXd rest;
  Eigen::MatrixXd root_information;  ///< block-diagonal by part
  std::vector<PoseLimit> limits;
  Eigen::VectorXd acceleration;  ///< typical, rad / s^2

  /// Rest and limit terms of each part of a pose (FreePose::Parts).
  std::vector<std::unique_ptr<PoseRest>> RestTerms() const;
  /// Makes markers on the skin at `places` (3 M) move with the skin there (MarkedBody::shares).
  void BlendAt(const Eigen::VectorXd& places);
  /// Joints below the neck without markers: they keep the rest pose.
  std::vector<int> Unmarked() const;
};

/// Returns the joint with the largest skinning weight of each vertex.
std::vector<int> JointOfVertices(const std::shared_ptr<const BodyModel>& model);

/// Creates the person. Free variables are the joints between pelvis and markers, and a few values
/// per finger: flexion at its base and beyond, and spread; fingers without a marker follow their
/// neighbor. Their prior is normal, with mean and covariance of this hand open, relaxed and about
/// to pinch objects of 1 to 9 cm (PinchHand).
MarkedPerson MakeMarkedPerson(std::shared_ptr<const BodyModel> model, std::vector<MarkerSite> sites,
                              RestPosture posture);

}  // namespace holdfast
